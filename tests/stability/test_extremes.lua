-- Extreme conditions that must not break anything (numerics.md, Extremes) and are not covered by the tests of a solver
-- or node: forces from the shortest step to the longest, points exactly on shapes and at their centres, shapes that
-- appear, vanish, jump and have no volume, a thousand sub-steps, a hundred thousand frames, and NaN.
local scene = require "testing.scene"
local command = require "testing.command"

local function finite(p)
  for _, x in ipairs { p.P, p.v } do
    if x ~= x or x:length() >= math.huge then return false end
  end
  return true
end

describe("forces", function()
  -- Returns the exact position of a point on a spring in thin air, released at x. Masses are 1e-3 to 1e3, and Ω =
  -- √(k/m).
  local function swung(x, k, c, m, t)
    local omega, beta = math.sqrt(k / m), c / 2
    local turning = math.sqrt(omega ^ 2 - beta ^ 2)
    return x * math.exp(-beta * t) * (math.cos(turning * t) + beta / turning * math.sin(turning * t))
  end

  it("swing a spring in its closed form, for steps from 1e-9 s to 10 s, any mass and size", function()
    for _, h in ipairs { 1e-6, 1e-3, 1 / 24, 10 } do
      for _, substeps in ipairs { 1, 1000 } do
        for _, m in ipairs { 1e-3, 1, 1e3 } do
          for _, size in ipairs { 1e-3, 1, 1e5 } do
            -- Uses the part of the frame's length that has an effect: a radian, or a millionth.
            local k, c = m * (0.9 / h) ^ 2, 0.2 / h
            local p = scene.run(([[
return rapid.create { fps = %.17g, points = rapid.points.from { P = {{%.9g, 0, 0}} } }
  :attribute { mass = %.9g } :spring { stiffness = %.9g } :drag { linear = %.9g } :solve { substeps = %d }]])
              :format(1 / h, size, m, k, c, substeps), { frames = {3, 3} })[3][1]
            assert.near(swung(size, k, c, m, 2 * h), p.P.x, 2e-6 * size)
          end
        end
      end
    end
  end)

  it("draw points to rest or along, at speeds from 0 to 1e6 m/s", function()
    for _, speed in ipairs { 0, 1e-6, 1, 1e6 } do
      for _, h in ipairs { 1e-6, 1 / 24, 10 } do
        local p = scene.run(([[
return rapid.create { fps = %.17g, points = rapid.points.from { P = {{0, 0, 0}}, v = {{%.9g, 0, 0}} } }
  :drag { linear = 2, quadratic = 0.5 } :solve {}]]):format(1 / h, speed), { frames = {4, 4} })[4][1]
        local t, v = 3 * h, speed
        -- The closed form of v' = -2 v - v²/2.
        local fade = math.exp(-2 * t)
        local expected = v * fade / (1 + v / 4 * (1 - fade))
        assert.is_true(p.v.x >= 0 and p.v.x <= v)
        -- Second order if c v h is small, otherwise bounded by both drags alone.
        if speed * h < 1e-2 then assert.near(expected, p.v.x, 1e-4 * v + 1e-12) end
        assert.is_true(p.v.x <= v * fade * (1 + 1e-6) + 1e-30)
        assert.is_true(p.P.x <= math.min(v / 2, v * t) * (1 + 1e-6))
      end
    end
  end)
end)

