-- Moving and deforming shapes for forces, pins and nodes in Lua, evaluated at the time of each frame and substep.
local scene = require "testing.scene"
local command = require "testing.command"

local fps, rise = 24, 0.01

-- A square at the height rise (frame - 1)², which splines through the frames reproduce.
for frame = 1, 30 do
  local y = rise * (frame - 1) ^ 2
  scene.folder:write(("plate.%04d.obj"):format(frame),
    ("v -2 %.9g -2\nv 2 %.9g -2\nv 2 %.9g 2\nv -2 %.9g 2\nf 1 4 3\nf 1 3 2\n"):format(y, y, y, y))
end

-- A box of 2 x 0.4 x 2 m whose middle has the same height.
for frame = 1, 12 do
  local lines = {}
  for corner = 0, 7 do
    lines[#lines + 1] = ("v %g %.9g %g"):format(2 * (corner % 2) - 1,
      0.4 * (math.floor(corner / 2) % 2) - 0.2 + rise * (frame - 1) ^ 2, 2 * math.floor(corner / 4) - 1)
  end
  for _, face in ipairs { "1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6" } do
    lines[#lines + 1] = "f " .. face
  end
  scene.folder:write(("slab.%04d.obj"):format(frame), table.concat(lines, "\n") .. "\n")
end

local plate = 'local plate = rapid.mesh.read "plate.####.obj" '
local slab = [[
local slab = rapid.levelset.from_mesh(rapid.mesh.read "slab.####.obj", { voxel = 0.05, half_width = 8 }) ]]

local function height(time) return rise * (fps * time) ^ 2 end

describe("a force", function()
  it("follows a moving shape that a function of the frame returns, also if a number changes with time", function()
    local function position(shape)
      local result = scene.run(plate .. ([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.3, 1, 0}} } }
  :attract { shape = %s, strength = function(frame) return 2 + frame.time end, falloff = 0 }
  :solve { substeps = 3 }]]):format(shape), { frames = {8, 8} })
      return result[8][1].P
    end
    local constant, called = position "plate", position "function() return plate end"
    for _, axis in ipairs { "x", "y", "z" } do assert.equal(constant[axis], called[axis]) end
  end)
end)

describe("a spring", function()
  -- x'' = -w² (x - u t) from x(0) = 0 at rest: x = u t - u sin(w t) / w
  it("to a plane that rises uniformly follows its closed form, at any step", function()
    local w, u = 5, 2
    local function error_of(substeps)
      local result = scene.run(([[
local floor = rapid.shape.plane {}:transform(function(frame) return rapid.translate(0, %g * frame.time, 0) end)
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.3, 0, 0}} } }
  :spring { target = floor, stiffness = %g } :solve { substeps = %d }]]):format(u, w * w, substeps),
        { frames = {25, 25} })
      assert.near(0.3, result[25][1].P.x, 1e-6)
      return math.abs(result[25][1].P.y - (u - u * math.sin(w) / w))
    end
    for _, substeps in ipairs { 1, 2, 8 } do assert.near(0, error_of(substeps), 2e-6) end
  end)

  -- The ball moves along x and accelerates. The energy is relative to it, with the resulting inertial force.
  it("gives a point that goes around a ball no energy, at any stiffness, wherever the ball goes", function()
    for _, k in ipairs { 1e2, 1e4, 1e6, 1e8 } do
      for _, case in ipairs { {0.5, 0}, {-3, 0}, {1, 2} } do
        local u, a = unpack(case)
        local result = scene.run(([[
local function along(f) return rapid.translate(%g * f.time + %g * f.time ^ 2, 0, 0) end
local ball = rapid.shape.sphere { radius = 1 }:transform(along)
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 1, 0}}, v = {{%g, 0, 2}} } }
  :spring { target = ball, stiffness = %g } :solve {}]]):format(u, a / 2, u, k), { frames = {1, 73} })
        for frame = 1, 73 do
          local t, p = (frame - 1) / 24, result[frame][1]
          local P, v = p.P - vec3(u * t + a / 2 * t ^ 2, 0, 0), p.v - vec3(u + a * t, 0, 0)
          local off = P:length() - 1
          local rounding = (frame - 1) * 1e-6 * math.sqrt(k) + k * 1e-12
          assert.near(2, v:dot(v) / 2 + k / 2 * off ^ 2 + a * P.x, 5e-3 + rounding)
        end
      end
    end
  end)

  it("pulls to the nearest position on a mesh, from any distance", function()
    local result = scene.run(plate .. [[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 40, 0}, {5, 0, 0}} } }
  :spring { target = plate, stiffness = 1e6, damping = 200 } :solve { substeps = 32 }]], { frames = {1, 20} })
    for _, frame in ipairs { 5, 12, 20 } do
      local time = (frame - 1) / fps
      -- Lags by the effect of the damping.
      local behind = 2 * rise * fps ^ 2 * time * 200 / 1e6
      for i = 1, 2 do assert.near(height(time) - behind, result[frame][i].P.y, 0.2 * behind + 1e-4) end
      assert.truthy(math.abs(result[frame][2].P.x) < 2 + 1e-4) -- it was next to the square
    end
  end)
