-- Failures of a run: its message, its files and its exit status.
local command = require "testing.command"
local json = require "dkjson"

local function new_folder(text)
  local folder = command.folder()
  folder:write("scene.lua", text)
  function folder:run(arguments)
    return command.rapid("run scene.lua " .. arguments, { cwd = self.path })
  end
  return folder
end

local points = [[
local rapid = require "rapid"
local points = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} }
]]

describe("what is wrong before the first frame", function()
  it("ends a run with 2, says file, line, node and remedy, and writes nothing", function()
    for _, case in ipairs {
      { "return rapid.create {} :gravty {}", 'scene.lua:3: unknown node "gravty"; did you mean "gravity"?' },
      { "return rapid.create {} :gravity { G = 1 } :solve {}",
        'scene.lua:3: node "gravity1": unknown parameter "G"; did you mean "g"?' },
      { "return rapid.create {} :solve { substeps = 0 }", 'scene.lua:3: node "solve1": substeps = 0 is out of range' },
      { "return rapid.create {} :gravity { g = 'down' } :solve {}", 'scene.lua:3: node "gravity1": g' },
      { "local mesh = rapid.mesh.read 'no.obj'", "scene.lua:3: " },
      { "rapid.create {}", "scene.lua: " },
      { "return rapid.create {", "scene.lua:3: " },
      { "error 'nothing to see'", "scene.lua:3: nothing to see" },
      { "return rapid.create {} :points('x', function(p) p.v = p.heat * p.v end) :solve {}",
        'scene.lua:3: node "x": no attribute "heat"' },
    } do
      local folder = new_folder(points .. case[1])
      for _, name in ipairs { "run", "check" } do
        local result = command.rapid(name .. " scene.lua", { cwd = folder.path })
        assert.equal(2, result.status, case[1])
        assert.equal(case[2], result.stderr:sub(1, #case[2]))
        assert.falsy(result.stderr:find("traceback", 1, true))
        assert.equal("", result.stdout)
      end
      local result = folder:run "-f 1-4 -o a.####.csv"
      assert.equal(2, result.status)
      assert.same({ "scene.lua" }, folder:list())
    end
  end)

  it("misses a graph that is not there", function()
    local result = command.rapid "run no_such_graph.lua"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("no_such_graph.lua: No such file", 1, true), result.stderr)
  end)
end)

describe("a script error in a frame", function()
  local failing = points .. [[
local function deeper(p) return p.P + nil end
return rapid.create { points = points }
  :points("fails", function(p, frame)
    if frame.number == 3 then p.v = deeper(p) end
  end) :solve {}
]]

  it("ends the run with 1 and names file, line, node, point and frame", function()
    local result = new_folder(failing):run "-f 1-6"
    assert.equal(1, result.status)
    assert.truthy(result.stderr:find('^scene.lua:3: node "fails": '), result.stderr)
    assert.truthy(result.stderr:find("(point id 0, frame 3)", 1, true), result.stderr)
    assert.falsy(result.stderr:find("traceback", 1, true))
  end)

  it("leaves the frames before it, complete", function()
    local folder = new_folder(failing)
    assert.equal(1, folder:run("-f 1-6 -o a.####.csv").status)
    assert.same({ "a.0001.csv", "a.0002.csv", "scene.lua" }, folder:list())
  end)

  it("leaves the statistics of the frames before it", function()
    local folder = new_folder(failing)
    assert.equal(1, folder:run("-f 1-6 --stats stats.json").status)
    local stats = json.decode(folder:read "stats.json")
    assert.equal(2, #stats.frames)
  end)

  it("shows the script's call stack with --verbose alone", function()
    local folder = new_folder(failing)
    assert.truthy(folder:run("-f 1-6 --verbose").stderr:find("traceback", 1, true))
  end)
end)

describe("a kernel that writes NaN", function()
  it("is found before the frame is written, and named with its point", function()
    local folder = new_folder(points .. [[
return rapid.create { points = points }
  :points("zero", function(p, frame) if frame.number == 3 and p.id == 1 then p.v = p.v / 0 end end) :solve {}
]])
    local result = folder:run "-f 1-4 -o a.####.csv"
    assert.equal(1, result.status)
    assert.truthy(result.stderr:find('^scene.lua:4: node "zero": v became vec3%(nan'), result.stderr)
    assert.truthy(result.stderr:find("(point id 1, frame 3; P = {1, 1, 0}, v = {0, 0, 0})", 1, true), result.stderr)
    assert.same({ "a.0001.csv", "a.0002.csv", "scene.lua" }, folder:list())
  end)
end)

describe("a script that does not end", function()
  it("is ended with 1 after --script-timeout, and named", function()
    for where, text in pairs {
      ['node "spins"'] = [[
return rapid.create { points = points } :points("spins", function(p) while true do end end) :solve {}]],
      ["scene.lua"] = "while true do end",
    } do
      local folder = new_folder(points .. text)
      local result = folder:run "-f 1-4 -o a.####.csv --script-timeout 0.3 --stats stats.json"
      assert.equal(1, result.status, text)
      assert.truthy(result.stderr:find(where, 1, true), result.stderr)
      assert.truthy(result.stderr:find("--script-timeout", 1, true), result.stderr)
      for _, name in ipairs(folder:list()) do assert.falsy(name:find("^%.") or name:find("/%."), name) end
    end
  end)

  it("is refused more memory than --script-memory", function()
    local result = new_folder(points .. "local t = {} for i = 1, 1e9 do t[i] = i end return rapid.create {}")
      :run "-f 1-4 --script-memory 32M"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("memory", 1, true), result.stderr)
    -- Less memory than a state takes before it runs a script.
    for most, bytes in pairs { ["1"] = 1, ["300K"] = 307200 } do
      result = new_folder(points .. "return rapid.create {} :solve {}"):run("-f 1-2 --script-memory " .. most)
      assert.equal(2, result.status)
      assert.equal(("the script needs more than %d bytes of Lua memory; --script-memory sets the limit\n")
        :format(bytes), result.stderr)
    end
  end)
end)

-- The process is stopped during a script, for longer than a script may take.
describe("a run that is stopped (SIGSTOP)", function()
  it("goes on, and its scripts have all their time", function()
    local folder = new_folder([[
local rapid = require "rapid"
local function spin(points, frame)
  local sum = 0
  for i = 1, frame.number == 2 and 3e8 or 0 do sum = sum + i end
end
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :detail("spin", spin) :solve {}]])
    local result = command.shell([[
"$RAPID" run scene.lua -f 1-2 -o a.####.csv --script-timeout 6 --quiet &
run=$!
for i in $(seq 1000); do [ -e a.0001.csv ] && break; sleep 0.01; done
kill -STOP $run
sleep 7
grep '^State' /proc/$run/status
kill -CONT $run
wait $run
]], { cwd = folder.path })
    assert.match("stopped", result.stdout)
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
    assert.truthy(folder:read "a.0002.csv")
  end)
end)

describe("a frame that can't be written", function()
  local growing = [[
local rapid = require "rapid"
return rapid.create {}
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, from = "points", count = 100 } :solve {}
]]

  it("ends the run with 1, names the file and the reason, and leaves the frames before it", function()
    local folder = new_folder(growing)
    -- Files of at most 32 KiB: each frame has 100 points more than the previous one.
    local result = command.shell('ulimit -f 64; "$RAPID" run scene.lua -f 1-40 -o a.####.csv --stats stats.json',
      { cwd = folder.path })
    assert.equal(1, result.status, result.stderr)
    local failed = result.stderr:match "^a%.(%d+)%.csv: can't be written: File too large"
    assert.truthy(failed, result.stderr)
    local names = { "scene.lua", "stats.json" }
    for frame = tonumber(failed) - 1, 1, -1 do
      local name = ("a.%04d.csv"):format(frame)
      table.insert(names, 1, name)
      local _, lines = folder:read(name):gsub("\n", "")
      assert.equal(1 + 100 * (frame - 1), lines)
    end
    assert.same(names, folder:list())
  end)

  it("says that a folder can't be made, or written to", function()
    local folder = new_folder(growing)
    local in_file = folder:run "-f 1-4 -o scene.lua/a.####.csv"
    assert.equal(1, in_file.status)
    assert.truthy(in_file.stderr:find("^scene.lua/a.0001.csv: "), in_file.stderr)
    -- Not even root can write here.
    local forbidden = folder:run "-f 1-4 -o /sys/rapid/a.####.csv"
    assert.equal(1, forbidden.status)
    assert.truthy(forbidden.stderr:find("^/sys/rapid/a.0001.csv: .*not permitted") or
      forbidden.stderr:find("^/sys/rapid/a.0001.csv: .*ermission denied") or
      forbidden.stderr:find("^/sys/rapid/a.0001.csv: .*ead%-only"), forbidden.stderr)
  end)

  it("is said of the statistics too", function()
    local result = new_folder(growing):run "-f 1-2 --stats scene.lua/stats.json"
    assert.equal(1, result.status)
    assert.truthy(result.stderr:find("^scene.lua/stats.json: "), result.stderr)
  end)
end)