describe("a whole scene that moves at 100 m/s", function()
  -- Runs a scene in which everything moves: points, air, attractors, and the ground.
  local function run(u, frame)
    return scene.run(([[
local u, P, v = %d, {}, {}
for i = 1, 10 do P[i], v[i] = {i / 10, 1 + i / 5, 0}, {1 - i / 5 + u, i / 3, 0.1 * i} end
local function along(f) return rapid.translate(u * f.time, 0, 0) end
return rapid.create { points = rapid.points.from { P = P, v = v } }
  :gravity {} :wind { velocity = {u, 0, 0}, drag = 0.4 }
  :action("pull", function(p, step) p.force = p.force - 3 * (p.P - vec3(u * step.time, 0.5, 0)) end)
  :collide { shape = rapid.shape.plane {}, transform = along, bounce = 0.6, friction = 0.3 }
  :solve { substeps = 4 }]]):format(u), { frames = {frame, frame} })[frame]
  end

  it("goes the same way as one at rest, to the rounding of the larger numbers", function()
    for _, frame in ipairs { 2, 13 } do
      local still, moving = run(0, frame), run(100, frame)
      local time = (frame - 1) / 24
      for i = 1, #still do
        -- An ulp of 50 m is 4e-6 m, added each frame; a bounce amplifies an error a few times.
        assert.near(still[i].P, moving[i].P - vec3(100 * time, 0, 0), 4e-6 * frame * 4)
        assert.near(still[i].v, moving[i].v - vec3(100, 0, 0), 8e-6 * frame * 16)
      end
    end
  end)
end)

describe("without loss", function()
  it("a ball that is sent back after three bounces returns to where it began", function()
    local text = [[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}}, v = {{0.3, 0.4, 0}} } }
  :points("back", function(p, frame) if frame.number == %d then p.v = -p.v end end)
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 1 }
  :collide { shape = rapid.shape.plane { normal = {-1, 0, 0}, offset = -0.5 }, bounce = 1 }
  :solve {}]]
    local turn = 1 + 60  -- 2.5 s: three bounces
    local p = scene.run(text:format(turn + 1), { frames = {2 * turn - 1, 2 * turn - 1} })[2 * turn - 1][1]
    assert.near({0, 1, 0}, p.P, 2e-5)  -- 120 roundings of P and of v, for 5 s
    assert.near({-0.3, -0.4, 0}, p.v, 2e-5)
  end)

  -- At an analytic wall this holds to rounding (tests/solver). A level set has facets: a point that grazes the valley
  -- between two of them may slide on in it, which removes its speed out of the valley, at most by the angle between
  -- them.
  it("a point in a hollow level set keeps its speed for thousands of bounces, and never gains any", function()
    local result = scene.run([[
local hollow = rapid.levelset.box { size = {3, 3, 3}, voxel = 0.1 }
  :subtract(rapid.levelset.sphere { radius = 1, voxel = 0.1 })
return rapid.create { fps = 1, points = rapid.points.from { P = {{0.1, 0.2, 0}}, v = {{40, 5, 9}} } }
  :collide { shape = hollow, bounce = 1 } :solve {}]], { frames = {101, 101} })
    local p, speed = result[101][1], math.sqrt(40 ^ 2 + 5 ^ 2 + 9 ^ 2)
    assert.is_true(p.v:length() <= speed * (1 + 100 * 6e-8)) -- v is rounded once a frame
    assert.is_true(p.v:length() >= speed * math.cos(0.1))  -- the angle of a voxel at a radius of ten voxels
    assert.is_true(p.P:length() <= 1.01)
  end)
end)

