-- Curves as objects: at rest, moving, deforming, and read; births along them, and forces to them.
local scene = require "testing.scene"

local function birth_scene(source, more)
  return ([[
return rapid.create { fps = 24, seed = 5 } :points("r", function(p) local _ = p.birthtime end)
  :emit { source = %s, rate = 2400, %s } :solve {}]]):format(source, more or "inherit_velocity = 0")
end

local moving = [[rapid.curve.from { points = function(frame)
  local list = {}
  for k = 0, 20 do list[k + 1] = {k / 20, math.sin(3 * frame.time), k / 10} end
  return list end }]]

describe("births along a curve", function()
  it("are even by length, with the direction and the part of the length", function()
    local points = scene.run(birth_scene "rapid.curve.from { points = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}} }",
      { frames = {49, 49} })[49]
    assert.equal(4800, #points)
    local on_first = 0
    for i = 1, #points do
      local p = points[i]
      local first = p.P.x < 3
      if first then on_first = on_first + 1 end
      assert.near(first and 0 or p.P.y, p.P.y, 0)
      assert.near((p.P.x + p.P.y) / 4, p.u, 1e-6)
    end
    -- A binomial of 4,800 with 3/4: within four deviations of 30.
    assert.near(3600, on_first, 120)
  end)

  it("go round where it is closed, and one value u does not run back", function()
    local points = scene.run(birth_scene(
      "rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0, 0, 0}}, closed = true }"),
      { frames = {25, 25} })[25]
    for i = 1, #points do
      local P, u = points[i].P, points[i].u
      local along = P.z == 0 and P.x or P.x == 1 and 1 + P.z or P.z == 1 and 3 - P.x or 4 - P.z
      assert.near(along / 4, u, 1e-6)
    end
  end)

  it("are where a curve that is moved is at the time of birth, and have its velocity", function()
    local points = scene.run(birth_scene([[
rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}} }
  :transform(function(frame) return rapid.translate(0, 24 * frame.time, 0) end)]], "speed = 2"),
      { frames = {8, 8} })[8]
    assert.equal(700, #points)
    for i = 1, #points do
      -- Without forces it continues with 24 m/s up and 2 m/s along.
      local age = 7 / 24 - points[i].birthtime
      assert.near(24 * points[i].birthtime + 24 * age, points[i].P.y, 2e-5)
      assert.near({2, 24, 0}, points[i].v, 1e-5)
      assert.is_true(points[i].P.x - 2 * age > -1e-5 and points[i].P.x - 2 * age < 1 + 1e-5)
    end
  end)

  it("follow the spline of a function of the frame, as on a mesh of the same vertices", function()
    -- In frames with neighbours on both sides, the cubic has an error of (3/24)^4 / 384 of the sine, plus that of its
    -- tangents: about (3/24)^3 / 18.
    local points = scene.run(birth_scene(moving), { frames = {40, 40} })[40]
    local beads = {}
    for i = 1, #points do
      local p = points[i]
      assert.near(math.sin(3 * p.birthtime), p.P.y, p.birthtime < 1 / 24 and 2e-3 or 1.5e-4)
      assert.near(2 * p.P.x, p.P.z, 1e-6)
      beads[("%.5f"):format(p.P.y)] = true
    end
    local count = 0
    for _ in pairs(beads) do count = count + 1 end
    assert.is_true(count > 0.9 * #points)
  end)

  it("follow files that come one after the other, with before, after and offset", function()
    for file = 1, 8 do
      scene.folder:write(("wire.%04d.obj"):format(file), ("v 0 %d 0\nv 1 %d 0\nv 2 %d 0\nl 1 2 3\n"):format(file, file,
        file))
    end
    local source = [[rapid.curve.read("wire.####.obj", { offset = 2, before = "none", after = "none" })]]
    local result = scene.run(birth_scene(source), { frames = {1, 14} })
    assert.equal(0, #result[3])
    for frame = 4, 10 do assert.equal(100 * (frame - 3), #result[frame]) end
    assert.equal(700, #result[14])
    for i = 1, 700 do
      local p = result[14][i]
      assert.near(24 * p.birthtime + 1 - 2, p.P.y, 1e-4)
    end
  end)

  it("are the same on any number of threads", function()
    local text = birth_scene(moving)
    local one = scene.run(text, { frames = {1, 6}, threads = 1 })
    for _, threads in ipairs { 2, 5 } do
      assert.same_points(one[6], scene.run(text, { frames = {1, 6}, threads = threads })[6])
    end
  end)
end)

describe("a force to a curve that moves", function()
  local function after(chain, options)
    options = options or {}
    return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s} } } %s :solve { substeps = %d }]])
      :format(options.P, options.v or "{0, 0, 0}", chain, options.substeps or 1), { frames = {25, 25} })[25][1]
  end

  it("drives points along it at its own velocity", function()
    -- The line rises at 1.5 m/s, like the point: nothing acts across it, and along it a drag towards 2 m/s.
    local p = after([[:curve_force { speed = 2, pull = 25, drag = 6, curve = rapid.curve.from {
      points = {{-9, 0, 0}, {0, 0, 0}, {20, 0, 0}} }:transform(function(frame)
        return rapid.translate(0, 1.5 * frame.time, 0) end) }]],
      { P = "{0, 0, 0}", v = "{0, 1.5, 0}", substeps = 16 })
    -- Tolerance for the positions of the line in single precision: 1e-7 m per frame.
    assert.near(1.5, p.P.y, 5e-6)
    assert.near(2 * (1 - (1 - math.exp(-6)) / 6), p.P.x, 2e-5)
    assert.near({2 * (1 - math.exp(-6)), 1.5, 0}, p.v, 1e-4) -- of second order in the substep
  end)

  it("is that of a spring to where it is at the time of each sub-step", function()
    local force = [[:curve_force { pull = 30, drag = 0, curve = rapid.curve.from { points = function(frame)
      local y = math.sin(6 * frame.time)
      return {{-5, y, 0}, {5, y, 0}} end } }]]
    local w = math.sqrt(30)
    local exact = 30 / (30 - 36) * (math.sin(6) - 6 / w * math.sin(w))
    assert.near(exact, after(force, { P = "{0, 0, 0}", substeps = 32 }).P.y, 2e-3)
  end)

  it("keeps points on a ring that turns and moves away", function()
    -- At rest on the ring, which turns at 1 rad/s about y and moves along x at 3 m/s.
    local p = after([[:curve_force { speed = 0, pull = 4000, drag = 60, curve = rapid.curve.from {
      closed = true, points = function()
        local list = {}
        for k = 0, 119 do
          local a = 2 * math.pi * k / 120
          list[k + 1] = {math.cos(a), 0, math.sin(a)}
        end
        return list end }:transform(function(frame)
          return rapid.translate(3 * frame.time, 0, 0) * rapid.rotate({0, 1, 0}, -math.deg(frame.time)) end) }]],
      { P = "{1, 0, 0}", v = "{3, 0, 1}", substeps = 32 })
    assert.near({3 + math.cos(1), 0, math.sin(1)}, p.P, 3e-3)
    assert.near({3 - math.sin(1), 0, math.cos(1)}, p.v, 2e-2)
  end)

  it("reads each line of a file as a separate curve", function()
    -- Nothing attracts points between the end of the first curve and the beginning of the second.
    scene.folder:write("two.obj", "v 0 0 0\nv 1 0 0\nv 5 0 0\nv 6 0 0\nl 1 2\nl 3 4\n")
    local p = after(":curve_force { curve = rapid.curve.read 'two.obj', radius = 1 }", { P = "{3, 0.1, 0}" })
    assert.near({3, 0.1, 0}, p.P, 1e-7)
    p = after(":curve_force { curve = rapid.curve.read 'two.obj', radius = 1, speed = 0, pull = 4, drag = 4 }",
      { P = "{5.5, 0.1, 0}" })
    assert.is_true(p.P.y < 0.09)
  end)
