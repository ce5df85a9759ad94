-- rapid run --cache: a run that resumes with the same bytes, and what prevents a resume.
local command = require "testing.command"
local amount = require "tests.amount"
local await = require "tests.await"
local statistics = require "tests.same_statistics"

local rain = [[
local rapid = require "rapid"
local rate = rapid.param("rate", 400, "births a second")
return rapid.create { seed = 3 }
  :emit { source = rapid.mesh.grid { size = {1, 1}, center = {0, 1, 0} }, rate = rate, velocity = {0, -1, 0},
          spread = 20 }
  :points("drift", function(p, frame) p.v = p.v + vec3(0.02 * p:rand(1, frame), 0, 0) end)
  :gravity {} :drag { quadratic = 0.1 } :turbulence { amplitude = 1 }
  :collide { shape = rapid.shape.plane {}, bounce = 0.4 }
  :solve { substeps = 2 }
]]

local function new_folder(text)
  local folder = command.folder()
  folder:write("scene.lua", text or rain)
  function folder:run(arguments, file)
    return command.rapid(("run %s %s"):format(file or "scene.lua", arguments), { cwd = self.path })
  end
  function folder:done(arguments)
    local result = self:run(arguments)
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
    return result.stdout
  end
  function folder:shell(line)
    local result = command.shell(line, { cwd = self.path })
    assert.equal(0, result.status, result.stdout .. result.stderr)
    return result.stdout
  end
  return folder
end

-- Compiles a plugin that has no nodes.
local function write_plugin(folder, name)
  folder:done "-f 1-1 --cache of_version"
  local known = command.rapid("info of_version/snapshot.####.rapid --json", { cwd = folder.path }).stdout
  folder:write("plugin.c", ('const char rapid_plugin_mark[] = "rapid plugin, built with %s";'):format(
    require "dkjson".decode(known)[1].fingerprint.Rapid))
  folder:shell("cc -shared -fPIC -o " .. name .. " plugin.c")
end

