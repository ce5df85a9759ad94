-- Colliders that move.
local scene = require "testing.scene"
local command = require "testing.command"

local function run(chain, points, frames, substeps)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { %s } } %s :solve { substeps = %d }]])
    :format(points, chain, substeps or 1), { frames = {1, frames} })
end

describe("a wall that moves", function()
  it("gives a point at rest (1 + bounce) times its speed, whatever it is", function()
    for _, speed in ipairs { 0.5, 24, 1000 } do
      local p = run(([[:collide { shape = rapid.shape.plane { normal = {1, 0, 0} }, bounce = 0.5,
        transform = function(frame) return rapid.translate(%g * frame.time, 0, 0) end }]]):format(speed),
        "P = {{0.4, 0, 0}}", 25)[25][1]
      local met = 0.4 / speed
      if met < 1 then
        assert.near(1.5 * speed, p.v.x, 1e-4 * speed)
        assert.near(0.4 + 1.5 * speed * (1 - met), p.P.x, 1e-4 * speed)
      else
        assert.equal(0, p.v.x)
      end
    end
  end)

  it("carries what sticks to it, turning too", function()
    local points = run([[:collide { shape = rapid.shape.sphere { radius = 1 }, response = "stick",
      transform = function(frame) return rapid.rotate({0, 0, 1}, 90 * frame.time) end }]],
      "P = {{3, 0, 0}}, v = {{-12, 0, 0}}", 49)
    local met = 2 / 12
    local angle = math.rad(90 * (2 - met))
    assert.near({math.cos(angle), math.sin(angle), 0}, points[49][1].P, 1e-4)
    assert.near(math.pi / 2, points[49][1].v:length(), 1e-4)
  end)

  it("lifts what rests on it, and stays above none of it", function()
    local result = run([[:gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.2, friction = 0.5,
      transform = function(frame) return rapid.translate(0, 0.5 - 0.5 * math.cos(3 * frame.time), 0) end }]],
      "P = {{0, 0, 0}, {1, 0.3, 0}}", 73)
    for frame, points in result:frames() do
      local height = 0.5 - 0.5 * math.cos(3 * (frame - 1) / 24)
      for i = 1, 2 do
        local above = points[i].P.y - height
        assert.truthy(above > -1e-4, ("%d: %g"):format(frame, above)) -- the motion is followed to 1e-5 of its path
      end
    end
    assert.near(0.5 - 0.5 * math.cos(9), result[73][1].P.y, 0.02)
  end)

  -- A point flush with a box that turns it is a bead on a rod: pressed by the Coriolis force, it moves outwards as
  -- cosh ωt.
  it("presses what lies flush with a face that turns, however it would bounce", function()
    local rate = math.rad(90)
    local expected = math.cosh(rate / 2)
    local function off(bounce, substeps)
      local p = run(([[:collide { shape = rapid.shape.box { size = {8, 0.1, 1} }, bounce = %g, record = 0,
        transform = function(frame) return rapid.rotate({0, 0, 1}, 90 * frame.time) end }]]):format(bounce),
        ("P = {{1, 0.05, 0}}, v = {{%.9g, %.9g, 0}}"):format(-0.05 * rate, rate), 13, substeps)[13][1]
      local cos, sin = math.cos(rate / 2), math.sin(rate / 2)
      assert.near(0.05, cos * p.P.y - sin * p.P.x, 1e-5)
      assert.truthy(p.hittotal < 100, p.hittotal) -- its hops decrease to rounding
      return math.abs(cos * p.P.x + sin * p.P.y - expected)
    end
    assert.truthy(off(0, 1) < 1e-4)
    assert.truthy(off(0, 4) < 2e-5)
    assert.truthy(off(1, 1) < 1e-4)
  end)

  -- With friction: x'' = ω² x - μ (2 ω x' - ω² y), y the height of the face above the axis.
  it("slows what slides on a face that turns by friction of second order in the sub-step", function()
    local rate, height, friction = math.rad(90), 0.05, 0.3
    local root, rest = math.sqrt(1 + friction * friction), -friction * height
    local slow, fast = rate * (-friction - root), rate * (-friction + root)
    local grows = (1 - slow * (1 - rest)) / (fast - slow) -- from x = 1 and x' = 1
    local expected = rest + grows * math.exp(fast / 2) + (1 - rest - grows) * math.exp(slow / 2)
    for _, kind in ipairs { "shape", "levelset" } do
      local shape = kind .. ".box { size = {8, 0.1, 1}" .. (kind == "levelset" and ", voxel = 0.02 }" or " }")
      for substeps, tolerance in pairs { [1] = 1e-3, [4] = 6e-5, [16] = 5e-6 } do
        local p = run(([[:collide { shape = rapid.%s, bounce = 0, friction = %g,
          transform = function(frame) return rapid.rotate({0, 0, 1}, 90 * frame.time) end }]]):format(shape, friction),
          ("P = {{1, %g, 0}}, v = {{%.9g, %.9g, 0}}"):format(height, 1 - height * rate, rate), 13, substeps)[13][1]
        local cos, sin = math.cos(rate / 2), math.sin(rate / 2)
        assert.near(expected, cos * p.P.x + sin * p.P.y, tolerance)
        assert.near(height, cos * p.P.y - sin * p.P.x, 1e-6)
      end
    end
  end)

  -- Like on a slope of the same angle at rest, except that the normal force is that of the body's frame.
  it("holds what lies on a face that turns, and is not yet steeper than friction, to the place", function()
    local friction, rate = 0.5, math.rad(20)
    local from = { 0.5, 0.05 }
    local frames = 24
    local p = run(([[:gravity {} :collide { shape = rapid.levelset.box { size = {4, 0.1, 1}, voxel = 0.025 },
      friction = %g, bounce = 0, transform = function(frame) return rapid.rotate({0, 0, 1}, 20 * frame.time) end }]])
      :format(friction), ("P = {{%g, %g, 0}}, v = {{%.9g, %.9g, 0}}"):format(from[1], from[2], -from[2] * rate,
        from[1] * rate), frames + 1)[frames + 1][1]
    local cos, sin = math.cos(rate), math.sin(rate)
    assert.near({from[1], from[2], 0}, vec3(cos * p.P.x + sin * p.P.y, cos * p.P.y - sin * p.P.x, p.P.z), 2e-6)
  end)

  -- A bead on a rod without gravity: no force acts in the world frame. In the frame of the rod, it is driven outwards,
  -- x = x0 cosh ωt + u/ω sinh ωt. The Coriolis force, 2 ω x', exceeds the lifting force, ω² y, so the bead leaves at
  -- the end of the rod. Within a voxel of the end the field's normals turn, and one facet after another seems to
  -- release it.
  it("supports points near the edge of the last voxel of a face", function()
    local rate, height, reach = math.rad(30), 0.05, 1.25
    for _, pressed in ipairs { 1.2, 2 } do -- multiples of the lifting force
      local u = pressed * rate * height / 2
      local function along(x0, t) return x0 * math.cosh(rate * t) + u / rate * math.sinh(rate * t) end
      local P, v = {}, {}
      for i = 1, 24 do
        local x0 = reach - 0.05 * i / 24
        P[i] = ("{%.17g, %g, %g}"):format(x0, height, 0.01 * i)
        v[i] = ("{%.9g, %.9g, 0}"):format(u - rate * height, rate * x0)
      end
      local result = run([[:collide { shape = rapid.levelset.box { size = {2.5, 0.1, 1}, voxel = 0.05 }, bounce = 0,
        transform = function(frame) return rapid.rotate({0, 0, 1}, 30 * frame.time) end }]],
        ("P = {%s}, v = {%s}"):format(table.concat(P, ", "), table.concat(v, ", ")), 25)
      for i = 1, 24 do
        local x0, h = reach - 0.05 * i / 24, 1 / 24
        local p, x = result[2][i], along(x0, h)
        local cos, sin = math.cos(rate * h), math.sin(rate * h)
        if x < reach then
          assert.near(x, cos * p.P.x + sin * p.P.y, 3e-7)
          assert.near(height, cos * p.P.y - sin * p.P.x, 1.5e-6)
        end
        -- Time at which x is `reach`: from e^ωt, the larger root of (x0 + u/ω) e^2ωt - 2 reach e^ωt + x0 - u/ω. Then
        -- straight on.
        local ratio = u / rate
        local parts = math.log((reach + math.sqrt(reach ^ 2 - x0 ^ 2 + ratio ^ 2)) / (x0 + ratio)) / rate
        cos, sin = math.cos(rate * parts), math.sin(rate * parts)
        local at = vec3(reach * cos - height * sin, reach * sin + height * cos, 0.01 * i)
        local out = rate * (x0 * math.sinh(rate * parts) + ratio * math.cosh(rate * parts))
        local off = vec3(out * cos - rate * at.y, out * sin + rate * at.x, 0)
        assert.near(at + (1 - parts) * off, result[25][i].P, 2e-3) -- a 25th of a voxel: the field has a rounded edge
      end
    end
  end)

  it("moves points out that are born in a body turning about a point outside it, in few contacts", function()
    local points = run([[:collide { bounce = 1, record = 0, cut = {},
      shape = rapid.shape.sphere { radius = 0.147, center = {-0.063, 0.063, -0.063} },
      transform = function(frame) return rapid.rotate({0, 0, 1}, 152 * frame.time) end }]],
      "P = {{0, 0, 0}, {0.03, -0.02, 0.01}, {-0.04, 0.05, 0.02}}", 6, 16)[6]
    local angle = math.rad(152 * 5 / 24)
    local cos, sin = math.cos(angle), math.sin(angle)
    local center = vec3(-0.063 * (cos + sin), 0.063 * (cos - sin), -0.063)
    for i = 1, 3 do
      assert.truthy((points[i].P - center):length() > 0.147 - 1e-7)
      assert.truthy(points[i].hittotal < 100, points[i].hittotal)
    end
  end)

  it("drives points along by friction up to its speed, as a conveyor does", function()
    local result = run([[:gravity {} :collide { shape = rapid.shape.plane {}, friction = 0.4,
      transform = function(frame) return rapid.translate(2 * frame.time, 0, 0) end }]], "P = {{0, 0, 0}}", 49)
    assert.near(0.4 * 9.81 * 0.25, result[7][1].v.x, 0.02)
    assert.near(2, result[49][1].v.x, 1e-4)
    assert.equal(0, result[49][1].P.y)
  end)

  it("may be given by keys, and by :transform of the shape", function()
    local keyed = run([[:collide { shape = rapid.shape.plane { normal = {1, 0, 0} }, bounce = 0,
      transform = { [1] = rapid.translate(0, 0, 0), [25] = rapid.translate(3, 0, 0) } }]], "P = {{1, 0, 0}}", 25)
    local moved = run([[:collide { bounce = 0, shape = rapid.shape.plane { normal = {1, 0, 0} }
      :transform { [1] = rapid.translate(0, 0, 0), [25] = rapid.translate(3, 0, 0) } }]], "P = {{1, 0, 0}}", 25)
    assert.near({3, 0, 0}, keyed[25][1].P, 1e-4)
    assert.same_points(keyed[25], moved[25])
  end)
end)

