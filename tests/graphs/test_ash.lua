-- graphs/ash.lua: the claims in its header.
describe("graphs/ash.lua", function()
  local scene = require "testing.scene"
  local command = require "testing.command"
  local folder = command.shell("pwd").stdout:gsub("%s", "") .. "/graphs/smoke"

  -- Runs a chain of frames 49 to 113, with the sequence and two of its files.
  local function run(chain, frame)
    return scene.run(([[
local folder = %q
local function file(maker, number, grid)
  return maker(("%%s/smoke.%%04d.vdb"):format(folder, number), { grid = grid })
end
local fog = rapid.fog.read(folder .. "/smoke.####.vdb", { grid = "density" })
local flow = rapid.grid.read(folder .. "/smoke.####.vdb", { grid = "v" })
local before, after = file(rapid.fog.read, 49, "density"), file(rapid.fog.read, 65, "density")
local v_before, v_after = file(rapid.grid.read, 49, "v"), file(rapid.grid.read, 65, "v")
return rapid.create { fps = 24, seed = 3, start = 49 } %s]]):format(folder, chain), { frames = {frame, frame} })[frame]
  end

  it("emits flakes from the current smoke of either file", function()
    -- In frame 53, a quarter of the way, the density is 3/4 of the first file's plus 1/4 of the second's. The flakes
    -- are divided in proportion to the totals, and parts without common smoke share no flakes.
    local function drawn(source, number)
      return run(([[
  :emit { source = %s, impulse = { [53] = %d }, age = 0, attributes = { a = 0, b = 0 } }
  :points("read", function(p) p.a, p.b = before:sample(p.P), after:sample(p.P) end) :solve {}]]):format(source, number),
        53)
    end
    local function part(points, of_first)
      local sum = 0
      for i = 1, #points do
        local p = points[i]
        local first, second = 0.75 * p.a, 0.25 * p.b
        assert.is_true(first + second > 0)
        sum = sum + (of_first and first or second) / (first + second)
      end
      return sum / #points
    end
    local between = drawn("fog", 40000)
    assert.equal(40000, #between)
    -- Both files have equally many points, all of weight 1, within a tenth; 3/4 of the mixture belong to the first
    -- file.
    assert.near(0.75, part(between, true), 0.03)
    assert.near(0.25, part(between, false), 0.03)
  end)

  it("goes as the smoke goes, at each moment between two files", function()
    -- With such a drag a flake has the velocity of the flow, which in frame 55 is three eighths of the way from file to
    -- file. It lags by half a substep, 1.3 ms, in which it moves about 3 mm and the flow changes by about 0.01 m/s.
    local points = run([[
  :emit { source = fog, impulse = { [54] = 2000 }, age = 0 }
  :attribute { a = {0, 0, 0}, b = {0, 0, 0} }
  :field { grid = flow, mode = "velocity", drag = 2e4 }
  :solve { substeps = 16 }
  :points("read", function(p) p.a, p.b = v_before:sample(p.P), v_after:sample(p.P) end)]], 55)
    local off, apart = 0, 0
    for i = 1, #points do
      local p = points[i]
      off = off + (p.a:lerp(p.b, 0.375) - p.v):length() / #points
      apart = apart + (p.b - p.a):length() / #points
    end
    assert.is_true(apart > 0.3, apart)
    assert.is_true(off < 0.02, off)
  end)

  it("has the volumes that graphs/smoke/smoke.lua writes", function()
    local made = scene.folder.path .. "/smoke.####.vdb"
    local result = command.rapid(("run graphs/smoke/smoke.lua -f 49 --quiet --set to=%s"):format(command.quoted(made)))
    assert.equal(0, result.status, result.stderr)
    local points = scene.run(([[
local made = rapid.fog.read("smoke.0049.vdb", { grid = "density" })
local there = rapid.fog.read(%q, { grid = "density" })
local v_made, v_there = rapid.grid.read("smoke.0049.vdb", { grid = "v" }), rapid.grid.read(%q, { grid = "v" })
return rapid.create { points = rapid.points.grid { size = {4, 5, 4}, spacing = 0.2, center = {0, 2.4, 0} } }
  :attribute { a = 0, b = 0, v_a = {0, 0, 0}, v_b = {0, 0, 0} }
  :points("read", function(p)
      p.a, p.b, p.v_a, p.v_b = made:sample(p.P), there:sample(p.P), v_made:sample(p.P), v_there:sample(p.P)
    end) :solve {}]]):format(folder .. "/smoke.0049.vdb", folder .. "/smoke.0049.vdb"), { frames = {2, 2} })[2]
    local most = 0
    for i = 1, #points do
      local p = points[i]
      assert.equal(p.b, p.a)
      assert.equal(p.v_b, p.v_a)
      most = math.max(most, p.a)
    end
    assert.is_true(most > 10, most)
  end)

  it("is carried up by it, though flakes fall", function()
    local points = rapid.run("graphs/ash.lua", { frames = {1, 40}, set = { rate = 1000 } })[40]
    assert.is_true(#points > 1000 and points:mean("v").y > 0.5)
  end)
end)