-- Returns the frames that a run reports as computed.
local function computed(said)
  local list = {}
  for number in said:gmatch "\nframe (%d+)  " do list[#list + 1] = tonumber(number) end
  return list
end

local function range(first, last)
  local list = {}
  for k = first, last do list[#list + 1] = k end
  return list
end

describe("rapid run --cache", function()
  it("continues after the last snapshot, to the files and statistics of an uninterrupted run", function()
    local folder = new_folder()
    folder:done "-f 1-30 -o whole/a.####.bgeo --stats whole.json --events whole.csv"
    local arguments = "--cache cache -o a/a.####.bgeo --stats a.json --events a.csv"
    folder:done("-f 1-14 " .. arguments)
    local said = folder:done("-f 1-30 --threads 3 " .. arguments)
    assert.same(range(15, 30), computed(said))
    assert.truthy(said:find("frames 1-14 are known from cache", 1, true))
    folder:shell "diff -r whole a && cmp whole.csv a.csv"
    assert.same(statistics.of(folder:read "whole.json"), statistics.of(folder:read "a.json"))
    folder:shell "rm a.csv a/a.0003.bgeo"
    folder:done("-f 1-30 " .. arguments)
    folder:shell "diff -r whole a && cmp whole.csv a.csv && rm a.csv"
    assert.same(range(21, 30), computed(folder:done("-f 1-30 " .. arguments))) -- for the events of the last frame
    folder:shell "cmp whole.csv a.csv"
  end)

  it("continues events, whatever ended the run, and skips a snapshot whose events are damaged", function()
    local folder = new_folder()
    folder:done "-f 1-40 --set rate=4000 --events whole.csv --quiet"
    local said = folder:shell [[
run() { $limit "$RAPID" run scene.lua -f 1-40 --set rate=4000 --cache cache --cache-every 3 --events a.csv "$@"; }
for wait in 0.1 0.2 0.15 0.3 0.25; do
  limit="timeout -s KILL $wait"
  run --threads $((1 + ${wait#0.} % 3)) --quiet
  [ ! -e a.csv ] || { cmp whole.csv a.csv && rm a.csv; }
done 2>/dev/null
limit=
run --threads 2 --quiet && cmp whole.csv a.csv && rm a.csv || exit 1
# A byte behind the events of half of the frames.
at=$(($(stat -c %s cache/events) / 2))
printf '\125' | dd of=cache/events bs=1 seek=$at conv=notrunc status=none
run --quiet 2>&1 && cmp whole.csv a.csv
]]
    assert.matches("warning: cache/snapshot.0039.rapid: its events in cache/events: it is damaged; it is skipped",
      said, 1, true)
    assert.truthy(not said:find("snapshot.0003", 1, true))
    -- Once more from the repaired cache.
    folder:shell "rm a.csv"
    assert.equal("", folder:done("-f 1-40 --set rate=4000 --cache cache --cache-every 3 --events a.csv --quiet"))
    folder:shell "cmp whole.csv a.csv"
  end)

  it("keeps a snapshot after every tenth frame, and the last", function()
    local folder = new_folder()
    folder:done "-f 1-24 --cache cache --quiet"
    local names = {}
    for _, name in ipairs(folder:list()) do
      if name:find "snapshot" then names[#names + 1] = name end
    end
    assert.same({ "cache/snapshot.0010.rapid", "cache/snapshot.0020.rapid", "cache/snapshot.0024.rapid" }, names)
    folder:done "-f 1-6 --cache other --cache-every 4 --quiet"
    assert.truthy(folder:read "other/snapshot.0004.rapid")
    assert.truthy(folder:read "other/snapshot.0006.rapid")
    folder:done "-f 1-6 --cache none --cache-every 0 --quiet"
    assert.is_nil(folder:read "none/snapshot.0006.rapid")
  end)

  it("starts near the first requested frame", function()
    local folder = new_folder()
    folder:done "-f 1-30 --cache cache --stats whole.json"
    folder:done "-f 26-28 -o whole.####.bgeo"
    local said = folder:done "-f 26-28 -o a.####.bgeo --cache cache --stats a.json"
    assert.same(range(21, 28), computed(said))
    folder:shell "for f in 26 27 28; do cmp whole.00$f.bgeo a.00$f.bgeo; done"
    assert.equal(28, #statistics.of(folder:read "a.json").frames)
  end)

  it("neither computes nor writes existing frames again, except with --again", function()
    local folder = new_folder()
    local arguments = "-f 1-12 -o a/a.####.bgeo -o a/p.####.png --size 64x36 --cache cache --stats a.json"
    folder:done(arguments)
    local before, times = folder:read "a.json", folder:shell "stat -c '%n %y' a/*"
    local said = folder:done(arguments)
    assert.same({}, computed(said))
    assert.is_nil(said:find("writing", 1, true))
    assert.equal(times, folder:shell "stat -c '%n %y' a/*")
    assert.same(statistics.of(before), statistics.of(folder:read "a.json"))
    folder:shell "cp -r a whole && rm a/a.0007.bgeo a/p.0012.png"
    assert.same({ 11, 12 }, (function()
      local list = computed(folder:done(arguments))
      return { list[#list - 1], list[#list] }
    end)())
    folder:shell "diff -r whole a"
    assert.same(range(1, 12), computed(folder:done(arguments .. " --again")))
    folder:shell "diff -r whole a"
    assert.not_equal(times, folder:shell "stat -c '%n %y' a/*")
  end)

  it("writes a file again that another has changed", function()
    local folder = new_folder()
    local arguments = "-f 1-12 -o a/a.####.bgeo --cache cache"
    folder:done(arguments)
    folder:shell "cp -r a whole && printf x >>a/a.0011.bgeo"
    folder:done(arguments)
    folder:shell "diff -r whole a"
  end)

  it("draws pictures and films as a run that was not interrupted", function()
    -- The first points are born in the sixth frame.
    local folder = new_folder((rain:gsub(":emit {", ":emit { impulse = { [6] = 30 }, "):gsub("rate = rate,", "")))
    local outputs = "--size 64x36 -o DIR/p.####.png -o DIR/n.####.png:P -o DIR/film.gif"
    folder:done("-f 1-18 " .. outputs:gsub("DIR", "whole"))
    folder:done("-f 1-18 -o a/p.####.png --size 64x36 --cache cache --cache-every 4")
    folder:shell "rm a/p.0013.png"
    folder:done("-f 1-18 -o a/p.####.png --size 64x36 --cache cache --cache-every 4")
    folder:shell "rm a/p.0003.png"
    folder:done("-f 1-18 " .. outputs:gsub("DIR", "a") .. " --cache cache --cache-every 4")
    folder:shell "diff -r whole a"
    assert.same({}, computed(folder:done("-f 1-18 " .. outputs:gsub("DIR", "a") .. " --cache cache --cache-every 4")))
  end)

  it("leaves files of :write nodes that are there, and writes those that are not", function()
    local folder = new_folder(rain:gsub(":gravity {}", ":write { file = \"b/b.####.csv\" } :gravity {}"))
    folder:done "-f 1-12 --cache cache --cache-every 5"
    folder:shell "cp -r b whole && rm b/b.0012.csv"
    assert.same({ 11, 12 }, computed(folder:done "-f 1-12 --cache cache --cache-every 5"))
    folder:shell "diff -r whole b"
  end)

  it("refuses another run, and says what differs, by name", function()
    local folder = new_folder()
    folder:write("helper.lua", "return { factor = 1 }")
    folder:write("points.csv", "id,Px,Py,Pz\n0,0,1,0\n")
    local text = [[
local rapid = require "rapid"
local helper = require "helper"
local rate = rapid.param("rate", 20000, "births a second")
return rapid.create { seed = 3 }
  :emit { source = rapid.points.read "points.csv", from = "points", rate = rate }
  :points("push", function(p) p.v = p.v * helper.factor end)
  :solve { substeps = 2 }
]]
    folder:write("scene.lua", text)
    folder:done "-f 1-3 --cache cache -o a.####.bgeo --stats a.json"
    local function refused(arguments)
      local result = folder:run("-f 1-3 --cache cache -o a.####.bgeo --stats a.json " .. (arguments or ""))
      assert.equal(2, result.status)
      assert.equal("", result.stdout)
      local what, rest = result.stderr:match "^%-%-cache cache: the cache belongs to another run: (.*); give (.*)$"
      assert.equal("another folder, or --again to start again\n", rest, result.stderr)
      return what
    end
    assert.equal("emit1.rate was 20000, is 30000; rate was 20000, is 30000", refused "--set rate=30000")
    assert.equal("solve1.substeps was 2, is 3", refused "--set solve.substeps=3")
    assert.equal("seed of create1 was 3, is 4", refused "--seed 4")
    folder:write("scene.lua", (text:gsub("p.v %* helper", "0.5 * p.v * helper")))
    assert.equal("the function in line 6 of scene.lua changed", refused())
    folder:write("scene.lua", (text:gsub(":solve", ":gravity {} :solve")))
    assert.equal("gravity1 was missing, is gravity after push; solve1 was solve after push, " ..
      "is solve after gravity1", refused())
    folder:write("scene.lua", "-- the same with a comment\n\n" .. text)
    assert.same({}, computed(folder:done "-f 1-3 --cache cache -o a.####.bgeo --stats a.json"))
    folder:write("helper.lua", "return { factor = 2 }")
    assert.equal("helper.lua changed outside its functions", refused())
    folder:write("helper.lua", "return { factor = 1 }")
    folder:write("points.csv", "id,Px,Py,Pz\n0,0,2,0\n")
    assert.equal("the content of points.csv changed", refused())
    folder:done "-f 1-3 --cache cache -o a.####.bgeo --stats a.json --again"
    folder:done "-f 1-3 --cache cache -o a.####.bgeo --stats a.json"
  end)

  it("goes on whatever options are given that do not change frames, and refuses all others", function()
    -- Options of the second run. An entry with `differs` is refused with that text.
    local options = {
      ["--set"] = { "--set rate=500", differs = "emit1.rate" },
      ["--seed"] = { "--seed 4", differs = "seed of create1" },
      ["--keep-all"] = { "--keep-all", differs = "attributes of create1" },  -- snapshots lack some attributes
      ["--script-timeout"] = { "--script-timeout 100" },
      ["--script-memory"] = { "--script-memory 512M" },
      ["--memory"] = { "--memory 2G" }, ["--frames"] = { "--frames 5-6" },
      ["--output"] = { "--output b.####.bgeo" },
      ["--camera"] = { "--camera 0,1,5,0,0,0" }, ["--size"] = { "--size 64x64" },
      ["--part"] = { "--part 1/2", differs = "--part" }, ["--sample"] = { "--sample 0.5", differs = "--sample" },
      ["--stats"] = { "--stats s.json" }, ["--profile"] = { "--profile p.json" },
      ["--events"] = { "--events e.csv", differs = "--events" }, ["--cache"] = { "" },
      ["--cache-every"] = { "--cache-every 3" }, ["--again"] = { "--again" }, ["--grace"] = { "--grace 5" },
      ["--durable"] = { "--durable" }, ["--quiet"] = { "--quiet" },
      ["--untrusted"] = { "--untrusted" }, ["--allow-read"] = { "--untrusted --allow-read ." },
      ["--threads"] = { "--threads 3" }, ["--plugin"] = { "--plugin p.so", differs = "the plugin p.so" },
      ["--verbose"] = { "--verbose" },
      -- Options that exclude --cache, or are not those of a run.
      ["--watch"] = false, ["--farm"] = false, ["--farm-options"] = false, ["--dry-run"] = false, ["--parts"] = false,
      ["--help"] = false,
    }
    local help, listed = command.rapid("run --help").stdout, 0
    for name in help:gmatch "\n  [%-%w,]*(%-%-[%w%-]+)" do
      listed = listed + 1
      assert.truthy(options[name] ~= nil, name .. " is an option of run that this test does not know")
    end
    assert.truthy(listed > 30, help)

    local begun, whole = new_folder(), new_folder()
    write_plugin(begun, "p.so")
    begun:done "-f 1-4 -o a.####.bgeo --cache cache"
    whole:done "-f 1-6 -o a.####.bgeo"
    local function check(name, option, first, second)
      local function run(given, frames)
        return command.rapid(("run scene.lua -o a.####.bgeo --cache cache %s %s"):format(given,
          given:find "%-%-frames" and "" or "-f " .. frames), { cwd = begun:file "trial" })
      end
      begun:shell("rm -rf trial && mkdir trial && cp -p scene.lua p.so trial")
      if first then
        assert.equal(0, run(first, "1-4").status, name)
      else
        begun:shell "cp -rp cache trial"
      end
      local result = run(second, "5-6")
      assert.equal(option.differs, (result.stderr:match "the cache belongs to another run: (.-) was "), name)
      assert.equal(option.differs and 2 or 0, result.status, name .. ": " .. result.stderr)
      if option.differs then return end
      if second ~= "--quiet" and second ~= "--again" then
        assert.same(range(5, 6), computed(result.stdout), name)
      end
      for _, file in ipairs { "a.0005.bgeo", "a.0006.bgeo" } do
        assert.truthy(whole:read(file) == begun:read("trial/" .. file), name .. ": " .. file)
      end
    end
    for name, option in pairs(options) do
      if option then
        check(name, option, nil, option[1])
        if name ~= "--frames" then check(name, option, option[1], "") end
      end
    end
  end)

  it("refuses a plugin that has changed, also one of several that have a name", function()
    local folder = new_folder()
    folder:shell "mkdir one two"
    write_plugin(folder, "one/p.so")
    folder:shell "cp one/p.so two"
    local function run(frames)
      return command.rapid("run scene.lua --cache cache -f " .. frames,
        { cwd = folder.path, environment = { RAPID_PLUGIN_PATH = "one/p.so:two/p.so" } })
    end
    assert.equal("", run("1-4").stderr)
    assert.same(range(5, 6), computed(run("1-6").stdout))
    for _, name in ipairs { "one/p.so", "two/p.so" } do
      folder:shell("cp " .. name .. " kept; printf x >>" .. name)
      local result = run "1-6"
      assert.equal(2, result.status)
      assert.match("the cache belongs to another run: the plugin p.so was %x+ %x+, is %x+ %x+;", result.stderr)
      folder:shell("cp kept " .. name)
    end
    assert.same({}, computed(run("1-6").stdout))
  end)

  it("takes events up from snapshots where it keeps none itself", function()
    local folder = new_folder()
    folder:done "-f 1-12 --events whole.csv"
    folder:done "-f 1-10 --events a.csv --cache cache --cache-every 5"
    assert.same({ 11, 12 }, computed(folder:done "-f 1-12 --events a.csv --cache cache --cache-every 0"))
    folder:shell "cmp whole.csv a.csv"
    assert.same({ 11, 12 }, computed(folder:done "-f 1-12 --events b.csv --cache cache --cache-every 5"))
    folder:shell "cmp whole.csv b.csv"
  end)

  it("estimates errors in all runs, or in none, as the first one has", function()
    local with, without, whole = new_folder(), new_folder(), new_folder()
    whole:done "-f 1-6 --stats s.json"
    with:done "-f 1-4 --cache cache"
    with:done "-f 1-5 --cache cache --quiet"
    with:done "-f 1-6 --cache cache --stats s.json"
    assert.same(statistics.of(whole:read "s.json"), statistics.of(with:read "s.json"))
    without:done "-f 1-4 --cache cache --quiet"
    without:done "-f 1-5 --cache cache --quiet"
    local result = without:run "-f 1-6 --cache cache --stats s.json"
    assert.equal(0, result.status)
    assert.equal("warning: --cache cache: errors are not estimated, because the run that began the cache did not " ..
      "(--quiet); give --again to estimate them\n", result.stderr)
    assert.falsy(without:read "s.json":find("position_max", 1, true))
    without:done "-f 1-6 --cache cache --stats s.json --again"
    assert.same(statistics.of(whole:read "s.json"), statistics.of(without:read "s.json"))
  end)

  it("refuses files that are read in frames and have changed", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create {}
  :emit { source = function(frame) return rapid.points.read(("points%d.csv"):format(frame.number % 3)) end,
          from = "points", rate = 10 } :solve {}
]]
    for k = 0, 2 do folder:write(("points%d.csv"):format(k), "id,Px,Py,Pz\n0,0,1,0\n") end
    folder:done "-f 1-6 --cache cache"
    folder:write("points2.csv", "id,Px,Py,Pz\n0,0,2,0\n")
    local result = folder:run "-f 1-9 --cache cache"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("the content of points2.csv changed", 1, true), result.stderr)
    folder:shell "rm points2.csv"
    result = folder:run "-f 1-9 --cache cache"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("points2.csv no longer exists", 1, true), result.stderr)
  end)

  it("refuses a function of the frame that remembers, before the first frame, with the remedy", function()
    local function stderr_of(body)
      local folder = new_folder(([[
local rapid = require "rapid"
local count, list = 0, {}
local function next_rate(frame)
  %s
  return 10
end
return rapid.create {} :emit { source = rapid.mesh.grid {}, rate = next_rate } :solve {}
]]):format(body))
      folder:done "-f 1-2"
      local result = folder:run "-f 1-2 --cache cache"
      assert.equal(result.stderr == "" and 0 or 2, result.status)
      return result.stderr
    end
    local remedy = "; a snapshot of --cache can't store what a function of the frame remembers: compute it from " ..
      "frame.number, or store it in points.detail.NAME, in a :detail\n"
    assert.equal("scene.lua:4: node \"emit1\": a function of the frame assigns the upvalue \"count\"" .. remedy,
      stderr_of "count = count + 1")
    assert.equal("scene.lua:4: node \"emit1\": a function of the frame assigns into a table that all points share" ..
      remedy, stderr_of "list[#list + 1] = frame.number")
    assert.equal("scene.lua:4: node \"emit1\": a function of the frame changes a table that all points share by " ..
      "table.insert" .. remedy, stderr_of "table.insert(list, 1)")
    assert.equal("", stderr_of "local own, n = {}, 0 own[1] = frame.number for _, x in ipairs(own) do n = n + x end")
  end)

  -- Runs again after some damage and returns the warnings. There are nine frames, with snapshots of 3, 6 and 9.
  local damaged = new_folder()
  damaged:done "-f 1-12 -o whole/a.####.bgeo"
  damaged:done "-f 1-9 -o a/a.####.bgeo --cache cache --cache-every 3"
  damaged:shell "cp -rp a kept_a && mv cache kept"
  local function warnings_of(damage)
    damaged:shell("rm -rf cache a && cp -r kept cache && cp -rp kept_a a && " .. damage)
    local result = damaged:run "-f 1-12 -o a/a.####.bgeo --cache cache --cache-every 3"
    assert.equal(0, result.status, damage .. ": " .. result.stderr)
    damaged:shell "diff -r whole a"
    return result.stderr, computed(result.stdout)[1]
  end

  it("skips damaged and foreign snapshots with a warning, and continues after an earlier one", function()
    local snapshot = "cache/snapshot.0009.rapid"
    local function left_out(why)
      return ("warning: %s: %s; it is skipped\n"):format(snapshot, why)
    end
    local function check(warning, first, damage)
      local found, from = warnings_of(damage)
      assert.equal(warning, found)
      assert.equal(first, from)
    end
    check("", 10, "true")
    check(left_out "its checksum is wrong; it is not a complete snapshot", 7, "truncate -s -1 " .. snapshot)
    check(left_out "it does not begin like one; it is not a complete snapshot", 7, "echo text >" .. snapshot)
    check(left_out "it belongs to another run: ", 7, "cp cache/snapshot.0006.rapid " .. snapshot)
    check(left_out "it belongs to another run: emit1.rate was 20, is 400; rate was 20, is 400", 7,
      '"$RAPID" run scene.lua -f 1-9 --set rate=20 --cache other >/dev/null && cp other/snapshot.0009.rapid ' ..
      snapshot)
    check("", 10, "echo text >cache/snapshot.abc.rapid")
    -- Damaged entries of the journal are not used.
    check("warning: cache/journal is damaged; the cache starts again\n", 1, "echo text >cache/journal")
    check("warning: cache/journal: an entry is damaged; frames without a record are computed again\n", 7,
      "truncate -s -1 cache/journal")
    check("warning: cache/journal is missing; the cache starts again\n", 1, "rm cache/journal")
  end)

  it("comes to the same files whatever is damaged in a cache", function()
    local lehmer = require "tests.lehmer".new(11)
    for _ = 1, amount.of("RAPID_DAMAGES", 5) do
      local file = "kept/" .. lehmer.pick { "snapshot.0009.rapid", "snapshot.0006.rapid", "journal" }
      local bytes = damaged:read(file)
      local at = lehmer.below(#bytes) + 1
      if lehmer.chance(0.3) then
        bytes = bytes:sub(1, at - 1)
      else
        local flipped = bit.bxor(bytes:byte(at), bit.lshift(1, lehmer.below(8)))
        bytes = bytes:sub(1, at - 1) .. string.char(flipped) .. bytes:sub(at + 1)
      end
      damaged:write("damaged", bytes)
      local warning = warnings_of("mv damaged " .. file:gsub("kept", "cache"))
      assert.truthy(warning ~= "" or file:find "0006", "no word about " .. file)
    end
  end)

  it("has one run at a time in a folder", function()
    local folder = new_folder()
    folder:shell "mkdir cache"
    local said = folder:shell [[
exec 9>cache/.lock
flock -n 9
"$RAPID" run scene.lua -f 1-2 --cache cache 2>&1 || echo "status $?"
]]
    assert.equal("--cache cache: another run is using it; wait for its end, or choose another folder\nstatus 2\n", said)
    -- A run waits for another that is ending.
    assert.truthy(folder:shell(await .. [[
flock cache/.lock sleep 0.5 &
await $! test -e cache/.lock || exit 1
"$RAPID" run scene.lua -f 1-2 --cache cache
wait
]]):find("\nframe 2  ", 1, true))
  end)

  it("ends the frame on SIGTERM, keeps it in a snapshot, and goes on from there", function()
    local folder = new_folder()
    local said = folder:shell(await .. [[
run() { exec "$RAPID" run scene.lua -f 1-40 --set rate=4000 "$@"; }
(run -o whole/a.####.bgeo --quiet) || exit 1
run -o a/a.####.bgeo --cache cache --cache-every 1000 --stats a.json >said 2>&1 &
one=$!
await $one grep -q '^frame 3 ' said || { cat said; exit 1; }
kill -TERM $one
wait $one
echo "status $?"
tail -n 1 said
ls cache | grep snapshot
(run -o a/a.####.bgeo --cache cache --stats b.json) >said 2>&1 || cat said
diff -r whole a
]])
    local frame, snapshot = said:match("^status 143\ninterrupted after frame (%d+); the same command continues " ..
      "from there\nsnapshot%.(%d+)%.rapid\n$")
    assert.truthy(frame, said)
    assert.equal(tonumber(frame), tonumber(snapshot))
    assert.equal(tonumber(frame), #statistics.of(folder:read "a.json").frames)
    assert.equal(40, #statistics.of(folder:read "b.json").frames)
  end)

  it("drops a frame that takes longer than the grace", function()
    local folder = new_folder [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = { {0, 0, 0} } } }
  :detail("slow", function(points, frame)
    local sum = 0
    if frame.number == 4 then for k = 1, 1e10 do sum = sum + k % 3 end end
    points.detail.sum = sum
  end) :solve {}
]]
    local said = folder:shell(await .. [[
"$RAPID" run scene.lua -f 1-8 --cache cache --cache-every 2 --grace 0.2 >said 2>&1 &
one=$!
await $one grep -q '^frame 3 ' said || { cat said; exit 1; }
kill -TERM $one
wait $one
echo "status $?"
tail -n 1 said
ls cache | grep snapshot
]])
    assert.equal("status 143\ninterrupted; the frame took longer than --grace allows and is dropped\n" ..
      "snapshot.0002.rapid\n", said)
    -- A second signal ends it at once. (The first run's output would be found before this one begins.)
    said = folder:shell(await .. [[
"$RAPID" run scene.lua -f 1-8 --cache other --grace 1000 >again 2>&1 &
one=$!
await $one grep -q '^frame 3 ' again || { cat again; exit 1; }
kill -TERM $one
sleep 0.1
kill -TERM $one
wait $one
echo "status $?"
tail -n 1 again
]])
    assert.equal("status 143\ninterrupted\n", said)
  end)

  it("goes on where snapshots can't be written, says so, and writes its files", function()
    local folder = new_folder()
    folder:done "-f 1-12 -o whole/a.####.bgeo"
    folder:shell "mkdir -p cache/snapshot.0005.rapid/taken"
    local result = folder:run "-f 1-12 -o a/a.####.bgeo --cache cache --cache-every 5"
    assert.equal(0, result.status)
    assert.equal("warning: frame 6: cache/snapshot.0005.rapid: can't be written: it is not a regular file; the run " ..
      "continues without this snapshot\n", (result.stderr:gsub("frame %d+", "frame 6")))
    folder:shell "diff -r whole a"
    -- Tests a full disk; a private namespace may mount one.
    if command.shell("unshare -rm true").status ~= 0 then return end
    local said = folder:shell [[
mkdir full
unshare -rm sh -c 'mount -t tmpfs -o size=48k none full && exec "$0" "$@"' "$RAPID" run scene.lua -f 1-12 \
  -o b/a.####.bgeo --cache full/cache --cache-every 1 2>&1 >/dev/null
echo "status $?"
diff -r whole b
]]
    assert.truthy(said:find("No space left on device; the run continues without this snapshot", 1, true), said)
    assert.truthy(said:find "status 0\n$", said)
  end)

  it("says what goes with it and what does not", function()
    local folder = new_folder()
    local function refusal(arguments)
      local result = folder:run(arguments)
      assert.equal(2, result.status)
      return result.stderr
    end
    assert.equal("--again replaces the contents of a cache; add --cache DIR, or remove --again\n",
      refusal "-f 1-2 --again")
    assert.equal("--cache-every sets how often snapshots are written; it needs --cache DIR\n",
      refusal "-f 1-2 --cache-every 3")
    assert.equal("--watch runs a changing graph, which --cache can't resume; remove one of them\n",
      refusal "-f 1-2 --cache cache --watch")
    assert.truthy(refusal "-f 1-2 --cache cache --cache-every -1":find("whole number, at least 0", 1, true))
    assert.truthy(refusal "-f 1-2 --cache cache --grace 0":find("a number above 0", 1, true))
    assert.equal(0, folder:run("-f 1-3 --cache cache --untrusted").status)
    assert.equal(0, folder:run("-f 1-5 --cache cache --untrusted").status)
  end)
end)

describe("rapid info", function()
  it("describes a snapshot, and the state of each node", function()
    local folder = new_folder()
    folder:done "-f 1-4 --cache cache"
    local result = command.rapid("info cache/snapshot.0004.rapid", { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
    assert.truthy(result.stdout:find("of scene.lua after frame 4\n", 1, true), result.stdout)
    assert.truthy(result.stdout:find "\n  create1  %d+ bytes\n", result.stdout)
    assert.truthy(result.stdout:find "\n  emit1  %d+ bytes\n", result.stdout)
    assert.truthy(result.stdout:find("\n  rate  400\n", 1, true), result.stdout)
    local json = require "dkjson".decode(command.rapid("info cache/snapshot.####.rapid --json",
      { cwd = folder.path }).stdout)
    assert.equal(4, json[1].frame)
    assert.equal("400", json[1].fingerprint.rate)
    folder:shell "truncate -s -3 cache/snapshot.0004.rapid"
    result = command.rapid("info cache/snapshot.0004.rapid", { cwd = folder.path })
    assert.equal(2, result.status)
    assert.equal("cache/snapshot.0004.rapid: its checksum is wrong; it is not a complete snapshot\n", result.stderr)
  end)
end)
