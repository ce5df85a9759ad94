-- Fogs and vector grids: made from points, written, read as sequences, used as sources, masks and forces.
local scene = require "testing.scene"

-- Runs a text whose only purpose is to write files.
local function write(text)
  local result = scene.command("run", text .. " return rapid.create { points = two } :solve {}", "-f 1")
  assert.equal(0, result.status, result.stderr)
end

-- A box of 4 m with the vector (frame, 0, 0); a file for every fourth frame.
write [[
for frame = 1, 9, 4 do
  rapid.grid.from { size = {4, 4, 4}, voxel = 1, at = function() return vec3(frame, 0, 0) end }
    :write(("v.%04d.vdb"):format(frame))
end]]

-- Fogs of density 3 and 1, separate from each other.
write [[
local function block(x, weight) return rapid.fog.from_points(
  rapid.points.grid { size = {1, 1, 1}, spacing = 0.1, center = {x, 0, 0} }, { voxel = 0.1, weight = weight }) end
block(-5, 0.003):write "fog.0001.vdb"
block(5, 0.001):write "fog.0005.vdb"]]

describe("a sequence of vector grids", function()
  local function after(frame, options, chain, substeps)
    return scene.run(([[
local grid = rapid.grid.read("v.####.vdb", { %s })
return rapid.create { fps = 24, points = rapid.points.from { P = {{-1.5, 0, 0}} } }
  %s :solve { substeps = %d }]]):format(options, chain, substeps or 1), { frames = {frame, frame} })[frame][1]
  end

  it("is a function of time: a force that grows evenly, also between frames without a file", function()
    -- a = 1 + 24 t, so v = t + 12 t², exact at any step, and x = t²/2 + 4 t³, of second order.
    local t = 8 / 24
    local last
    for _, substeps in ipairs { 1, 2, 4 } do
      local p = after(9, "", ":field { grid = grid }", substeps)
      assert.near({t + 12 * t * t, 0, 0}, p.v, 2e-6)
      local error = math.abs(p.P.x + 1.5 - t * t / 2 - 4 * t ^ 3)
      if last then assert.near(4, last / error, 0.1) end
      last = error
    end
  end)

  it("holds, repeats, is mirrored or is nothing outside of its files, and may begin later", function()
    local function velocity(options, frame)
      return after(frame, options, ":field { grid = grid, mode = 'velocity', drag = 1e6 }").v.x
    end
    -- The velocity is that at the middle of the step, half a frame earlier.
    assert.near(3.5, velocity("", 4), 1e-3)
    assert.near(9, velocity("", 14), 1e-3)
    assert.near(3.5, velocity("after = 'repeat'", 13), 1e-3)
    assert.near(5.5, velocity("after = 'mirror'", 13), 1e-3)
    assert.near(0, velocity("after = 'none'", 13), 1e-6)
    assert.near(1.5, velocity("offset = 3", 5), 1e-3)
    assert.near(1, velocity("offset = 3", 3), 1e-3)
    assert.near(0, velocity("offset = 3, before = 'none'", 3), 1e-6)
  end)

  it("is evaluated by nodes in Lua that take a grid, at the time of each substep", function()
    scene.folder:write("drift.lua", [[
local rapid = require "rapid"
return rapid.node { name = "drift", doc = "Reads a flow.", makes = { seen = {0, 0, 0} },
  params = { flow = { "grid", required = true, doc = "of velocities" } },
  action = function(p, _, params) p.seen = p.seen + params.flow:sample(p.P) end }]])
    -- Frame 3 covers 2 to 3, in four substeps, sampled at their middles.
    local p = after(3, "", ":points('r', function(p) p.seen = vec3(0, 0, 0) end) :drift { flow = grid }", 4)
    assert.near({2.125 + 2.375 + 2.625 + 2.875, 0, 0}, p.seen, 1e-5)
  end)

  it("is the same on any number of threads", function()
    local text = [[
local grid = rapid.grid.read "v.####.vdb"
return rapid.create { points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.1 } }
  :field { grid = grid, mode = "velocity", drag = 3 } :solve { substeps = 2 }]]
    local one = scene.run(text, { frames = {1, 5}, threads = 1 })
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one[5], scene.run(text, { frames = {1, 5}, threads = threads })[5])
    end
  end)
end)

describe("a sequence of fogs", function()
  it("emits by the density between two files", function()
    for frame = 2, 4 do
      local points = scene.run(([[
return rapid.create { seed = 5 }
  :emit { source = rapid.fog.read "fog.####.vdb", impulse = { [%d] = 20000 }, age = 0 } :solve {}]]):format(frame),
        { frames = {frame, frame} })[frame]
      local second, u = 0, (frame - 1) / 4
      for i = 1, #points do
        local x = points[i].P.x
        assert.is_true(math.abs(math.abs(x) - 5) < 0.75)
        if x > 0 then second = second + 1 end
      end
      local part = u * 1 / (u * 1 + (1 - u) * 3)
      assert.near(20000 * part, second, 5 * math.sqrt(20000 * part * (1 - part)))
    end
  end)
end)