describe("an interrupted run", function()
  local long = [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.05 } } :gravity {} :solve {}
]]

  -- The signal arrives when frame 3 exists and the rest of a million frames does not.
  local function interrupt(folder, signal)
    return command.shell(([[
env --default-signal=INT,QUIT,HUP "$RAPID" run scene.lua -f 1-1000000 -o out/a.####.csv --stats stats.json &
run=$!
for i in $(seq 1000); do [ -e out/a.0003.csv ] && break; sleep 0.01; done
kill -%s $run
wait $run
]]):format(signal), { cwd = folder.path })
  end

  it("exits with 128 and the signal, and leaves whole frames alone", function()
    for signal, status in pairs { HUP = 129, INT = 130, QUIT = 131, TERM = 143 } do
      local folder = new_folder(long)
      local result = interrupt(folder, signal)
      assert.equal(status, result.status, result.stderr)
      assert.equal("interrupted\n", result.stderr)
      local frames = 0
      for _, name in ipairs(folder:list()) do
        if name:find "^out/" then
          assert.truthy(name:find "^out/a%.%d+%.csv$", name)
          frames = frames + 1
          local _, lines = folder:read(name):gsub("\n", "")
          assert.equal(8001, lines, name)
        end
      end
      assert.truthy(frames >= 3)
      assert.truthy(#json.decode(folder:read "stats.json").frames >= 3)
    end
  end)
end)