describe("a point exactly on a shape, in its middle or in its corners", function()
  local shapes = {
    ["rapid.shape.plane {}"] = { {0, 0, 0}, {3, 0, 1} },
    ["rapid.shape.sphere { radius = 1 }"] = { {0, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1} },
    ["rapid.shape.box { size = {2, 2, 2} }"] = { {0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 0.5, 0.5} },
    ["rapid.levelset.box { size = {2, 2, 2}, voxel = 0.25 }"] = { {0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 1, 1} },
    ["rapid.levelset.sphere { radius = 1, voxel = 0.25, half_width = 6 }"] = { {0, 0, 0}, {0, 1, 0} },
    ["rapid.levelset.torus { radius = 1, tube = 0.4, voxel = 0.1 }"] = { {0, 0, 0}, {1, 0, 0}, {1.4, 0, 0} },
  }

  it("leaves it without hurry, or stays, by any method and response, at rest or in motion", function()
    for shape, places in pairs(shapes) do
      local P, v = {}, {}
      for _, place in ipairs(places) do
        for _, way in ipairs { {0, 0, 0}, {0, -1, 0}, {0, 1, 0}, {1, -1, 0} } do
          P[#P + 1] = ("{%g, %g, %g}"):format(place[1], place[2], place[3])
          v[#v + 1] = ("{%g, %g, %g}"):format(way[1], way[2], way[3])
        end
      end
      for _, method in ipairs { "continuous", "backtrack", "project" } do
        for _, response in ipairs { "bounce", "slide", "stick", "die" } do
          for _, bounce in ipairs { 0, 1 } do
            local text = ([[
return rapid.create { points = rapid.points.from { P = {%s}, v = {%s} } } :gravity {}
  :collide { shape = %s, method = "%s", response = "%s", bounce = %d } :solve {}]]):format(table.concat(P, ", "),
              table.concat(v, ", "), shape, method, response, bounce)
            local points = scene.run(text, { frames = {13, 13} })[13]
            for i = 1, #points do
              local p = points[i]
              assert.is_true(finite(p), text)
              -- Half a second of falling adds 4.9 m/s. Leaving a shape of 1 m adds a fall of 4.4 m/s.
              assert.is_true(p.v:length() <= math.sqrt(2) + 4.91 + 4.5, text)
            end
          end
        end
      end
    end
  end)
end)

describe("a collider", function()
  local function run(collide, frames)
    return scene.run(([[
local ball = rapid.shape.sphere { radius = 0.5 }
local P, v = {}, {}
for i = 1, 20 do P[i], v[i] = {i / 20 - 0.5, 0.3 + i / 40, 0.1}, {0, -1, 0} end
return rapid.create { points = rapid.points.from { P = P, v = v } } :gravity {} :collide { %s } :solve {}]])
      :format(collide), frames)
  end
  -- Allows the speed of a one-second fall from 0.8 m/s but no more, because no change of a shape may push points.
  local function check(points, most)
    for i = 1, #points do
      assert.is_true(finite(points[i]))
      assert.is_true(points[i].v:length() <= most)
    end
  end

  it("that appears around points, and vanishes, leaves them without speed of its own", function()
    local text = "bounce = 0.5, shape = function(f) return %s end"
    for _, shape in ipairs {
      "f.number % 2 == 0 and ball or rapid.shape.sphere { radius = 0.5, center = {0, 100, 0} }",
      "rapid.shape.sphere { radius = f.number % 3 == 0 and 3 or 1e-6 }",
    } do
      check(run(text:format(shape), { frames = {25, 25} })[25], 1 + 9.81 + 8)
    end
  end)

  it("that jumps past and onto points gives them no more than a hit at the speed of the jump", function()
    local keys = {}
    for f = 1, 25 do keys[f] = ("[%d] = rapid.translate(0, %d, 0)"):format(f, f % 2 * 40) end
    -- At 24 fps it jumps at 960 m/s. A point in its path is hit and leaves with at most (1 + bounce) times that speed.
    local collide = "bounce = 0.5, shape = ball, transform = {" .. table.concat(keys, ", ") .. "}"
    check(run(collide, { frames = {25, 25} })[25], 1.5 * 960 * 1.01 + 12)
  end)

  it("of no volume is refused", function()
    local message = scene.error "return rapid.create {} :collide { shape = rapid.shape.box { size = {4, 0, 4} } }"
    assert.truthy(message:find("size = {4, 0, 4}: each edge must be above 0", 1, true), message)
  end)

  it("that is a level set is refused where points are so large that its band would not fit, or take minutes", function()
    local function message(radius)
      return scene.error(("return rapid.create { points = two } :collide { radius = %g, "
        .. "shape = rapid.levelset.sphere { radius = 1, voxel = 0.1 } } :solve {}"):format(radius))
    end
    local text = 'scene.lua:1: node "collide1": points with a radius of %d m need a band of %d voxels of 0.1 m '
      .. "around its level set, about %s voxels; at most 1.3e+08 are possible: give it a larger voxel"
    assert.equal(text:format(400, 4002, "5.2e+11"), message(400))
    assert.equal(text:format(55, 552, "1.4e+09"), message(55))
  end)

  it("that turns under points many times its size, on a face or beside it, takes no longer than any", function()
    local began = os.clock()
    local result = scene.run([[
local some = rapid.points.grid { size = {1, 0.5, 0.5}, spacing = 0.0625 } -- in it at first: taken out along z
return rapid.create { points = some } :collide { radius = 20, bounce = 1,
    shape = rapid.shape.box { size = {3, 3, 1}, center = {0.01, 0, 0.1} },
    transform = function(frame) return rapid.rotate({0, 0, 1}, 3000 * frame.time) end }
  :solve { substeps = 16 }]], { frames = {1, 5} })
    for i = 1, #result[5] do
      local p, first = result[5][i], result[1][i]
      assert.near({first.P.x, first.P.y, first.P.z < 0.1 and -20.4 or 20.6}, p.P, 1e-5)
      assert.near({0, 0, 0}, p.v, 1e-5)
    end
    assert.truthy(os.clock() - began < 10, "it takes 0.5 s; by steps of nothing but rounding, minutes")
  end)

  it("of hardly any volume, a sheet, stops points from both sides", function()
    local result = scene.run([[
local P, v = {}, {}
for i = 1, 20 do P[i], v[i] = {i / 40, i % 2 == 0 and 0.3 or -0.3, 0.1}, {0, i % 2 == 0 and -3 or 3, 0} end
return rapid.create { points = rapid.points.from { P = P, v = v } }
  :collide { shape = rapid.shape.box { size = {4, 1e-6, 4} }, bounce = 1 } :solve {}]], { frames = {13, 13} })
    for i = 1, 20 do
      local p, side = result[13][i], i % 2 == 0 and 1 or -1
      assert.near({i / 40, side * 1.2, 0.1}, p.P, 1e-5)  -- back and forth for half a second
      assert.near({0, side * 3, 0}, p.v, 1e-5)
    end
  end)

  it("of a mesh that is turned inside out, or flat, is refused or stays finite", function()
    for _, mesh in ipairs {
      "rapid.mesh.from { points = {{0,0,0},{1,0,0},{0,1,0},{0,0,1}}, faces = {{1,2,3},{1,4,2},{2,4,3},{3,4,1}} }",
      "rapid.mesh.from { points = {{0,0,0},{1,0,0},{0,1,0},{0,0,1}}, faces = {{3,2,1},{2,4,1},{3,4,2},{1,4,3}} }",
      "rapid.mesh.from { points = {{0,0,0},{1,0,0},{1,0,1}}, faces = {{1,2,3},{3,2,1}} }",
    } do
      local text = ([[
local solid = rapid.levelset.from_mesh(%s, { voxel = 0.05 })
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25 } } :gravity {}
  :collide { shape = solid } :solve {}]]):format(mesh)
      local ok, result = pcall(scene.run, text, { frames = {13, 13} })
      if ok then check(result[13], 4.91 + 6) else assert.truthy(result:find "scene.lua:%d+: ", result) end
    end
  end)
end)

