-- :field against closed forms: fields that are linear in position, which a grid represents exactly.
local scene = require "testing.scene"

local function after(frames, head, chain, P, substeps)
  return scene.run(([[%s
return rapid.create { fps = 24, points = rapid.points.from { P = {{%s}} } }
  :attribute { mass = 2 } %s :solve { substeps = %d }]]):format(head, P, chain, substeps or 1),
    { frames = {frames, frames} })[frames][1]
end

local still = "local grid = rapid.grid.from { size = {4, 4, 4}, voxel = 1, at = function() return vec3(3, 0, -1) end }"
local turning = [[local grid = rapid.grid.from { size = {4, 4, 4}, voxel = 0.5,
  at = function(P) return vec3(0, 1, 0):cross(P) end }]]
local drawing = "local grid = rapid.grid.from { size = {4, 4, 4}, voxel = 0.5, at = function(P) return -18 * P end }"

describe("field", function()
  it("of forces accelerates by the mass, exactly where it is the same everywhere", function()
    local p = after(13, still, ":field { grid = grid, strength = 2 }", "0, 0, 0")
    assert.near({3 * 2 / 2 * 0.5, 0, -0.5}, p.v, 1e-6)
    assert.near({3 * 2 / 2 * 0.125, 0, -0.125}, p.P, 1e-6)
  end)

  it("of velocities draws points to it, exactly where it is the same everywhere, however thick the air", function()
    for _, k in ipairs { 0.1, 1, 50, 1e6 } do
      local p = after(25, still, (":field { grid = grid, mode = 'velocity', strength = 0.5, drag = %g }"):format(k),
        "0, 0, 0")
      local gone = 1 - math.exp(-k)
      assert.near({1.5 * gone, 0, -0.5 * gone}, p.v, 2e-6)
      assert.near({1.5 * (1 - gone / k), 0, -0.5 * (1 - gone / k)}, p.P, 2e-6)
    end
  end)

  it("of a spring's forces swings at its frequency, of second order", function()
    local last
    for _, substeps in ipairs { 2, 4, 8 } do
      local error = math.abs(after(25, drawing, ":field { grid = grid }", "1, 0, 0", substeps).P.x - math.cos(3))
      if last then assert.near(4, last / error, 0.2) end
      last = error
    end
  end)

  it("of a turning flow keeps points on their circle, with a great drag", function()
    local p = after(25, turning, ":field { grid = grid, mode = 'velocity', drag = 1e4 }", "1, 0, 0", 16)
    assert.near({math.cos(1), 0, -math.sin(1)}, p.P, 2e-3)
  end)

  it("acts on a group alone, and is nothing beyond its grid", function()
    local points = scene.run(still .. [[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {9, 0, 0}} } }
  :group { name = "moved", where = function(p) return p.id ~= 0 end }
  :field { grid = grid, group = "moved" } :solve {}]], { frames = {2, 2} })[2]
    assert.near({0, 0, 0}, points[1].v, 0)
    assert.near({3 / 24, 0, -1 / 24}, points[2].v, 1e-6)
    assert.near({0, 0, 0}, points[3].v, 0)
  end)

  it("is evaluated by compiled kernels, bit-identical on any number of threads", function()
    local text = turning .. [[
return rapid.create { points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.1 } }
  :points("k", function(p) p.v = grid:sample(p.P) end) :field { grid = grid, mode = "velocity" } :solve {}]]
    local one = scene.run(text, { frames = {1, 5}, threads = 1, watch_traces = true })
    assert.same({}, one.trace_aborts)
    local start = scene.run(text, { frames = {1, 2} })
    assert.near({start[1]:by_id(7).P.z, 0, -start[1]:by_id(7).P.x}, start[2]:by_id(7).v, 0.02)
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one[5], scene.run(text, { frames = {1, 5}, threads = threads })[5])
    end
  end)

  it("reports wrong arguments", function()
    local function fault(text) return scene.error(text) end
    local tail = " :solve {}"
    assert.truthy(fault(still .. " return rapid.create {} :field { grid = grid, drag = 3 }" .. tail)
      :find('drag needs mode = "velocity"', 1, true))
    assert.truthy(fault("return rapid.create {} :field {}" .. tail):find("grid", 1, true))
    assert.truthy(fault("rapid.grid.from { voxel = -1, at = math.sin }")
      :find("rapid.grid.from: voxel = -1; it must be above 0 m", 1, true))
    assert.truthy(fault("rapid.grid.from { vocel = 1 }"):find('did you mean "voxel"?', 1, true))
    assert.truthy(fault("rapid.grid.from { at = function() end }")
      :find("at returns nil; it must return a vec3 everywhere", 1, true))
    assert.truthy(fault("rapid.grid.read 'none.vdb'"):find("there is no file", 1, true))
  end)
end)