end)

describe("a curve", function()
  it("reports wrong arguments", function()
    local function fault(text) return scene.error(text .. " return rapid.create {} :solve {}") end
    local function says(expected, text) assert.matches(expected, fault(text), 1, true) end
    says("it has 1 point; a curve needs at least two", "rapid.curve.from { points = {{0, 0, 0}} }")
    says("points 2 and 3 have the same position", "rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}} }")
    says("points = 3", "rapid.curve.from { points = 3 }")
    says("points is missing", "rapid.curve.from {}")
    says('unknown option "close"', "rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}}, close = true }")
    says("must be a list of vec3, or points", "rapid.curve.from { points = function() return 3 end }")
    says('there is no file "none.####.obj"', "rapid.curve.read 'none.####.obj'")
    assert.matches("closed needs a list of positions", scene.error [[
return rapid.create {} :curve_force { closed = true,
      curve = rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}} } } :solve {}]], 1, true)
    local function of_source(expected, source, more)
      assert.matches(expected, scene.error(birth_scene(source, more)), 1, true)
    end
    of_source('from = "volume" needs a mesh or a shape; remove it for a curve',
      "rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}} }", "from = 'volume'")
    of_source("a curve emits evenly by length", "rapid.curve.from { points = {{0, 0, 0}, {1, 0, 0}} }", "density = 'u'")
    of_source("give the function to rapid.curve.from",
      "function(frame) return rapid.curve.from { points = {{0, frame.time, 0}, {1, 0, 0}} } end")
    of_source("returned 3 points in frame 2 and 2 in the first", [[rapid.curve.from { points = function(frame)
      return frame.number == 2 and {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}} or {{0, 0, 0}, {1, 0, 0}} end }]])
    scene.folder:write("few.0001.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n")
    scene.folder:write("few.0002.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3\n")
    of_source("changes at frame 2: it has 3 points there and 2 at frame 1", "rapid.curve.read 'few.####.obj'")
  end)
end)