end)

describe("attract", function()
  -- With falloff 0 the acceleration has constant magnitude, so its direction shows the position of the surface.
  it("draws to a shape where that is at the time", function()
    local result = scene.run([[
local ball = rapid.shape.sphere { radius = 0.1 }:transform { [1] = rapid.translate(-1, 0, 0),
  [13] = rapid.translate(1, 0, 0) }
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 1, 0}} } }
  :attract { shape = ball, strength = 1e-3, falloff = 0 } :solve { substeps = 8 }]], { frames = {13, 13} })
    -- The ball passes symmetrically: ∫ cos over the path, with x = -1 + 4t, along y: 1e-3 asinh(1) / 2 downward.
    local v = result[13][1].v
    assert.near(0, v.x, 2e-6)
    assert.near(-1e-3 * math.log(1 + math.sqrt(2)) / 2, v.y, 2e-6)
  end)

  it("takes a mesh of files and its level set", function()
    for _, shape in ipairs { "plate", "rapid.levelset.from_mesh(body, { voxel = 0.05, half_width = 8 })" } do
      local result = scene.run(plate .. [[local body = rapid.mesh.read "slab.####.obj"
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.5, 0}} } }
  :attract { shape = ]] .. shape .. [[, strength = 2, falloff = 0 } :solve {}]], { frames = {2, 2} })
      assert.near(-2 / fps, result[2][1].v.y, 1e-5)
    end
  end)
end)

-- Nodes in Lua that query a shape at the end of the frame, and at each substep.
scene.folder:write("measure.lua", [[
local rapid = require "rapid"
return rapid.node {
  name = "measure", doc = "Writes the distance and the gradient.",
  params = { shape = { "shape", required = true, doc = "which" } },
  makes = { d = 0, out = {0, 0, 0} },
  points = function(p, _, params) p.d, p.out = params.shape:distance(p.P), params.shape:gradient(p.P) end,
}]])
scene.folder:write("measure_within.lua", [[
local rapid = require "rapid"
return rapid.node {
  name = "measure_within", doc = "Writes how far the height of a shape below P is ever off.",
  params = { shape = { "shape", required = true, doc = "which" }, rise = { "float", default = 0, doc = "m/s²" } },
  makes = { off = 0 },
  action = function(p, step, params)
    p.off = math.max(p.off, math.abs(p.P.y - params.shape:distance(p.P) - params.rise * step.time ^ 2))
  end,
}]])

describe("a node in Lua", function()
  it("has the distance and gradient of shapes that move as they are at the end of the frame", function()
    local function measured(shape)
      return scene.run(plate .. slab .. [[
local floor = rapid.shape.plane {}:transform(function(frame) return rapid.translate(0, 3 * frame.time, 0) end)
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.5, 0}} } }
  :measure { shape = ]] .. shape .. " } :solve {}", { frames = {1, 6} })
    end
    local floor, sheet, box = measured "floor", measured "plate", measured "slab"
    for frame = 2, 6 do
      local time = (frame - 1) / fps
      assert.near(0.5 - 3 * time, floor[frame][1].d, 1e-6)
      assert.near(0.5 - height(time), sheet[frame][1].d, 1e-6)
      assert.near(0.3 - height(time), box[frame][1].d, 1e-4)
      for _, result in ipairs { floor, sheet, box } do assert.near({0, 1, 0}, result[frame][1].out, 1e-3) end
    end
  end)

  it("in an action has them at the time of each point and sub-step", function()
    for _, subframes in ipairs { 1, 2 } do
      local result = scene.run(([[%s
return rapid.create { fps = 24, subframes = %d }
  :emit { source = rapid.points.from { P = {{0, 9, 0}, {1, 9, 0}} }, rate = 100, birth = "random" }
  :measure_within { shape = plate, rise = 5.76 } :solve { substeps = 5 }]]):format(plate, subframes),
        { frames = {1, 9} })
      assert.truthy(#result[9] > 20)
      assert.truthy(result[9]:max("off") < 2e-5, result[9]:max("off"))
    end
  end)

  it("gives the same bits on any number of threads", function()
    local text = plate .. slab .. [[
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.05 } }
  :attract { shape = slab } :spring { target = plate, stiffness = 2 } :avoid { shape = slab }
  :measure_within { shape = plate } :solve { substeps = 2 }]]
    local one = scene.run(text, { frames = {1, 4}, threads = 1 })
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one[4], scene.run(text, { frames = {1, 4}, threads = threads })[4])
    end
  end)

  it("makes groups by a shape that moves", function()
    local result = scene.run(plate .. [[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.3, 0}} } }
  :group_by_shape { into = "near", shape = plate, distance = 0.1 } :solve {}]], { frames = {1, 8} })
    for frame = 2, 8 do
      assert.equal(math.abs(0.3 - height((frame - 1) / fps)) <= 0.1, result[frame][1]:within "near")
    end
  end)
