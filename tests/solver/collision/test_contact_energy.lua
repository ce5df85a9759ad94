-- The reported energy that contacts add and remove, compared with the points' energy: in random scenes of resting and
-- moving shapes, with all responses, with and without drag and springs, for single and coupled points.
local scene = require "testing.scene"
local json = require "dkjson"
local draw = require("tests.lehmer").new(1)

local g, frames = 9.81, 25
local rounding = 2e-3 -- single precision, for 20 points in 24 frames, plus the approximation of drag and springs

local shapes = {
  "rapid.shape.plane { normal = {0.3, 1, 0} }",
  "rapid.shape.sphere { radius = 0.8 }",
  "rapid.shape.box { size = {3, 0.5, 3} }",
  "rapid.levelset.box { size = {3, 0.5, 3}, voxel = 0.06 }",
  "rapid.levelset.torus { radius = 0.8, tube = 0.3, voxel = 0.06 }",
}
local motions = {
  "rapid.translate(0, 0.4 * math.sin(5 * frame.time), 0)",
  "rapid.translate(0.3 * frame.time, 0, 0) * rapid.rotate({0, 1, 0}, 90 * frame.time)",
  "rapid.rotate({1, 0.2, 0}, 40 * frame.time)",
  "rapid.translate(0, 0.5 * frame.time ^ 2, 0)",
}

-- moves: shapes move. forces: text of the forces in addition to gravity. couples: points also touch each other.
local function random_scene(moves, forces, couples)
  local P, v, mass = {}, {}, {}
  for i = 1, 20 do
    P[i] = ("{%.6g, %.6g, %.6g}"):format(draw.between(-1, 1), draw.between(1.2, 2), draw.between(-1, 1))
    v[i] = ("{%.6g, %.6g, %.6g}"):format(draw.between(-2, 2), draw.between(-3, 1), draw.between(-2, 2))
    mass[i] = ("%.6g"):format(draw.magnitude(-1, 1))
  end
  local text = ([[
return rapid.create { fps = 24, points = rapid.points.from {
  P = {%s},
  v = {%s},
  mass = {%s} } }
]]):format(table.concat(P, ", "), table.concat(v, ", "), table.concat(mass, ", "))
  text = text .. "  :gravity {} " .. forces .. "\n"
  for _ = 1, draw.pick { 1, 1, 2 } do
    local response = draw.pick { "bounce", "bounce", "slide", "stick" }
    local more = response ~= "bounce" and (", adhesion = %.3g"):format(draw.pick { 0, 5, 50 }) or ""
    text = text .. ("  :collide { shape = %s, bounce = %g, friction = %g, response = %q%s%s }\n"):format(
      draw.pick(shapes), draw.pick { 0, 0.5, 1 }, draw.pick { 0, 0.3, 1 }, response, more,
      moves and (", transform = function(frame) return %s end"):format(draw.pick(motions)) or "")
  end
  if couples then text = text .. "  :contact { radius = 0.08, friction = 0.3 }\n" end
  return text .. ("  :solve { substeps = %d }"):format(draw.pick { 4, 8 })
end

-- For points attached by springs of this stiffness, N/m. Returns the energy gain from the first to the last frame, the
-- energy that contacts added and removed, the largest kinetic energy, the largest energy in springs, and the initial
-- energy; J.
local function energies(text, stiffness, target)
  local ran = scene.command("run", text, ("-f 1-%d --stats stats.json --quiet"):format(frames))
  assert.equal(0, ran.status, ran.stderr .. text)
  local added, taken, size = 0, 0, 0
  for _, frame in ipairs(json.decode(scene.folder:read "stats.json").frames) do
    added, taken = added + frame.contact_energy.added, taken + frame.contact_energy.lost
  end
  local first, last, start
  for _, points in scene.run(text, { frames = {1, frames} }):frames() do
    local inner, potential = 0, 0
    for i = 1, #points do
      local p = points[i]
      local d = target and p.P - target or p.P
      inner = inner + 0.5 * (p.mass * p.v:dot(p.v) + stiffness * d:dot(d))
      potential = potential + p.mass * g * p.P.y
    end
    last, size = inner + potential, math.max(size, inner)
    first, start = first or last, start or inner
  end
  return last - first, added, taken, size, start
end

-- takes: the largest fraction of `size` that drag can remove in a second, 2 k or 2 c v.
local kinds = {
  { name = "gravity", forces = "", takes = 0 },
  { name = "drag", forces = ":drag { linear = 0.05 }", takes = 0.1 },
  { name = "quadratic drag", forces = ":drag { quadratic = 0.01 }", takes = 0.2 },
  { name = "springs", forces = ":spring { stiffness = 5, target = {0, 0, 0} }", stiffness = 5, takes = 0 },
}

describe("the energy that contacts add and take", function()
  -- Springs turn points by up to tens of radians in a substep; every other scene has shapes at rest.
  it("is what points on stiff springs gain, and no more than shapes that move can give", function()
    for number = 1, 24 do
      draw.start(2, number)
      local stiffness = draw.magnitude(3, 6)
      local moves = number % 2 == 0
      local text = random_scene(moves, (":spring { stiffness = %g, target = {0, 0.4, 0} }"):format(stiffness), false)
      local gained, added, taken, size, first = energies(text, stiffness, vec3(0, 0.4, 0))
      local reported = ("gained %g J, told %g - %g J, at most %g J:\n%s"):format(gained, added, taken, size, text)
      assert.truthy(math.abs(gained - (added - taken)) < rounding * size, reported)
      assert.truthy(added < (moves and 2 or 1e-6) * first, reported)
    end
  end)

  for _, couples in ipairs { false, true } do
    for _, kind in ipairs(kinds) do
      it(("is what points gain under %s%s"):format(kind.name, couples and ", and from each other" or ""), function()
        for number = 1, 8 do
          draw.start(1, number)
          local moves = number % 2 == 0
          local text = random_scene(moves, kind.forces, couples)
          local gained, added, taken, size = energies(text, kind.stiffness or 0)
          local off = (gained - (added - taken)) / size
          local reported =
            ("gained %g J, told %g - %g J, at most %g J in motion:\n%s"):format(gained, added, taken, size,
            text)
          assert.truthy(off < rounding and off > -rounding - kind.takes, reported)
          -- Shapes at rest add nothing to single points.
          if not moves and not couples then assert.truthy(added < 1e-6 * size, reported) end
        end
      end)
    end
  end
end)
