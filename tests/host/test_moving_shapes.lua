-- Moving and deforming shapes, and meshes, in kernels: kernels see them at the time of the step.
local scene = require "testing.scene"

local function write_squares(name, frames, y)
  for frame = 1, frames do
    local h = y(frame)
    scene.folder:write(("%s.%04d.obj"):format(name, frame),
      ("v -9 %.9g -9\nv 9 %.9g -9\nv 9 %.9g 9\nv -9 %.9g 9\nf 4 3 2 1\n"):format(h, h, h, h))
  end
end

describe("a kernel asks a shape that moves", function()
  it("for its distance, gradient and velocity at the end of the frame", function()
    local result = scene.run([[
local ball = rapid.shape.sphere { radius = 0.5 }:transform(function(frame)
  return rapid.translate(3 * frame.time, 2, 0)
end)
return rapid.create { fps = 24, points = two } :attribute { far = 0, way = {0, 0, 0}, u = {0, 0, 0} }
  :points("ask", function(p)
    p.far, p.way, p.u = ball:distance(p.P), ball:gradient(p.P), ball:velocity(p.P)
  end) :solve {}]], { frames = {2, 12} })
    for frame, points in result:frames() do
      local x = 3 * (frame - 1) / 24
      for i = 1, 2 do
        local p = points[i]
        local dx, dy = p.P.x - x, p.P.y - 2
        local d = math.sqrt(dx * dx + dy * dy)
        assert.near(d - 0.5, p.far, 1e-5)
        assert.near({dx / d, dy / d, 0}, p.way, 1e-5)
        assert.near({3, 0, 0}, p.u, 1e-3)
      end
    end
  end)

  it("in an action, at the time of each sub-step", function()
    -- A heated point stores the position of the plane at its time: y = 2 t² on average over the substeps.
    local points = scene.run([[
local lid = rapid.shape.plane { normal = {0, 1, 0} }:transform(function(frame)
  return rapid.translate(0, 2 * frame.time * frame.time, 0)
end)
return rapid.create { fps = 24, points = two } :attribute { sum = 0, n = 0 }
  :action("ask", function(p) p.sum = p.sum + p.P.y - lid:distance(p.P); p.n = p.n + 1 end)
  :solve { substeps = 8 }]], { frames = {13, 13} })[13]
    -- The midpoints of 96 substeps over 0.5 s: 2/3 T² minus 2/12 of a substep squared.
    assert.equal(96, points[1].n)
    local T, h = 0.5, 1 / 24 / 8
    assert.near(2 * (T * T / 3 - h * h / 12), points[1].sum / 96, 1e-4)
  end)

  it("that deforms, and a mesh at rest, at any distance", function()
    write_squares("lift", 12, function(frame) return 0.25 * frame end)
    local result = scene.run([[
local lift = rapid.mesh.read "lift.####.obj"
local floor = rapid.mesh.grid { size = {20, 20} }
return rapid.create { fps = 24, points = two } :attribute { far = 0, below = 0, u = {0, 0, 0} }
  :points("ask", function(p)
    p.far, p.below, p.u = lift:distance(p.P), floor:distance(p.P), lift:velocity(p.P)
  end) :solve {}]], { frames = {3, 10} })
    for frame, points in result:frames() do
      for i = 1, 2 do
        assert.near(math.abs(1 - 0.25 * frame), points[i].far, 1e-5)
        assert.near(1, points[i].below, 1e-5)
        assert.near({0, 6, 0}, points[i].u, 1e-4)
      end
    end
  end)

  it("in a test of a group, and group_by_shape takes one", function()
    local result = scene.run([[
local lid = rapid.shape.plane { normal = {0, 1, 0} }:transform(function(frame)
  return rapid.translate(0, 24 * frame.time * 0.2, 0)
end)
return rapid.create { fps = 24, points = two }
  :group { name = "under", where = function(p) return lid:distance(p.P) < 0 end }
  :group_by_shape { into = "same", shape = lid } :solve {}]], { frames = {2, 12} })
    for frame, points in result:frames() do
      local height = 0.2 * (frame - 1)
      if math.abs(height - 1) > 1e-4 then
        assert.equal(height > 1, points[1]:within "under")
        assert.equal(height > 1, points[1]:within "same")
      end
    end
  end)

  it("through a table and a function of its own, in nodes of Lua, with the same bits on any threads", function()
    scene.folder:write("feel.lua", [[
local rapid = require "rapid"
local parts = { ball = rapid.shape.sphere { radius = 1 }:transform {
  [1] = rapid.translate(0, 0, 0), [20] = rapid.translate(2, 0, 0) } }
local function near(P) return parts.ball:distance(P) end
return rapid.node { name = "feel", doc = "Writes the distance.", makes = { far = 0 },
  points = function(p) p.far = near(p.P) end }]])
    local function points(threads)
      return scene.run([[
return rapid.create { fps = 24, points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.1 } } :feel {} :solve {}]],
        { frames = {11, 11}, threads = threads })[11]
    end
    local one = points(1)
    -- The motion starts and ends at rest, so the middle of the path is at frame 10.5.
    local p = one[1]
    assert.is_true(#one > 20000)
    local x = (p.P - p.P * 0).x
    assert.is_true(x < -1 and p.far > 1)
    for _, threads in ipairs { 2, 7 } do assert.same_points(one, points(threads)) end
  end)

  it("is an error if it can't be evaluated", function()
    assert.matches("shape:distance(P) of a moving shape or a mesh can only be called in a kernel", scene.error [[
local ball = rapid.shape.sphere {}:transform { [1] = rapid.translate(0, 0, 0), [2] = rapid.translate(1, 0, 0) }
local _ = ball:distance(vec3(0, 0, 0)) return rapid.create {} :solve {}]], 1, true)
  end)
end)