end)

describe("a pin", function()
  it("keeps points at their positions over the faces of a mesh in each substep", function()
    -- The second corner of one triangle moves sideways while the triangle turns about z.
    local function corners(frame)
      local t, list = frame - 1, {}
      for _, P in ipairs { {0, 0, 0}, {1 + 0.1 * t, 0, 0}, {0, 0, -1} } do
        local angle = 0.05 * t
        list[#list + 1] = vec3(P[1] * math.cos(angle) - P[2] * math.sin(angle), P[1] * math.sin(angle), P[3])
      end
      return list
    end
    for frame = 1, 10 do
      local text = ""
      for _, P in ipairs(corners(frame)) do text = text .. ("v %.9g %.9g %.9g\n"):format(P.x, P.y, P.z) end
      scene.folder:write(("flap.%04d.obj"):format(frame), text .. "f 1 2 3\n")
    end
    local result = scene.run([[local flap = rapid.mesh.read "flap.####.obj"
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.25, 0.5, -0.5}} } }
  :gravity {} :pin { target = flap } :solve { substeps = 3 }]], { frames = {1, 9} })
    for frame = 2, 9 do
      local c = corners(frame)
      local e1, e2 = c[2] - c[1], c[3] - c[1]
      local place = c[1] + e1 * 0.25 + e2 * 0.5 + e1:cross(e2):normalized() * 0.5
      assert.near(place, result[frame][1].P, 2e-6)
    end
  end)

  it("gives points that it holds by springs, which no step resolves, the velocity of the body", function()
    for _, substeps in ipairs { 1, 4 } do
      local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}} } } :pin { compliance = 1e-7,
    transform = function(f) return rapid.translate(2 * f.time, 0, 0) * rapid.rotate({0, 0, 1}, 90 * f.time) end }
  :solve { substeps = %d }]]):format(substeps), { frames = {1, 13} })
      local angle, rate = math.pi / 4, math.pi / 2
      local along = vec3(-math.sin(angle), math.cos(angle), 0) * rate
      assert.near(vec3(2, 0, 0) + along, result[13][1].v, 1e-3)
    end
  end)

  it("follows a deforming level set, and a mesh that a motion moves", function()
    local result = scene.run(slab .. [[
local board = rapid.mesh.box {}:transform(function(frame) return rapid.translate(frame.time, 0, 0) end)
local on = rapid.create { fps = 24, points = rapid.points.from { P = {{0.3, 0.2, 0.2}} } }
  :pin { target = slab } :solve {}
local beside = rapid.create { fps = 24, points = rapid.points.from { P = {{0.3, 0.2, 0.2}} } }
  :pin { target = board } :solve {}
return { on = on, beside = beside }]], { frames = {1, 10} })
    assert.near({0.3, 0.2 + height(9 / fps), 0.2}, result:output("on")[10][1].P, 1e-5)
    assert.near({0.3 + 9 / fps, 0.2, 0.2}, result:output("beside")[10][1].P, 1e-5)
  end)
end)

-- A body of 3,334 vertices, captured from a dancer, in a folder next to the checkout if it exists.
describe("the jumper", function()
  local folder = command.shell("cd ../shared/assets/jumper && pwd").stdout:match "%S+"

  local test = folder and it or pending
  test("draws points to its surface and keeps those that are pinned to it", function()
    local result = scene.run(([[
local body = rapid.mesh.read "%s/jumper.####.ply"
local drawn = rapid.create { fps = 24, points = rapid.points.grid { size = {1, 2, 1}, spacing = 0.25 } }
  :spring { target = body, stiffness = 4000, damping = 100 } :solve { substeps = 4 } :measure { shape = body }
local dust = rapid.create { fps = 24, seed = 2 } :emit { source = body, impulse = { [1] = 500 } }
  :pin { target = body } :solve {} :measure { shape = body }
return { drawn = drawn, dust = dust }]]):format(folder), { frames = {1, 48} })
    assert.equal(500, #result:output("dust")[48])
    for frame = 2, 48 do assert.truthy(result:output("dust")[frame]:max("d") < 1e-5) end
    assert.truthy(result:output("drawn")[48]:mean("d") < 0.02, result:output("drawn")[48]:mean("d"))
  end)
end)