describe("Ctrl-C", function()
  -- Returns the milliseconds from the signal to the end of a command that has just begun its endless work, and its
  -- status.
  local function end_of(text, arguments)
    local folder = new_folder(text)
    local result = command.shell(([[
env --default-signal=INT "$RAPID" %s >log 2>&1 &
run=$!
for i in $(seq 100); do [ -s log ] && break; sleep 0.01; done
sleep 0.5
begun=$(date +%%s%%N)
kill -INT $run
wait $run
status=$?
echo $status $((($(date +%%s%%N) - begun) / 1000000))
]]):format(arguments), { cwd = folder.path })
    local status, milliseconds = result.stdout:match "^(%d+) (%d+)\n$"
    return tonumber(status), tonumber(milliseconds)
  end

  -- 30 ms on an idle machine; the bound allows for a busy one.
  it("ends a scene that is still being read: a chain without end, a level set", function()
    for text, arguments in pairs {
      ["local n = rapid.create {} for i = 1, 1e6 do n = n:points('k' .. i, function(p) p.v = p.v end) end return n"] =
        "run scene.lua",
      ["return rapid.create {} :collide { shape = rapid.levelset.from_mesh(rapid.mesh.sphere { divisions = 1000 }, " ..
        "{ voxel = 0.001 }) } :solve {}"] = "check scene.lua --memory 100G",
    } do
      local status, milliseconds = end_of('local rapid = require "rapid" ' .. text, arguments)
      assert.equal(130, status, text)
      assert.truthy(milliseconds < 1000, text .. ": " .. milliseconds .. " ms")
    end
  end)

  it("ends a frame of the largest numbers of steps, and a neighbourhood of all points", function()
    local grid = "points = rapid.points.grid { size = {%d, %d, %d}, spacing = 1 }"
    for _, text in ipairs {
      "rapid.create { " .. grid:format(10, 10, 10) .. ", subframes = 10000 } :contact { radius = 0.6 } :gravity {} " ..
        ":collide { shape = rapid.shape.sphere {} } :solve { substeps = 1048576, iterations = 10000 }",
      "rapid.create { " .. grid:format(10, 10, 10) .. " } :turbulence {} " ..
        ":solve { tolerance = 1e-300, max_substeps = 1048576 }",
      "rapid.create { " .. grid:format(50, 50, 50) .. " } :interact { radius = 1e9, cohesion = 1 } :solve {}",
    } do
      local status, milliseconds = end_of('local rapid = require "rapid" return ' .. text, "run scene.lua -f 1-3")
      assert.equal(130, status, text)
      assert.truthy(milliseconds < 1000, text .. ": " .. milliseconds .. " ms")
    end
  end)
end)

describe("a reader that goes away", function()
  it("does not end the run", function()
    local folder = new_folder(points .. "return rapid.create { points = points } :solve {}")
    local result = command.shell([[("$RAPID" run scene.lua -f 1-200 -o a.####.csv; echo $? >status) | head -n 1]],
      { cwd = folder.path })
    assert.equal(0, result.status)
    assert.equal("0\n", folder:read "status")
    assert.truthy(folder:read "a.0200.csv")
  end)
end)
