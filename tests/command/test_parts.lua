-- rapid run --part, --sample, rapid merge, and how `rapid explain` reports them.
local command = require "testing.command"
local amount = require "tests.amount"
local csv_rows = require "tests.csv_rows"
local json = require "dkjson"
local lehmer = require "tests.lehmer"

local folder = command.folder()
local root = command.shell("pwd").stdout:gsub("%s+$", "")

local function rapid(arguments)
  return command.rapid(arguments, { cwd = folder.path })
end

local function done(arguments)
  local result = rapid(arguments)
  assert.equal("", result.stderr, arguments)
  assert.equal(0, result.status, arguments)
  return result
end

local function run_parts(scene, count, output, more)
  for k = 1, count do
    done(("run %s --part %d/%d -o '%s' --quiet --threads %d %s"):format(scene, k, count, output, 1 + k % 2, more or ""))
  end
end

folder:write("drops.lua", [[
local rapid = require "rapid"
local rate = rapid.param("rate", 3000, "a second")
local bad = rapid.param("bad", false, "whether it fails in frame 3")
local grid = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2, center = {0, 2, 0} }
return rapid.create { seed = 3, points = grid }
  :emit { source = rapid.shape.sphere {}, rate = rate, life = {0.2, 1}, speed = {1, 2}, spread = 40,
          attributes = { heat = {0, 1}, Cd = {1, 0.5, 0} } }
  :emit { source = rapid.mesh.box {}, from = "volume", rate = function(frame) return 400 * frame.number end,
          birth = "even", attributes = { heat = 2 }, group = "second" }
  :points("sway", function(p, frame)
      p.v = p.v + vec3(p:rand(1) - 0.5, p:rand(2, frame) - 0.5, 0) * p.heat
      if p:rand(3, frame) < 0.02 then p:kill() end
      if bad and frame.number == 3 then error "on purpose" end
    end)
  :gravity {} :drag { linear = 0.3 }
  :collide { shape = rapid.shape.plane { offset = -1 }, bounce = 0.4, friction = 0.2 }
  :solve { substeps = 2 }
]])

folder:write("pairs.lua", [[
local rapid = require "rapid"
return rapid.create {}
  :emit { source = rapid.shape.sphere {}, rate = 100, attributes = { pscale = 0.1 } }
  :contact {}
  :solve {}
]])