describe("a thousand sub-steps", function()
  it("of a fall, a bounce and a drag are as exact as one", function()
    local text = [[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}}, v = {{1, 0, 0}} } }
  :gravity {} %s :collide { shape = rapid.shape.plane {}, bounce = 0.5 } :solve { substeps = %d }]]
    local one = scene.run(text:format("", 1), { frames = {25, 25} })[25][1]
    local many = scene.run(text:format("", 1000), { frames = {25, 25} })[25][1]
    assert.near(one.P, many.P, 3e-6)
    assert.near(one.v, many.v, 3e-6)
    local dragged = scene.run(text:format(":drag { linear = 2 }", 1000), { frames = {9, 9} })[9][1]
    local t = 8 / 24
    assert.near((1 - math.exp(-2 * t)) / 2, dragged.P.x, 2e-6)
    assert.near(1 - 9.81 / 2 * (t - (1 - math.exp(-2 * t)) / 2), dragged.P.y, 2e-6)
  end)
end)

describe("a hundred thousand frames", function()
  it("lose no birth, no age and no rest", function()
    local result = scene.run([[
local floor = rapid.points.from { P = {{5, 0, 0}} }
local still = rapid.create { points = floor } :gravity {} :collide { shape = rapid.shape.plane {} } :solve {}
local born = rapid.create {} :emit { source = rapid.points.from { P = {{0, 0, 0}} }, rate = 2.4, life = 1,
  birth = "even", velocity = {1, 0, 0} } :solve {}
return { still = still, born = born }]], { frames = {100001, 100001} })
    local still, born = result:output "still"[100001], result:output "born"[100001]
    assert.same({5, 0, 0}, { still[1].P.x, still[1].P.y, still[1].P.z })
    assert.same({0, 0, 0}, { still[1].v.x, still[1].v.y, still[1].v.z })
    -- At t = 100,000 / 24 s: birth number k is at (k + 1) / 2.4, the last one 10,000; each moves at 1 m/s from its
    -- birth on.
    assert.equal(3, #born)
    for i = 1, 3 do
      local p = born[i]
      local age = 100000 / 24 - (p.id + 1) / 2.4
      assert.near(age, p.P.x, 2e-6)
    end
  end)
end)

describe("a number that is none", function()
  local head = [[
local rapid = require "rapid"
local set = rapid.points.from { P = {{0, 1, 0}, {2, 1, 0}}, heat = {1, 7}, mass = {1, 1e-9} }
]]

  local function failing(chain)
    local folder = command.folder()
    folder:write("scene.lua", head .. "return rapid.create { points = set }\n" .. chain)
    return command.rapid("run scene.lua -f 1-6 -o a.####.csv --threads 1", { cwd = folder.path }), folder
  end

  local had = "it had P = {2, 1, 0}, v = {0, 0, 0}, heat = 7, mass = 1e-09"

  it("stops the run before the frame is written, and is named with all that the point had", function()
    for chain, parts in pairs {
      [':points("bad", function(p, f) if f.number == 4 and p.id == 1 then p.v = p.v / 0 end end) :solve {}'] =
        { 'node "bad": v became', "point id 1, frame 4; P = {2, 1, 0}, v = {0, 0, 0}, heat = 7, mass = 1e-09" },
      [':action("bad", function(p, s) if s.time > 0.11 and p.id == 1 then p.v = p.v / 0 end end) :solve {}'] =
        { 'node "bad": v became', "point id 1, frame 4; P = {2, 1, 0}, v = {0, 0, 0}, heat = 7, mass = 1e-09" },
      [':action("bad", function(p, s) if s.time > 0.11 and p.id == 1 then p.force = vec3(0, 3e38, 0) end end)' ..
        ':solve {}'] =
        { 'node "solve1": point 1, frame 4: P became {2, inf, 0}', had },
      [':attract { falloff = -20, strength = function(f) return f.number == 4 and 3e38 or 0 end } :solve {}'] =
        { 'node "solve1": point 1, frame 4: ', " became {-inf, -inf, 0}", had },
      [':gravity { g = function(f) return {0, f.number == 4 and 0 / 0 or 0, 0} end } :solve {}'] =
        { 'node "gravity1": g', "frame 4" },
      [':distance { within = 3 } ' ..
        ':attract { falloff = -60, strength = function(f) return f.number == 4 and 3e38 or 0 end } :solve {}'] =
        { 'node "solve1": point 1, frame 4: P became {-inf, -inf, 0} in a substep', had },
    } do
      local result, folder = failing(chain)
      assert.equal(1, result.status, chain)
      for _, part in ipairs(parts) do assert.truthy(result.stderr:find(part, 1, true), result.stderr) end
      assert.same({ "a.0001.csv", "a.0002.csv", "a.0003.csv", "scene.lua" }, folder:list())
    end
  end)
end)
