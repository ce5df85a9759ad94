-- emit from points that are a function of the frame: births along their paths from frame to frame.
local scene = require "testing.scene"

local function run(source, emit, frames)
  return scene.run(([[
return rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime end)
  :emit { source = function(frame) return %s end, %s } :solve {}]]):format(source, emit),
    { frames = {1, frames or 13} })
end

describe("points that are a function of the frame", function()
  it("emit evenly along the parabola through their positions and velocities", function()
    local points = run([[rapid.points.from { P = {{3 * frame.time, 5 * frame.time ^ 2, 0}},
      v = {{3, 10 * frame.time, 0}} }]], 'rate = 480, birth = "even", inherit_velocity = 0')[13]
    assert.equal(240, #points)
    for i = 1, #points do
      local t = i / 480
      assert.near(t, points[i].birthtime, 1e-6)
      assert.near({3 * t, 5 * t * t, 0}, points[i].P, 1e-6)
    end
  end)

  it("emit along it without velocities too, from the third frame on", function()
    local points = run("rapid.points.from { P = {{3 * frame.time, 5 * frame.time ^ 2, 0}} }",
      'rate = 480, birth = "even", inherit_velocity = 0')[13]
    for i = 1, #points do
      local t = i / 480
      -- The first path is a chord, with a sagitta of a h²/8.
      assert.near({3 * t, 5 * t * t, 0}, points[i].P, i > 20 and 1e-6 or 10 / 24 ^ 2 / 8 + 1e-6)
    end
  end)

  it("give their velocity once", function()
    for _, v in ipairs { ", v = {{3, 10 * frame.time, 0}}", "" } do
      local points = run(("rapid.points.from { P = {{3 * frame.time, 5 * frame.time ^ 2, 0}} %s }"):format(v),
        'rate = 480, birth = "even"')[13]
      for i = 40, #points do assert.near({3, 10 * i / 480, 0}, points[i].v, 2e-4) end
    end
  end)

  it("have a velocity of their own where it is not that of their motion", function()
    local points = run("rapid.points.from { P = {{3 * frame.time, 0, 0}}, v = {{0, 7, 0}} }",
      'rate = 480, birth = "end"')[13]
    for i = 1, #points do assert.near({3, 7, 0}, points[i].v, 1e-5) end
  end)

  it("are followed by id through files, whatever their order, and missing ones are reported with numbers", function()
    scene.folder:write("a.0001.csv", "id,Px,Py,Pz\n7,0,0,0\n9,1,0,0\n")
    scene.folder:write("a.0002.csv", "id,Px,Py,Pz\n9,1,1,0\n7,0,1,0\n12,5,5,5\n")
    scene.folder:write("a.0003.csv", "id,Px,Py,Pz\n12,5,6,5\n9,1,2,0\n7,0,2,0\n")
    local result = run('rapid.points.read(("a.%04d.csv"):format(frame.number))', 'count = 300, inherit_velocity = 0', 3)
    for i = 1, #result[3] do
      local p = result[3][i]
      local x, y = math.floor(p.P.x + 0.5), p.birthtime * 24
      assert.near({x, x == 5 and math.max(5, 5 + y - 1) or y, x == 5 and 5 or 0}, p.P, 1e-5)
    end
    assert.equal(1, #result.warnings)
    assert.truthy(result.warnings[1]:find("1 of 3 points of the source are new in frame 2", 1, true))
  end)

  it("jump where cut says so", function()
    local points = run("rapid.points.from { P = {{frame.number >= 5 and 100 or 0, 0, 0}} }",
      "count = 50, cut = {5}")[13]
    for i = 1, #points do
      local x = points[i].P.x
      assert.truthy(x == 0 or x == 100)
    end
  end)
end)

describe("points with a transform", function()
  it("emit along the motion", function()
    local points = scene.run([[
local turning = rapid.points.from { P = {{1, 0, 0}} }
  :transform(function(frame) return rapid.rotate({0, 0, 1}, 360 * frame.time) end)
return rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime end)
  :emit { source = turning, rate = 480, birth = "even", inherit_velocity = 0 } :solve {}]], { frames = {1, 13} })[13]
    assert.equal(240, #points)
    for i = 40, #points do -- the first interval has a one-sided beginning
      local angle = 2 * math.pi * i / 480
      -- Error of the spline of a circle with 24 positions: (2π/24)⁴/384, plus that of its tangents.
      assert.near({math.cos(angle), math.sin(angle), 0}, points[i].P, 2e-3)
    end
  end)

  it("are moved at once by a motion that rests", function()
    local points = scene.run([[
local moved = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 2, 0}} }
  :transform(rapid.translate(0, 5, 0) * rapid.rotate({0, 0, 1}, 90))
return rapid.create { fps = 24, points = moved } :solve {}]], { frames = {1, 1} })[1]
    assert.near({0, 6, 0}, points[1].P, 1e-6)
    assert.near({-2, 0, 0}, points[1].v, 1e-6)
  end)
end)