describe("rapid run --part", function()
  it("writes points whose union is the whole run, byte for byte, in all formats", function()
    for _, extension in ipairs { "vdb", "bgeo", "ply", "prt", "npz", "csv", "vtp", "usda" } do
      done(("run drops.lua -f 1-8 -o 'whole.####.%s' --quiet"):format(extension))
      run_parts("drops.lua", 3, "p." .. "####." .. extension, "-f 1-8")
      done(("merge -o 'merged.####.%s' 'p_part{part}.####.%s'"):format(extension, extension))
      for frame = 1, 8 do
        local name = (".%04d."):format(frame) .. extension
        assert.truthy(folder:read("whole" .. name) == folder:read("merged" .. name), name)
      end
    end
  end)

  it("names files by {part}, or before the frame's number", function()
    done("run drops.lua -f 1-2 --part 2/16 "
      .. "-o 'named/{part}/a.####.csv' -o 'named/b.####.csv' --stats named/s.json --quiet")
    assert.truthy(folder:read "named/02of16/a.0001.csv")
    assert.truthy(folder:read "named/b_part02of16.0002.csv")
    assert.truthy(folder:read "named/s_part02of16.json")
    local result = rapid "run drops.lua -f 1-2 -o 'a{part}.####.csv'"
    assert.equal(2, result.status)
    assert.matches("{part} is the name of a part; give %-%-part, or remove {part}", result.stderr)
  end)

  it("has statistics that add up to those of the whole", function()
    done "run drops.lua -f 1-12 --stats all.json --quiet"
    run_parts("drops.lua", 3, "st.####.csv", "-f 1-12 --stats all.json")
    local whole = json.decode((folder:read "all.json"))
    local parts = {}
    for k = 1, 3 do parts[k] = json.decode((folder:read(("all_part%dof3.json"):format(k)))) end
    local compared = 0
    for f, frame in ipairs(whole.frames) do
      for _, name in ipairs { "points", "born", "died", "collisions" } do
        local sum = 0
        for k = 1, 3 do sum = sum + parts[k].frames[f][name] end
        assert.equal(frame[name], sum, name .. " of frame " .. f)
        compared = compared + (frame[name] > 0 and 1 or 0)
      end
    end
    assert.is_true(compared > 30)
  end)

  it("writes the events of its points", function()
    done "run drops.lua -f 1-6 --events ev.csv --quiet"
    run_parts("drops.lua", 2, "ev.####.csv", "-f 1-6 --events ev.csv")
    local function lines(...)
      local all = {}
      for _, name in ipairs { ... } do
        for line in folder:read(name):gmatch "[^\n]+" do all[#all + 1] = line end
      end
      table.sort(all)
      return all
    end
    local whole, parts = lines "ev.csv", lines("ev_part1of2.csv", "ev_part2of2.csv")
    assert.is_true(#whole > 100)
    assert.equal(#whole + 1, #parts) -- one header each
  end)

  it("refuses an illegal part", function()
    for _, part in ipairs { "0/4", "5/4", "1", "a/b", "1/0", "1/4x" } do
      local result = rapid("run drops.lua --part " .. part)
      assert.equal(2, result.status)
      assert.matches('%-%-part = "' .. part .. '"; it must be K/N', result.stderr)
    end
    for _, sample in ipairs { "0", "1.5", "x" } do
      assert.equal(2, rapid("run drops.lua --sample " .. sample).status)
    end
  end)
end)

describe("parts with a cache", function()
  it("are the whole run when they were interrupted, and complete where all frames were there", function()
    done "run drops.lua -f 1-12 -o 'cw.####.csv' --quiet"
    for k = 1, 2 do -- one folder each
      done(("run drops.lua --part %d/2 -f 1-5 -o 'cc.####.csv' --cache caches/%d --cache-every 2 --quiet"):format(k, k))
      done(("run drops.lua --part %d/2 -f 1-12 -o 'cc.####.csv' --cache caches/%d --quiet"):format(k, k))
    end
    command.shell("rm cc_part1of2.csv.json", { cwd = folder.path })
    done "run drops.lua --part 1/2 -f 1-12 -o 'cc.####.csv' --cache caches/1 --quiet"
    done "merge -o 'cm.####.csv' 'cc_part{part}.####.csv'"
    for frame = 1, 12 do
      local name = (".%04d.csv"):format(frame)
      assert.truthy(folder:read("cw" .. name) == folder:read("cm" .. name), name)
    end
  end)

  it("refuse the cache of another part", function()
    done "run drops.lua --part 1/2 -f 1-3 -o 'co.####.csv' --cache other --quiet"
    for _, option in ipairs { "--part 2/2", "--part 1/3", "", "--sample 0.5" } do
      local result = rapid("run drops.lua -f 1-3 -o 'co.####.csv' --cache other --quiet " .. option)
      assert.equal(2, result.status, option)
      assert.matches("belongs to another run", result.stderr)
    end
  end)
end)

describe("rapid run --sample", function()
  it("has the points of the whole run with its ids, bit-identical", function()
    done "run drops.lua -f 1-12 -o 'w.####.csv' --quiet"
    done "run drops.lua -f 1-12 -o 's.####.csv' --sample 0.05 --quiet"
    local found = 0
    for frame = 1, 12 do
      local whole = {}
      for line in folder:read(("w.%04d.csv"):format(frame)):gmatch "[^\n]+" do whole[line] = true end
      local rows = 0
      for line in folder:read(("s.%04d.csv"):format(frame)):gmatch "[^\n]+" do
        assert.is_true(whole[line], line)
        rows = rows + 1
      end
      found = found + rows - 1
    end
    assert.is_true(found > 200)
  end)
end)

describe("a :detail that reads no points", function()
  it("works with parts: its result is the same in each", function()
    folder:write("gusts.lua", [[
local rapid = require "rapid"
local strength = 3
local function gust(time) return strength * math.sin(2 * time) end
return rapid.create { fps = 24, seed = 5 }
  :emit { source = rapid.shape.sphere {}, rate = 2000, life = {0.2, 1} }
  :detail("wind", function(points, frame)
    points.detail.gust = gust(frame.time)
    local before = points.detail.sum or 0
    points.detail.sum = before
    if frame.number > 3 then points.detail.sum = before + points.detail.gust end
  end)
  :points("blow", function(p, frame) p.v = p.v + vec3(frame.detail.gust, frame.detail.sum, 0) * p.dt end)
  :gravity {}
  :solve {}
]])
    assert.is_true(json.decode(done("explain gusts.lua --json").stdout).parts.possible)
    done "run gusts.lua -f 1-12 -o 'g.####.ply' --quiet"
    for k = 1, 3 do done("run gusts.lua -f 1-12 -o 'g.####.ply' --quiet --part " .. k .. "/3") end
    done "merge --quiet -o 'gm.####.ply' 'g_part{part}.####.ply'"
    for frame = 1, 12 do
      local name = (".%04d.ply"):format(frame)
      assert.truthy(folder:read("g" .. name) == folder:read("gm" .. name), name)
    end
  end)
end)

-- Couplings, by a scene's chain: run refuses each, and explain names it.
local emitter = ":emit { source = rapid.shape.sphere {}, rate = 50, attributes = { pscale = 0.1 } }"
local coupled = {
  ["contact1"] = { emitter .. ":contact {}", "solved for all points together" },
  ["pin1"] = { emitter .. ":pin {}", "solved for all points together" },
  ["interact1"] = { emitter .. ":interact { radius = 1 }", "neighbours" },
  ["clump1"] = { emitter .. ":clump {} :contact {}", "together" },
  ["index"] = { emitter .. ':points("index", function(p) p.v = vec3(p.index, 0, 0) end)', "p.index" },
  ["sums"] = { emitter .. ':detail("sums", function(points) points.detail.n = #points end)', "its function reads " ..
    "all points" },
  ["passes_on"] = { [[
    :emit { source = rapid.shape.sphere {}, rate = 50 }
    :detail("passes_on", function(points)
      local function count(all) return all and 1 or 0 end
      points.detail.n = count(points)
    end)]], "its function reads all points" },
  ["copies"] = { emitter .. [[:detail("copies", function(points)
      local all = points.detail
      if points.detail.n then all = points end
      points.detail.n = all and 1 or 0
    end)]], "its function reads all points" },
  ["adds"] = { emitter .. ':detail("adds", function(points) points:add { P = vec3(0, 0, 0) } end)',
    "its function reads all points" },
  ["returns"] = { emitter .. ':detail("returns", function(points) return points end)',
    "its function reads all points" },
  ["any"] = { emitter .. ':detail("any", function(...) local points = ... points.detail.n = 1 end)',
    "its function reads all points" },
  ["delete1"] = { emitter .. ":delete { where = function(p) return p.index > 9 end }", "p.index" },
  ["collide1"] = { [[:emit { source = rapid.shape.sphere {}, rate = 50, attributes = { pscale = {0.1, 0.2} } }
    :collide { shape = rapid.levelset.sphere { radius = 0.3, voxel = 0.1 } }]], "largest radius" },
  ["collide2"] = { emitter .. [[:collide { name = "collide2",
    shape = rapid.levelset.sphere { radius = 0.3, voxel = 0.1 }, method = "project" }]], "fastest of all points" },
  ["solve1"] = { emitter .. [[:emit { source = rapid.shape.sphere {}, rate = 9, attributes = { airresist = 1 } }
    :emit { source = rapid.shape.sphere {}, rate = 9, attributes = { airresist = 2 } }]], "airresist" },
}

describe("points that are coupled", function()
  for node, case in pairs(coupled) do
    local chain, why = case[1], case[2]
    it("are refused in parts: " .. node, function()
      folder:write("coupled.lua", 'local rapid = require "rapid"\nreturn rapid.create {}' .. chain .. ":solve {}\n")
      for _, option in ipairs { "--part 1/2", "--sample 0.5" } do
        local result = rapid("run coupled.lua -f 1-2 " .. option)
        assert.equal(2, result.status)
        assert.matches('coupled.lua:%d+: node "' .. node .. '": ', result.stderr)
        assert.matches(why, result.stderr, 1, true)
      end
      local explained = json.decode(done("explain coupled.lua --json").stdout).parts
      assert.is_false(explained.possible)
      local names = {}
      for _, because in ipairs(explained.because) do names[because.name] = because.what end
      assert.truthy(names[node] and names[node]:find(why, 1, true))
      assert.matches("parts: no, because", done("explain coupled.lua").stdout, 1, true)
    end)
  end

  it("are those born from points, and those of several simulations", function()
    folder:write("born.lua", [[
local rapid = require "rapid"
local a = rapid.create {} :emit { source = rapid.shape.sphere {}, rate = 50 } :solve {}
local b = rapid.create {} :spawn { from = a, rate = 50 } :solve {}
return b:merge(a)
]])
    local because = json.decode(done("explain born.lua --json").stdout).parts.because
    assert.equal(2, #because)
    assert.matches("numbers births over all points", because[1].what)
    assert.matches("several simulations", because[2].what)
  end)

  it("are not those of chains that a merge joins in the order of their ids", function()
    local function scene(a, b)
      folder:write("chains.lua", ([[
local rapid = require "rapid"
local all = rapid.create { seed = 2 }
local a = all:emit { name = "a", source = rapid.shape.sphere {}, rate = 500 }
local b = all:emit { name = "b", source = rapid.shape.box {}, rate = 300, attributes = { heat = {0, 1} } }
return %s:merge(%s) :gravity {} :solve {}
]]):format(a, b))
    end
    scene("b", "a")
    assert.matches("another order than that of their ids", rapid("run chains.lua --part 1/2").stderr, 1, true)
    scene("a", "b")
    done "run chains.lua -f 1-6 -o 'ch.####.ply' --quiet"
    run_parts("chains.lua", 3, "cp.####.ply", "-f 1-6")
    done "merge -o 'cm.####.ply' 'cp_part{part}.####.ply'"
    for frame = 1, 6 do
      assert.truthy(folder:read(("ch.%04d.ply"):format(frame)) == folder:read(("cm.%04d.ply"):format(frame)))
    end
  end)
end)

describe("every scene in graphs", function()
  local possible = 0
  for path in command.shell("ls graphs/*.lua").stdout:gmatch "%S+" do
    it(path .. " is its parts, or says what couples", function()
      local scene = root .. "/" .. path
      local parts = json.decode(done("explain " .. scene .. " --json").stdout).parts
      if not parts.possible then
        assert.is_true(#parts.because > 0)
        assert.equal(2, rapid("run " .. scene .. " -f 1-2 --part 1/2").status)
        return
      end
      possible = possible + 1
      command.shell("rm -f g.* gp_* gm.*", { cwd = folder.path })
      -- The scene may print warnings.
      assert.equal(0, rapid("run " .. scene .. " -f 1-11x5 -o 'g.####.bgeo' --quiet").status)
      for _, count in ipairs(amount.thorough and { 2, 3, 16 } or { 3 }) do
        for k = 1, count do
          local part = ("run %s --part %d/%d -f 1-11x5 -o 'gp.####.bgeo' --quiet --threads 2"):format(scene, k, count)
          assert.equal(0, rapid(part).status, part)
        end
        done(("merge -o 'gm.####.bgeo' 'gp_part{part}.####.bgeo'"))
        for frame = 1, 11, 5 do
          assert.truthy(folder:read(("g.%04d.bgeo"):format(frame)) == folder:read(("gm.%04d.bgeo"):format(frame)),
                        ("%s in %d parts, frame %d"):format(path, count, frame))
        end
        command.shell("rm gp_*", { cwd = folder.path })
      end
    end)
  end

  it("can be taken in parts, nine of them or more", function()
    assert.is_true(possible >= 9)
  end)
end)

-- PARTS_SCENES and PARTS_SEED select their number and the seed.
describe("random scenes without couplings", function()
  local pick = lehmer.new(tonumber(os.getenv "PARTS_SEED") or 11).pick

  local function births(k)
    local life = pick { "", "life = {0.1, 0.6}, ", "life = 0.3, " }
    local source = pick { 'rapid.shape.sphere {}, from = "volume"', "rapid.mesh.box {}", "rapid.shape.box {}",
                          "rapid.mesh.torus {}:transform(function(f) return rapid.translate(f.time, 0, 0) end)",
                          "rapid.points.grid { size = {1, 1, 1}, spacing = 0.3 }" }
    local births_of = pick { "rate = 2000", "rate = function(f) return 500 + 200 * f.number end", "count = 40",
                          "impulse = { [2] = 300, [5] = 70 }" }
    return (":emit { name = 'e%d', source = %s, %s, %sbirth = '%s', velocity = {1, 2, 0}, spread = %d, attributes = { "
      .. "heat = %s, airdrag = %s }%s }"):format(k, source, births_of, life, pick { "random", "even", "begin", "end" },
      pick { 0, 40, 180 }, pick { "1", "{0, 1}" }, pick { "0.5", "{0.2, 2}" }, pick { "", ", group = 'some'" })
  end
  local steps = {
    ":points('turn', function(p, f) p.v = p.v + vec3(p:rand(1) - 0.5, p:rand(2, f) - 0.5, p.heat) * p.dt end)",
    ":points('cool', function(p) p.heat = p.heat * (1 - p.dt); if p.heat < 0.1 then p:kill() end end)",
    ":points('join', function(p, f) if p:rand(3, f) < 0.1 then p:join 'loose' end end)"
      .. ":points { name = 'loose', group = 'loose', kernel = function(p) p.v = p.v * 0.9 end }",
    ":action('push', function(p, step) p.v = p.v + vec3(step.dt, 0, 0) * p.heat end)",
    ":delete { where = function(p) return p.P.y < -3 end }",
    ":group { name = 'low', where = function(p) return p.P.y < 0 end } :drag { linear = 1, group = 'low' }",
    ":attribute { pscale = 0.02 }", ":trail { places = 3 }", ":gravity {}", ":drag { linear = rapid.attr 'airdrag' }",
    ":turbulence { amplitude = 2 }", ":vortex { strength = 3 }", ":wind { velocity = {1, 0, 0} }",
    ":attract { shape = rapid.shape.sphere {}, strength = 2 }",
    ":collide { shape = rapid.shape.plane { offset = -1 }, bounce = 0.3, friction = 0.4 }",
    ":collide { shape = rapid.shape.sphere { center = {0.5, -0.5, 0} }, response = 'slide' }",
    ":collide { shape = rapid.levelset.box { voxel = 0.1 }, radius = 0, response = 'stick' }",
  }

  for k = 1, amount.of("PARTS_SCENES", 5) do
    it("are their parts, number " .. k, function()
      local chain = { "local rapid = require 'rapid'", ("return rapid.create { seed = %d, subframes = %d%s }"):format(k,
        pick { 1, 1, 2 }, pick { "", ", points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25 }" }) }
      for e = 1, pick { 1, 2 } do chain[#chain + 1] = births(e) end
      local taken = {}
      for _ = 1, 6 do
        local step = pick(steps)
        if not taken[step] then chain[#chain + 1] = step end
        taken[step] = true
      end
      chain[#chain + 1] = (":solve { substeps = %d%s }"):format(pick { 1, 3 }, pick { "", ", tolerance = 1e-3" })
      local text = table.concat(chain, "\n")
      folder:write("random.lua", text)
      local count = pick { 2, 3, 7 }
      local function run(arguments)
        local result = rapid("run random.lua -f 1-8x7 --quiet " .. arguments)
        assert.equal(0, result.status, text .. "\n" .. result.stderr)
      end
      run "-o 'r.####.ply'"
      for part = 1, count do run(("--part %d/%d -o 'r.####.ply'"):format(part, count)) end
      done "merge -o 'rm.####.ply' 'r_part{part}.####.ply'"
      for _, frame in ipairs { "0001", "0008" } do
        assert.truthy(folder:read("r." .. frame .. ".ply") == folder:read("rm." .. frame .. ".ply"), text)
      end
      command.shell("rm r*.ply r_*", { cwd = folder.path })
    end)
  end
end)

describe("rapid merge", function()
  local function parts(count, more)
    command.shell("rm -f m_* m.*", { cwd = folder.path })
    run_parts("drops.lua", count, "m.####.csv", "-f 1-4 " .. (more or ""))
  end
  local function refused(arguments, ...)
    local result = rapid("merge -o 'out.####.csv' " .. arguments)
    assert.equal(2, result.status)
    for _, text in ipairs { ... } do assert.matches(text, result.stderr, 1, true) end
  end

  it("lists parts and frames that are missing, and parts that are doubled", function()
    parts(4)
    command.shell("rm m_part2of4.*", { cwd = folder.path })
    command.shell("rm m_part3of4.0002.csv m_part3of4.0003.csv m_part4of4.0004.csv", { cwd = folder.path })
    command.shell("for f in m_part1of4.*; do cp $f copy_${f#m_}; done", { cwd = folder.path })
    refused("'m_part{part}.####.csv' 'copy_part{part}.####.csv'", "missing is part 2of4",
            "of m_part3of4.####.csv frames are missing: 2-3", "of m_part4of4.####.csv a frame is missing: 4",
            "part 1of4 appears twice: m_part1of4.####.csv and copy_part1of4.####.csv")
    refused("'m_part2of4.####.csv'", "m_part2of4.csv.json is missing")
    refused("'none_part{part}.####.csv'", "there is no complete part with this name")
  end)

  it("lists what differs between the runs of parts", function()
    parts(2)
    done "run drops.lua --part 2/2 -f 1-4 --set rate=2000 -o 'm.####.csv' --quiet"
    refused("'m_part{part}.####.csv'", "m_part2of2.####.csv belongs to another run than m_part1of2.####.csv",
            "rate is not given there and 2000 here")
    done "run drops.lua --part 2/2 -f 1-3 --seed 9 -o 'm.####.csv' --quiet"
    refused("'m_part{part}.####.csv'", "--seed is not given there and 9 here", "-f is 1-4x1 there and 1-3x1 here")
  end)

  it("knows a part whose graph has changed since", function()
    parts(2)
    local text = folder:read "drops.lua"
    folder:write("drops.lua", text .. "-- changed\n")
    done "run drops.lua --part 2/2 -f 1-4 -o 'm.####.csv' --quiet"
    folder:write("drops.lua", text)
    refused("'m_part{part}.####.csv'", "content of drops.lua is ")
  end)

  it("does not take a part that was begun again and not finished", function()
    parts(2)
    assert.equal(1, rapid("run drops.lua --part 2/2 -f 1-4 -o 'm.####.csv' --quiet --set bad=true").status)
    refused("'m_part{part}.####.csv'", "missing is part 2of2")
  end)

  it("refuses a file that its part has not written, with status 1, while it merges", function()
    parts(2)
    command.shell("cp m_part1of2.0003.csv m_part2of2.0003.csv", { cwd = folder.path })
    local result = rapid "merge -o 'out.####.csv' 'm_part{part}.####.csv'"
    assert.equal(1, result.status)
    assert.matches("m_part2of2.0003.csv: was changed after the part wrote it: it had %d+ points then and has %d+ " ..
      "now. Run the part again", result.stderr)
    assert.is_nil(folder:read "out.0003.csv")
    assert.truthy(folder:read "out.0002.csv")
  end)

  it("writes any format that holds points, and no other", function()
    parts(2)
    done "merge -o 'other.####.vdb' 'm_part{part}.####.csv'"
    done "run drops.lua -f 1-4 -o 'direct.####.csv' --quiet"
    done "diff 'other.####.vdb' 'direct.####.csv'"
    local result = rapid "merge -o 'other.####.png' 'm_part{part}.####.csv'"
    assert.equal(2, result.status)
    assert.matches("a .png file can't store points; merge into another format", result.stderr, 1, true)
  end)

  it("refuses to replace a part", function()
    parts(2)
    local result = rapid "merge -o 'm_part1of2.####.csv' 'm_part{part}.####.csv'"
    assert.equal(2, result.status)
    assert.matches("would replace the part m_part1of2.0001.csv", result.stderr, 1, true)
  end)

  it("has rows in the order of the ids", function()
    parts(3)
    done "merge -o 'rows.####.csv' 'm_part{part}.####.csv'"
    local rows = csv_rows(folder:read "rows.0004.csv")
    for i = 2, #rows do assert.is_true(tonumber(rows[i].id) > tonumber(rows[i - 1].id)) end
  end)
end)
