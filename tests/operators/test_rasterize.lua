-- :rasterize: points written as volumes within a run.
local command = require "testing.command"
local scene = require "testing.scene"

local function run(text, arguments)
  local result = scene.command("run", text, arguments)
  assert.equal(0, result.status, result.stderr)
  return result
end

-- Returns the numbers that a text computes from files and puts into `found`.
local function found(text, count)
  local columns = {}
  for k = 1, count do columns[k] = ("f%d = {found[%d]}"):format(k, k) end
  local point = scene.run(([[
local found = {} %s
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, %s } } :solve {}]])
    :format(text, table.concat(columns, ", ")), { frames = {1, 1} })[1][1]
  local numbers = {}
  for k = 1, count do numbers[k] = point["f" .. k] end
  return numbers
end

local drift = [[
return rapid.create { fps = 24, points = rapid.points.from {
    P = {{0.03, 0.1, -0.2}, {1.2, 0.1, 0.4}}, v = {{2, 0, 0}, {0, 0, -3}}, pscale = {0.25, 0.4}, load = {1, 3} } }
  :rasterize { file = "smoke.####.vdb", voxel = 0.1, radius = rapid.attr "pscale", weight = rapid.attr "load" %s }
  :solve {}]]

describe(":rasterize", function()
  it("writes the weights of points as a density, and the mean of their velocities, frame by frame", function()
    run(drift:format "", "-f 1-3")
    for frame = 1, 3 do
      -- At the node, before Solve: the points of a frame are those from the end of the previous one.
      local t = math.max(0, frame - 2) / 24
      local numbers = found(([[
local fog = rapid.fog.read("smoke.%04d.vdb", { grid = "density" })
local flow = rapid.grid.read("smoke.%04d.vdb", { grid = "v" })
local sum, px = 0, 0
for i = -8, 22 do for j = -8, 10 do for k = -12, 12 do
  local d = fog:sample(vec3(i, j, k) * 0.1)
  sum, px = sum + d, px + d * i * 0.1
end end end
local near, far = flow:sample(vec3(0, 0.1, -0.2)), flow:sample(vec3(1.2, 0.1, 0.4))
found = { sum * 0.001, px * 0.001, near.x, near.z, far.x, far.z }]]):format(frame, frame), 6)
      assert.near(4, numbers[1], 1e-5)
      -- The weighted positions of the voxels are those of the points within a fraction of a voxel.
      assert.near(0.03 + 2 * t + 3 * 1.2, numbers[2], 0.02)
      assert.near(2, numbers[3], 1e-6)
      assert.near(0, numbers[4], 1e-6)
      assert.near(0, numbers[5], 1e-6)
      assert.near(-3, numbers[6], 1e-6)
    end
  end)

  it("is a sequence that another scene reads", function()
    run(drift:format "", "-f 1-4")
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.1, -0.2}} } }
  :field { grid = rapid.grid.read("smoke.####.vdb", { grid = "v" }), mode = "velocity", drag = 1e6 } :solve {}]],
      { frames = {3, 3} })
    assert.near({2, 0, 0}, result[3][1].v, 1e-3)
  end)

  it("writes a group alone, other vectors, and no file where there are no points", function()
    run([[
return rapid.create { fps = 24 }
  :emit { source = two, impulse = { [3] = 4 }, attributes = { N = {0, 0, 2} } }
  :group { name = "left", where = function(p) return p.P.x < 0.5 end }
  :rasterize { file = "left.####.vdb", group = "left", voxel = 0.1, attributes = { "N" } } :solve {}]], "-f 1-4")
    local files = command.shell(("cd %s && ls left.*"):format(scene.folder.path)).stdout
    assert.equal("left.0003.vdb\nleft.0004.vdb\n", files)
    local numbers = found([[
local fog, N = rapid.fog.read "left.0004.vdb", rapid.grid.read "left.0004.vdb"
local sum = 0
for i = -5, 15 do for j = 5, 15 do for k = -5, 5 do sum = sum + fog:sample(vec3(i, j, k) * 0.1) end end end
found = { sum * 0.001, N:sample(vec3(0, 1, 0)).z }]], 2)
    assert.near(2, numbers[1], 1e-5)
    assert.near(2, numbers[2], 1e-6)
  end)

  it("changes neither the points nor what else is written, and is the same on any number of threads", function()
    run(drift:format "" .. ":write { file = 'a.####.csv' }", "-f 1-3")
    local with = scene.folder:read "a.0003.csv"
    local without = (drift:format ""):gsub(":rasterize %b{}", ":attribute { pscale = 0, load = 0 }")
    run(without .. ":write { file = 'b.####.csv' }", "-f 1-3")
    assert.equal(scene.folder:read "b.0003.csv", with)
    local hashes = {}
    for _, threads in ipairs { 1, 3 } do
      run(drift:format "", "-f 3 --threads " .. threads)
      hashes[#hashes + 1] = found([[
local fog = rapid.fog.read("smoke.0003.vdb", { grid = "density" })
local sum = 0
for i = 1, 4000 do sum = sum + i * fog:sample(vec3(i % 13, i % 7, i % 11) * 0.08) end
found = { sum }]], 1)[1]
    end
    assert.equal(hashes[1], hashes[2])
  end)

  it("is not written again where a run with --cache goes on, and refuses parts", function()
    run(drift:format "", "-f 1-3 --cache c")
    local function stamp() return command.shell(("stat -c %%y %s/smoke.0002.vdb"):format(scene.folder.path)).stdout end
    local before = stamp()
    run(drift:format "", "-f 1-4 --cache c")
    assert.equal(before, stamp())
    local result = scene.command("run", drift:format "", "-f 1-2 --part 1/2 -o p.####.{part}.csv")
    assert.equal(2, result.status)
    assert.matches("its volumes contain all points", result.stderr, 1, true)
  end)

  it("takes a voxel where a radius is below it", function()
    local coarse = drift:gsub("voxel = 0.1", "voxel = 0.3"):gsub('radius = rapid.attr "pscale"', "radius = %%s")
    local files = {}
    for _, radius in ipairs { "0.3", "0.001", 'rapid.attr "pscale"', "0.31" } do
      run(coarse:format(radius, ""), "-f 2")
      files[#files + 1] = scene.folder:read "smoke.0002.vdb"
    end
    local function density(k)
      scene.folder:write("read.vdb", files[k])
      return found('local f = rapid.fog.read "read.vdb" found[1] = f:sample(vec3(0, 0, -0.3)) ' ..
        "found[2] = f:sample(vec3(1.2, 0, 0.3))", 2)
    end
    local voxel, small, own, larger = density(1), density(2), density(3), density(4)
    -- A radius of 0.3 in single precision is a little above the voxel.
    for k = 1, 2 do assert.near(voxel[k], small[k], 1e-6 * voxel[k]) end
    assert.equal(small[1], own[1]) -- the point whose pscale is 0.25
    assert.truthy(math.abs(small[2] - own[2]) > 1e-3 * small[2]) -- the point whose pscale is 0.4
    assert.truthy(math.abs(small[1] - larger[1]) > 1e-3 * small[1])
  end)

  it("reports wrong arguments", function()
    local function says(expected, more)
      local text = drift:gsub("smoke.####.vdb", more.file or "smoke.####.vdb"):format(more.add or "")
      local result = scene.command("run", text, "-f 1-2")
      assert.is_true(result.status > 0)
      assert.matches(expected, result.stderr, 1, true)
    end
    says("volumes can only be written as .vdb", { file = "smoke.####.png" })
    says("several frames would go into one file", { file = "smoke.vdb" })
    says('attributes: "load" is float; it must be a vec3', { add = ", attributes = { 'load' }" })
    says('"density" is already the grid of the points', { add = ", attributes = { 'density' }" })
    says('scene.lua:3: node "rasterize2": point 0 has the radius 0 m; it must be finite and above 0', { add =
      "} :attribute { none = 0 } :rasterize { file = 'b.####.vdb', voxel = 0.3, radius = rapid.attr 'none'" })
    assert.matches("writes nothing", scene.command("check", [[
local a = rapid.create { points = two }
local b = a:rasterize { file = "x.####.vdb" } return a:solve {}]]).stderr, 1, true)
  end)
end)
