-- rapid wedge: one scene at many settings.
local await = require "tests.await"
local command = require "testing.command"
local csv_rows = require "tests.csv_rows"
local json = require "dkjson"

local folder = command.folder()

folder:write("box.lua", [[
local rapid = require "rapid"
local rate = rapid.param("rate", 240, "points a second")
local bad = rapid.param("bad", false, "whether it fails in frame 3")
return rapid.create {}
  :emit { source = rapid.shape.box {}, from = "volume", rate = rate }
  :points("fails", function(p, frame) if bad and frame.number == 3 then error "on purpose" end end)
  :gravity {}
  :collide { shape = rapid.shape.plane { offset = -0.6 } }
  :solve { substeps = 2 }
]])

local function wedge(arguments)
  return command.rapid("wedge box.lua " .. arguments, { cwd = folder.path })
end

local function report(path)
  return json.decode((folder:read(path or "wedge.json")))
end

-- Returns the width and height of a .png.
local function size_of(picture)
  local bytes = { picture:byte(17, 24) }
  return bytes[3] * 256 + bytes[4], bytes[7] * 256 + bytes[8]
end

describe("rapid wedge", function()
  it("writes what rapid run writes with the same settings, for all combinations", function()
    local result = wedge "--vary rate=240,480 --vary solve.substeps=1,4 -f 1-6 -o 'all/{rate}-{substeps}.####.bgeo'"
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
    for _, rate in ipairs { 240, 480 } do
      for _, substeps in ipairs { 1, 4 } do
        local alone = command.rapid(("run box.lua --set rate=%d --set solve.substeps=%d -f 1-6 -o 'one.####.bgeo'")
          :format(rate, substeps), { cwd = folder.path })
        assert.equal(0, alone.status)
        for frame = 1, 6 do
          local name = ("all/%d-%d.%04d.bgeo"):format(rate, substeps, frame)
          assert.truthy(folder:read(name) == folder:read(("one.%04d.bgeo"):format(frame)), name)
        end
      end
    end
  end)

  it("lists points, contacts, error and time of each row, in order, as a table and as wedge.json", function()
    local result = wedge "--vary rate=240,480 --vary solve.substeps=1,4 -f 1-12 --jobs 2"
    assert.equal(0, result.status)
    local found = report()
    assert.equal(4, #found.rows)
    assert.same({ rate = { "240", "480" }, ["solve.substeps"] = { "1", "4" } }, found.varied)
    for k, row in ipairs(found.rows) do
      local rate = k <= 2 and 240 or 480
      assert.same({ rate = tostring(rate), ["solve.substeps"] = k % 2 == 1 and "1" or "4" }, row.settings)
      assert.equal("done", row.status)
      assert.equal(12, row.last_frame)
      assert.equal(rate * 11 / 24, row.points) -- the first frame is the start
      assert.truthy(row.contacts > 0 and row.seconds > 0)
      assert.truthy(row.error.position_p50 <= row.error.position_p95
        and row.error.position_p95 <= row.error.position_max)
      local line = ("%%f[%%w]%d +%s +%d +"):format(rate, row.settings["solve.substeps"], row.points)
      assert.truthy(result.stdout:find(line), line)
    end
  end)

  it("draws a contact sheet of the last pictures", function()
    local result = wedge "--vary rate=240,480,960 -f 1-5x2 --size 320x180 -o 'pictures/{rate}.####.png'"
    assert.equal(0, result.status)
    local width, height = size_of((folder:read "pictures/wedge.png"))
    assert.equal(2 * 400 + 3 * 12, width) -- two columns
    assert.truthy(height > 2 * 225 and height < 2 * 225 + 200)
    local none = wedge "--vary rate=240,480 -f 1-2"
    assert.truthy(none.stdout:find("no contact sheet", 1, true))
  end)

  it("puts a vec3 into names without its braces", function()
    local result = wedge "--vary 'gravity.g={0,-2,0},{0, -9.81, 0}' -f 2 -o 'g/{g}.csv'"
    assert.equal("", result.stderr)
    assert.truthy(folder:read "g/0,-2,0.csv" and folder:read "g/0,-9.81,0.csv")
  end)

  it("goes in step with --zip", function()
    local result = wedge "--vary rate=240,480 --vary solve.substeps=1,4 --zip -f 1-2"
    assert.equal(0, result.status)
    local found = report()
    assert.equal(2, #found.rows)
    assert.same({ rate = "480", ["solve.substeps"] = "4" }, found.rows[2].settings)
  end)

  it("shows a row that fails, and runs the others", function()
    local result = wedge "--vary bad=true,false -f 1-4 -o 'failing/{bad}.####.csv'"
    assert.equal(1, result.status)
    assert.truthy(result.stderr:find("1/2  bad=true: failed: ", 1, true))
    assert.truthy(result.stderr:find("box.lua:6: .*on purpose"))
    local found = report "failing/wedge.json"
    assert.equal("failed", found.rows[1].status)
    assert.truthy(found.rows[1].failure:find("on purpose", 1, true))
    assert.equal("done", found.rows[2].status)
    assert.truthy(folder:read "failing/true.0002.csv")
    assert.truthy(folder:read "failing/false.0004.csv")
    assert.is_nil(folder:read "failing/true.0003.csv")
  end)

  it("refuses what no row can run, before any does", function()
    local wrong = {
      ["--vary rte=1,2"] = 'no parameter "rte"; did you mean "rate"?',
      ["--vary solv.substeps=1,2"] = 'the graph has no node "solv"; did you mean "solve"?',
      ["--vary solve.substep=1,2"] = "substeps",
      ["--vary rate=1,x"] = false, -- found in the row
      ["--vary rate"] = "it must be NAME=VALUE,VALUE,...",
      ["--vary rate=1,,2"] = "a value is missing",
      ["--vary rate=1,2 --vary rate=3"] = "rate is given twice",
      ["--vary rate=1,2 --vary solve.substeps=1,2,3 --zip"] = "rate has 2 values and solve.substeps has 3",
      ["--vary rate=1,2 -o 'x.####.csv'"] = "rate=1 and rate=2 write the same files; put {rate} into",
      ["--vary rate=1,1 -o '{rate}.####.csv'"] = "--vary: rate=1 appears twice; remove one",
      ["--vary 'rate=1,{1}' -o '{rate}.####.csv'"] = "rate=1 and rate={1} write the same files; remove one",
      ["--vary rate=1,2 -o '{rat}.####.csv'"] = '{rat} is not the name of a varied parameter; did you mean "rate"?',
      ["--vary rate=1,2 -o '{rate}.####.cvs'"] = ".cvs",
      ["--vary rate=1,2 --jobs 0"] = "--jobs",
      [""] = "--vary is required",
    }
    for arguments, message in pairs(wrong) do
      local result = wedge(arguments .. " -f 1-2")
      assert.equal(message and 2 or 1, result.status, arguments .. ": " .. result.stderr)
      assert.truthy(result.stderr:find(message or "rate=x: failed", 1, true), arguments .. ": " .. result.stderr)
    end
  end)

  it("fails of a row whose nodes write what another row's do", function()
    folder:write("written.lua", [[
local rapid = require "rapid"
local rate = rapid.param("rate", 24, "points a second")
local own = rapid.param("own", false, "whether a row has files of its own")
return rapid.create {} :emit { source = rapid.shape.box {}, rate = rate }
  :write { file = own and ("own_%d.####.ply"):format(rate) or "same.####.ply" } :solve {}
]])
    local function run(arguments)
      return command.rapid("wedge written.lua -f 1-3 --vary rate=24,48 " .. arguments, { cwd = folder.path })
    end
    for _, more in ipairs { "", "--jobs 2", "--untrusted" } do
      local same = run("--again " .. more)
      assert.equal(1, same.status)
      local reported = same.stdout .. same.stderr
      assert.truthy(reported:find('file = "same.####.ply": another run of the wedge writes this file too; put a ' ..
        "varied parameter into the name", 1, true), reported)
    end
    local own = run "--set own=true"
    assert.equal("", own.stderr)
    assert.equal(0, own.status)
    assert.truthy(folder:read "own_24.0003.ply" ~= folder:read "own_48.0003.ply")
  end)

  it("ends its rows with itself, and leaves whole files alone", function()
    local result = command.shell(await .. [[
      "$RAPID" wedge box.lua --vary rate=24000,48000 --jobs 2 -f 1-100000 -o "$PWD/long/{rate}.####.csv" &
      wedge=$!
      await $wedge test -e long/48000.0002.csv -a -e long/24000.0002.csv || echo it has written no frames
      kill -TERM $wedge
      wait $wedge
      echo status $?
      pgrep -f -- "--output=$PWD/long/" || echo none # of this wedge: others may run on the machine
    ]], { cwd = folder.path })
    assert.truthy(result.stdout:find "status 143\n", result.stdout .. result.stderr)
    assert.truthy(result.stdout:find "none\n", result.stdout)
    for _, name in ipairs(folder:list()) do assert.is_nil(name:find "unfinished") end
  end)
end)

describe("--set", function()
  it("gives a node's parameter a value, a vec3 too", function()
    local result = command.rapid("explain box.lua --set solve.substeps=7", { cwd = folder.path })
    assert.equal(0, result.status)
    local run = command.rapid("run box.lua --set gravity.g={0,-2,3} -f 1-3 -o g.####.csv", { cwd = folder.path })
    assert.equal(0, run.status, run.stderr)
    local fell = 0
    for _, row in ipairs(csv_rows(folder:read "g.0003.csv")) do
      assert.near(-2 / 3, row.vy / row.vz, 1e-5)
      fell = fell + 1
    end
    assert.truthy(fell > 10)
    local wrong = command.rapid("run box.lua --set solve.substeps=many", { cwd = folder.path })
    assert.equal(2, wrong.status)
    assert.truthy(wrong.stderr:find("substeps", 1, true))
  end)

  it("runs no row again that is done, but with --again, or if its files or its scene are others", function()
    local function times(of)
      return command.shell(("stat -c %%y again/%s.*.bgeo"):format(of), { cwd = folder.path }).stdout
    end
    local arguments = "--vary rate=240,480 -f 1-6 -o 'again/{rate}.####.bgeo'"
    assert.equal(0, wedge(arguments).status)
    local first, low, high = report "again/wedge.json", times(240), times(480)
    assert.equal(0, wedge(arguments).status)
    assert.equal(low .. high, times(240) .. times(480))
    local second = report "again/wedge.json"
    for k, row in ipairs(second.rows) do
      assert.truthy(row.seconds >= first.rows[k].seconds) -- those of the run that computed the row
      row.seconds, first.rows[k].seconds, row.peak_bytes, first.rows[k].peak_bytes = nil, nil, nil, nil
    end
    assert.same(first, second)
    os.remove(folder:file "again/480.0003.bgeo")
    assert.equal(0, wedge(arguments).status)
    assert.equal(low, times(240))
    assert.not_equal(high, times(480))
    high = times(480)
    assert.equal(0, wedge(arguments .. " --again").status)
    assert.not_equal(low, times(240))
    low = times(240)
    assert.equal(0, wedge(arguments .. " --set solve.substeps=3").status)
    assert.not_equal(low, times(240))
    assert.not_equal(high, times(480))
  end)

  it("keeps snapshots of rows with --cache", function()
    assert.equal(0, wedge("--vary rate=240,480 -f 1-6 --cache rows --cache-every 4").status)
    local snapshots = 0
    for _, name in ipairs(folder:list()) do
      if name:find "^rows/%x+/snapshot%.000[46]%.rapid$" then snapshots = snapshots + 1 end
    end
    assert.equal(4, snapshots)
    local result = wedge "--vary rate=240 -f 1-6 --cache-every 4"
    assert.equal(2, result.status)
    assert.equal("--cache-every sets how often snapshots are written; it needs --cache DIR\n", result.stderr)
  end)
end)