describe("a fog of points", function()
  it("is a mask for kernels and predicates: its density is that of the points", function()
    -- A lattice point at each voxel, with the weight of a voxel: a density of 1 within, 0 beyond the radius.
    local result = scene.run([[
local fog = rapid.fog.from_points(rapid.points.grid { size = {2, 2, 2}, spacing = 0.1, center = {0.05, 0.05, 0.05} },
  { voxel = 0.1, radius = 0.25, weight = 0.001 })
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {0.31, -0.42, 0.5}, {3, 0, 0}} } }
  :attribute { d = 0 }
  :points("read", function(p) p.d = fog:sample(p.P) end)
  :group { name = "inside", where = function(p) return fog:sample(p.P) > 0.5 end } :solve {}]], { frames = {2, 2} })
    local points = result[2]
    assert.near(1, points[1].d, 1e-5)
    assert.near(1, points[2].d, 1e-5)
    assert.equal(0, points[3].d)
    assert.is_true(points[1]:within "inside" and points[2]:within "inside")
    assert.is_false(points[3]:within "inside")
  end)

  -- Uses many points, because a loop over three may end while its trace is recorded.
  it("is evaluated in compiled kernels and predicates", function()
    local result = scene.run([[
local lattice = rapid.points.grid { size = {2, 2, 2}, spacing = 0.1 }
local fog = rapid.fog.from_points(lattice, { voxel = 0.1 })
return rapid.create { points = lattice } :attribute { d = 0 }
  :points("read", function(p) p.d = fog:sample(p.P) end)
  :group { name = "inside", where = function(p) return fog:sample(p.P) > 0.5 end } :solve {}]],
      { frames = {2, 2}, watch_traces = true })
    assert.is_true(#result[2] > 4096) -- more than one chunk
    assert.same({}, result.trace_aborts)
  end)

  it("and its velocities are written to one file, and carry points as they went", function()
    write [[
local P, v = {}, {}
for i = -10, 10 do for j = -10, 10 do for k = -10, 10 do
  P[#P + 1] = {i / 10, j / 10, k / 10}
  v[#v + 1] = {j / 10, -i / 10, 1}
end end end
local points = rapid.points.from { P = P, v = v }
rapid.grid.write("both.vdb", {
  smoke = rapid.fog.from_points(points, { voxel = 0.1 }), vel = rapid.grid.from_points(points, { voxel = 0.1 }) })]]
    local p = scene.run([[
local grid, fog = rapid.grid.read "both.vdb", rapid.fog.read("both.vdb", { grid = "smoke" })
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.5, 0, -0.6}} } } :attribute { d = 0 }
  :field { grid = grid, mode = "velocity", drag = 1e4 }
  :points("read", function(p) p.d = fog:sample(p.P) end) :solve { substeps = 16 }]], { frames = {25, 25} })[25][1]
    -- A turn of 1 rad about z in one second, and 1 m along it. The mean over a lattice is the linear flow itself.
    assert.near({0.5 * math.cos(1), -0.5 * math.sin(1), 0.4}, p.P, 2e-3)
    assert.near(1000, p.d, 0.1) -- one point per litre
  end)
end)

describe("a wrong volume", function()
  local function fault(text) return scene.error(text) end

  it("is refused with a remedy", function()
    local tail = " return rapid.create { points = two } :solve {}"
    assert.truthy(fault("rapid.grid.read 'none.####.vdb'"):find("there is no file", 1, true))
    assert.truthy(fault("rapid.grid.read('v.####.vdb', { after = 'loop' })"):find("after = \"loop\"", 1, true))
    assert.truthy(fault("rapid.grid.from_points(two, { attribute = 'w' })")
      :find('attribute = "w": the points have no vec3 with this name', 1, true))
    assert.truthy(fault("rapid.grid.write('x.vdb', { v = two })" .. tail)
      :find("it must be a fog or a grid of vectors", 1, true))
    assert.truthy(fault("rapid.grid.write('x.vdb', {})"):find("there is no grid to write", 1, true))
    assert.truthy(fault("local f = rapid.fog.from_points(two) f.sample(vec3(0, 0, 0))")
      :find("with a colon, not a dot", 1, true))
    assert.truthy(fault("local g = rapid.grid.read 'v.####.vdb' g:sample(vec3(0, 0, 0))")
      :find('a vector grid sequence has no "sample"', 1, true))
  end)
end)