describe("a level set that turns", function()
  local text = [[
return rapid.create { fps = 24, seed = 3 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 3, 0} }, rate = 20000, life = 1.5 } :gravity {}
  :collide { shape = rapid.levelset.box { size = {2, 0.4, 2}, voxel = 0.05 }, bounce = 0.4, friction = 0.3,
    method = "%s", transform = function(frame) return rapid.rotate({0, 0, 1}, 200 * frame.time) end }
  :solve { substeps = %d }]]

  it("has no point inside, by each method, the same bits on 1, 2 and 7 threads", function()
    for method, substeps in pairs { continuous = 1, project = 8, backtrack = 8 } do
      local chain = text:format(method, substeps)
      local one = scene.run(chain, { frames = {36, 36}, threads = 1 })[36]
      assert.points(one).finite()
      local angle = math.rad(200 * 35 / 24)
      local deepest = 0
      for i = 1, #one do
        local P = one[i].P
        local x, y = P.x * math.cos(angle) + P.y * math.sin(angle), P.y * math.cos(angle) - P.x * math.sin(angle)
        deepest = math.max(deepest, math.min(1 - math.abs(x), 0.2 - math.abs(y), 1 - math.abs(P.z)))
      end
      assert.truthy(deepest < 0.02, ("%s: %g m deep"):format(method, deepest))
      for _, threads in ipairs { 2, 7 } do
        assert.same_points(one, scene.run(chain, { frames = {36, 36}, threads = threads })[36])
      end
    end
  end)
end)

describe("a picture", function()
  it("shows a shape where it is at its frame", function()
    local folder = command.folder()
    local function pictures(transform)
      folder:write("scene.lua", ([[
local rapid = require "rapid"
local box = rapid.shape.box { size = {1, 0.2, 0.4} }
return rapid.create { points = rapid.points.from { P = {{2, 2, 0}} } } :collide { shape = box %s } :solve {}
]]):format(transform))
      local ran = command.rapid("run scene.lua -f 1-9x8 --quiet --size 160x90 --camera 0,2,5,0,0,0 -o a.####.png",
        { cwd = folder.path })
      assert.equal("", ran.stderr)
      return folder:read "a.0001.png", folder:read "a.0009.png"
    end
    local first, last = pictures ""
    assert.equal(first, last)
    for _, transform in ipairs { ", transform = { [1] = rapid.scale(1), [9] = rapid.translate(0, 1, 0) }",
        ":transform { [1] = rapid.scale(1), [9] = rapid.translate(0, 1, 0) }" } do
      local begin, moved = pictures(transform)
      assert.equal(first, begin)
      assert.not_equal(begin, moved)
    end
  end)
end)
