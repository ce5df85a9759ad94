-- rapid test: how script-level tests are found, run and counted, and their access to scenes.
local await = require "tests.await"
local command = require "testing.command"

local scene = [[
local rapid = require "rapid"
local up = rapid.param("up", 0, "m/s")
local falling = rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 3, 0}}, heat = {2, 4} } }
  :points("sort", function(p) if p.id == 1 then p:join "second" end; p.v = p.v + vec3(0, up, 0) end)
  :solve {}
return { main = falling, other = rapid.create { points = rapid.points.from { P = {{0, 7, 0}} } } }
]]

local function new_folder(files)
  local folder = command.folder()
  for name, text in pairs(files) do
    os.execute("mkdir -p " .. command.quoted(folder:file(name):match "^(.*)/"))
    folder:write(name, text)
  end
  function folder:test(arguments)
    return command.rapid("test " .. arguments, { cwd = self.path })
  end
  return folder
end

local passing = 'describe("one", function() it("is true", function() assert.is_true(true) end) end)\n'
local failing = [[
describe("two", function()
  it("is false", function() assert.is_true(false) end)
  it("is true", function() end)
end)
]]

describe("rapid test", function()
  it("prints the counts alone where all pass", function()
    local result = new_folder({ ["a.lua"] = passing }):test "a.lua"
    assert.equal(0, result.status, result.stderr)
    assert.equal("1 passed, 0 failed, 0 skipped\n", result.stdout)
    assert.equal("", result.stderr)
  end)

  it("names what failed with file and line, and ends with 1", function()
    local result = new_folder({ ["b.lua"] = failing }):test "b.lua"
    assert.equal(1, result.status)
    assert.truthy(result.stdout:find("^FAILED two is false\n  b.lua:2: "), result.stdout)
    assert.truthy(result.stdout:find("\n1 passed, 1 failed, 0 skipped\n$"), result.stdout)
  end)

  it("counts pending tests as skipped", function()
    local folder = new_folder { ["a.lua"] = 'describe("later", function() pending("is done") end)\n' .. passing }
    local result = folder:test "a.lua"
    assert.equal(0, result.status)
    assert.equal("1 passed, 0 failed, 1 skipped\n", result.stdout)
  end)

  it("runs the files test_*.lua of a folder and of those in it", function()
    local folder = new_folder { ["t/test_a.lua"] = passing, ["t/deep/test_b.lua"] = passing, ["t/other.lua"] = failing }
    assert.equal("2 passed, 0 failed, 0 skipped\n", folder:test("t").stdout)
    assert.equal("1 passed, 0 failed, 0 skipped\n", folder:test("t/deep").stdout)
  end)

  it("runs the tests whose name matches --filter alone", function()
    local folder = new_folder { ["t/test_a.lua"] = passing, ["t/test_b.lua"] = failing }
    assert.equal("1 passed, 0 failed, 0 skipped\n", folder:test("t --filter 'two is t'").stdout)
    local none = folder:test "t --filter three"
    assert.equal(2, none.status)
    assert.equal('no test has a name that matches "three"\n', none.stderr)
  end)

  local mixed = [[
describe("a <test> # 1", function()
  it("is true", function() end)
  it("is false", function() error("1 < 2 & \"3\"\nsecond line", 0) end)
  pending("is to come")
end)
]]

  it("speaks TAP with --format tap", function()
    local folder = new_folder { ["a.lua"] = mixed, ["bad.lua"] = "error 'no'" }
    local result = folder:test "--format tap a.lua bad.lua"
    assert.equal(2, result.status)
    assert.equal([[
TAP version 13
ok 1 - a <test> \# 1 is true
not ok 2 - a <test> \# 1 is false
# 1 < 2 & "3"
# second line
ok 3 - a <test> \# 1 is to come # SKIP
not ok 4 - bad.lua
# bad.lua:1: no
1..4
]], (result.stdout:gsub("(\n# )a%.lua:%d+: ", "%1")))
  end)

  it("writes JUnit's XML with --format junit", function()
    local folder = new_folder { ["a.lua"] = mixed, ["good.lua"] = passing }
    local result = folder:test "--format junit a.lua good.lua"
    assert.equal(1, result.status)
    assert.equal([[
<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="rapid test" tests="4" failures="1" errors="0" skipped="1" time="T">
  <testsuite name="a.lua" tests="3" failures="1" errors="0" skipped="1" time="T">
    <testcase classname="a.lua" name="a &lt;test&gt; # 1 is true" time="T"/>
    <testcase classname="a.lua" name="a &lt;test&gt; # 1 is false" time="T">
      <failure message="1 &lt; 2 &amp; &quot;3&quot;">1 &lt; 2 &amp; &quot;3&quot;&#10;second line</failure>
    </testcase>
    <testcase classname="a.lua" name="a &lt;test&gt; # 1 is to come" time="T">
      <skipped/>
    </testcase>
  </testsuite>
  <testsuite name="good.lua" tests="1" failures="0" errors="0" skipped="0" time="T">
    <testcase classname="good.lua" name="one is true" time="T"/>
  </testsuite>
</testsuites>
]], (result.stdout:gsub('time="%d+%.%d%d%d"', 'time="T"'):gsub("a%.lua:%d+: ", "")))
    assert.equal(2, folder:test("--format html a.lua").status)
  end)

  it("ends with 2 where a file is not there, does not load, or holds no tests", function()
    local folder = new_folder {
      ["bad.lua"] = "describe(", ["raises.lua"] = "error 'no'", ["empty.lua"] = "", ["good.lua"] = passing,
      ["none/x.lua"] = "",
    }
    assert.equal(2, folder:test("missing.lua").status)
    assert.equal(2, folder:test("empty.lua").status)
    assert.equal(2, folder:test("none").status)
    for _, name in ipairs { "bad", "raises" } do
      local result = folder:test(name .. ".lua good.lua")
      assert.equal(2, result.status)
      assert.truthy(result.stdout:find("^BROKEN " .. name .. ".lua\n  " .. name .. ".lua:1: "), result.stdout)
      assert.truthy(result.stdout:find("\n1 passed, 0 failed, 0 skipped\n$"), result.stdout)
    end
  end)

  it("runs each file in a process of its own, and a test that ends it is one failure", function()
    local folder = new_folder {
      ["test_a.lua"] = [[
describe("a", function() it("comes first", function() end) end)
it("ends", function() os.exit(7) end)
it("comes after", function() end)]],
      ["test_b.lua"] = 'it("kills", function() os.execute("kill -9 $PPID") end)',
      ["test_c.lua"] = 'leaked = 1\n' .. passing,
      ["test_d.lua"] = 'it("sees nothing of others", function() assert.is_nil(rawget(_G, "leaked")) end)',
    }
    local result = folder:test "."
    assert.equal(1, result.status)
    assert.equal("FAILED ends\n  ./test_a.lua: the test ended the process with status 7\n" ..
      "FAILED kills\n  ./test_b.lua: the test ended the process with signal 9 (Killed)\n" ..
      "4 passed, 2 failed, 0 skipped\n", result.stdout)
  end)

  -- The first test ends only after the one of the last file has run, so neither waits if they run in parallel.
  local meeting = {
    ["t/test_a.lua"] = [[
local command = require "testing.command"
it("waits for the last file", function() assert.equal("last\n", command.shell("timeout 60 cat meeting").stdout) end)
it("comes second", function() end)]],
    ["t/test_b.lua"] = 'it("ends the process", function() os.exit(7) end) ' .. failing,
    ["t/test_c.lua"] = [[
local command = require "testing.command"
it("meets the first file", function()
  assert.equal(0, command.shell("timeout 60 sh -c 'echo last >meeting'").status)
end)]],
  }

  it("runs several files at the same time, and reports them in their order", function()
    local folder = new_folder(meeting)
    command.shell("mkfifo meeting", { cwd = folder.path })
    local result = folder:test "t --jobs 3 --verbose"
    assert.equal([[
passed waits for the last file
passed comes second
FAILED ends the process
  t/test_b.lua: the test ended the process with status 7
FAILED two is false
  t/test_b.lua:2: Expected objects to be the same.
passed two is true
passed meets the first file
4 passed, 2 failed, 0 skipped
]], (result.stdout:gsub("(to be the same%.\n).-\n(passed)", "%1%2")))
    assert.equal(1, result.status)
  end)

  it("prints what files print as if they ran one after another", function()
    local printing = [[
print "file"
it("one", function() print "one"; io.stderr:write "error one\n" end)
it("two", function() os.execute "echo program; echo error of a program >&2"; error("two", 0) end)
it("three", function() print "three"; os.exit(3) end)
it("four", function() io.write "no newline" end)]]
    local folder = new_folder { ["t/test_a.lua"] = printing, ["t/test_b.lua"] = failing, ["t/test_c.lua"] = printing }
    local by_one, at_once = folder:test "t --jobs 1", folder:test "t --jobs 3"
    assert.equal(by_one.stdout, at_once.stdout)
    assert.equal(by_one.stderr, at_once.stderr)
    assert.equal(1, at_once.status)
    local lines = "file\none\nprogram\nFAILED two\n.-three\nFAILED three\n.-file\nno newline"
    local pattern = "^" .. lines .. "FAILED two is false\n.-\n" .. lines .. "5 passed"
    assert.truthy(at_once.stdout:find(pattern), at_once.stdout)
  end)

  it("refuses an illegal number of jobs", function()
    local result = new_folder({ ["a.lua"] = passing }):test "a.lua --jobs 0"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find('--jobs = "0"; it must be a whole number, at least 1', 1, true), result.stderr)
  end)

  it("lists the slowest tests with their seconds", function()
    local folder = new_folder { ["a.lua"] = passing, ["b.lua"] = failing }
    local result = folder:test "a.lua b.lua --slowest 2"
    local first, second = result.stdout:match "\n(%d+%.%d%d%d) s: [^\n]+ %(%l%.lua%)\n(%d+%.%d%d%d) s: [^\n]+\n2 passed"
    assert.truthy(first, result.stdout)
    assert.is_true(tonumber(first) >= tonumber(second))
    assert.equal(2, select(2, result.stdout:gsub("%d s: ", "")))
    assert.equal("--slowest needs --format text, not tap\n",
      folder:test("a.lua --slowest 2 --format tap").stderr)
  end)

  it("leaves nothing running when it is killed", function()
    local folder = new_folder { ["t.lua"] = [[
local command = require "testing.command"
it("sleeps", function() command.shell("echo $PPID $$ >ids; exec sleep 1000") end)]] }
    local result = command.shell(await .. [[
"$RAPID" test t.lua &
await $! test -s ids || exit 1
kill -9 $!
# A process that has ended may wait for its new parent to notice.
runs() { grep -sq '^State:.[^ZX]' /proc/$1/status; }
read -r child shell <ids
for try in $(seq 500); do runs $child || runs $shell || exit 0; sleep 0.01; done
echo "still there: $child $shell"
]], { cwd = folder.path })
    assert.equal("", result.stdout)
    assert.equal(0, result.status)
  end)

  it("counts what fails around tests", function()
    local folder = new_folder { ["a.lua"] = [[
describe("x", function()
  before_each(function() error "early" end)
  it("y", function() end)
end)]] }
    local result = folder:test "a.lua"
    assert.equal(1, result.status)
    assert.truthy(result.stdout:find("early", 1, true))
    assert.truthy(result.stdout:find("\n0 passed, 1 failed, 0 skipped\n$"), result.stdout)
  end)
end)

describe("a test", function()
  -- Runs the body of a test next to the scene.
  local function test(body)
    local folder = new_folder { ["scene.lua"] = scene, ["t.lua"] = 'it("holds", function()\n' .. body .. "\nend)\n" }
    return folder:test "t.lua"
  end
  local function holds(body)
    local result = test(body)
    assert.equal("1 passed, 0 failed, 0 skipped\n", result.stdout)
    assert.equal(0, result.status)
  end
  local function fails(body, message)
    local result = test(body)
    assert.equal(1, result.status)
    assert.truthy(result.stdout:find(message, 1, true), result.stdout)
  end

  it("sees the points of each frame", function()
    holds [[
      local result = rapid.run("scene.lua", { frames = {1, 25}, set = { up = 0.5 } })
      local p = result[25]
      assert.equal(2, #p)
      assert.equal(1, p[1].P.y - 0.5 * 24 * 25 / 2 / 24)
      assert.equal(4, p:by_id(1).heat)
      assert.is_nil(p:by_id(2))
      assert.is_nil(p[3])
      local frames = 0
      for frame, points in result:frames() do
        frames = frames + 1
        assert.equal(frames, frame)
        assert.equal(2, #points)
      end
      assert.equal(25, frames)]]
  end)

  it("sees extremes, means, groups and names", function()
    holds [[
      local p = rapid.run("scene.lua", { frames = {2, 2} })[2]
      assert.equal(1, p:min("P").y)
      assert.equal(3, p:max("P").y)
      assert.equal(0.5, p:mean("P").x)
      assert.equal(3, p:mean "heat")
      assert.same({ "P", "heat", "id", "v" }, p:names())
      assert.same({ "second" }, p:groups())
      assert.equal(1, #p:group "second")
      assert.equal(1, p:group("second")[1].id)
      assert.is_true(p[2]:within "second")
      assert.is_false(p[1]:within "second")
      assert.equal(math.huge, rapid.run("scene.lua", { frames = {1, 1} })[1]:group("second"):min("P").y)]]
  end)

  it("sees every output by name", function()
    holds [[
      local result = rapid.run("scene.lua", { frames = {1, 2} })
      assert.same({ "main", "other" }, result.outputs)
      assert.equal(7, result:output("other")[2][1].P.y)
      assert.has_error(function() result:output "smoke" end, 'the scene has no output "smoke"; it has main, other')]]
  end)

  it("receives the message of a scene's error", function()
    holds [[
      assert.has_error(function() rapid.run("no.lua", { frames = {1, 2} }) end)
      local ok, message = pcall(rapid.run, "scene.lua", { frames = {1, 2}, set = { upp = 1 } })
      assert.is_false(ok)
      assert.truthy(message:find('did you mean "up"?', 1, true))]]
  end)

  it("reports wrong options", function()
    fails('rapid.run("scene.lua", { frame = {1, 2} })', 'rapid.run: unknown option "frame"')
    fails('rapid.run("scene.lua", {})', "rapid.run: frames is missing")
    fails('rapid.run("scene.lua", { frames = {2, 1} })', "ends before it begins")
    fails('rapid.run("scene.lua", { frames = {0, 1} })', "frames: 0 is before the scene's first frame, 1")
    fails('local _ = rapid.run("scene.lua", { frames = {1, 2} })[3]', "frame 3 was not run; frames 1 to 2 were")
    fails('local _ = rapid.run("scene.lua", { frames = {1, 2} })[2][1].haet',
      'frame 2, output main has no attribute "haet"; did you mean "heat"?')
  end)

  it("asserts on points, and a failure names frame, point and value", function()
    holds [[
      local a = rapid.run("scene.lua", { frames = {1, 3} })
      assert.points(a[3]).finite()
      assert.points(a[3]).outside(function(P) return P.y end)
      assert.points(a[3]).inside(function(P) return P.y - 4 end)
      assert.same_points(a[3], rapid.run("scene.lua", { frames = {3, 3}, threads = 2 })[3])
      assert.near(1, a[3]:min("P").y, 0)]]
    fails('assert.points(rapid.run("scene.lua", { frames = {1, 3} })[3]).inside(function(P) return P.y - 2 end)',
      "frame 3, output main, point 2 (id 1): vec3(1, 3, 0) is 1 m outside")
    fails([[
      local run = rapid.run
      local faster = run("scene.lua", { frames = {1, 3}, set = { up = 24 } })
      assert.same_points(run("scene.lua", { frames = {1, 3} })[3], faster[3])]],
      "frame 3, output main, point 1 (id 0): P is {0, 1, 0} and {0, 4, 0}")
  end)

  it("asserts that a sum over the points is conserved, and names the frame, the sums and the point", function()
    holds [[
      local a = rapid.run("scene.lua", { frames = {1, 3} })
      assert.conserved(a, function(p) return p.heat end, 0)
      assert.conserved(a, function(p) return p.P end, 0)]]
    fails([[
      local a = rapid.run("scene.lua", { frames = {1, 3}, set = { up = 24 } })
      assert.conserved(a, function(p) return p.heat + (p.id == 1 and p.P.y or 0) end, 1.5)]],
      "frame 3: the sum is 12, and 9 in the first frame; the difference is 3; the largest change has point 2 (id " ..
        "1): 10, and 7 before")
    fails('assert.conserved(rapid.run("scene.lua", { frames = {1, 2} }), 1)',
      "assert.conserved needs the result of rapid.run, a function of a point and a tolerance")
  end)

  it("fails as docs/lua-api.md shows it", function()
    local folder = new_folder { ["test_sparks.lua"] = ([[
describe("sparks", function()
  it("never enter the floor", function()
    local result = rapid.run(%q, { frames = {1, 48}, set = { rate = 1000 } })
    assert.points(result[48]).outside(function(P) return P.y - 0.05 end)
  end)
end)
]]):format(io.popen("pwd"):read "*l" .. "/graphs/sparks.lua") }
    local shown = folder:test("test_sparks.lua").stdout:gsub("([^\n]+\n)", "    %1")
    local page = io.open("docs/lua-api.md"):read "*a"
    assert.truthy(page:find(shown:gsub("\n$", ""), 1, true), shown)
  end)

  it("finds NaN near nothing", function()
    fails("assert.near(0, 0 / 0, 1e9)", "is not within 1e+09 of 0")
    fails("assert.near(1, 1.5, 0.25)", "t.lua:2: 1.5 is not within 0.25 of 1; the difference is 0.5")
    holds 'local vec3 = require("vec3").make; assert.near(vec3(0, 3, 4), vec3(0, 0, 0), 5)'
  end)

  it("of a script that does not end is one failure", function()
    local folder = new_folder {
      ["spin.lua"] = "while true do end",
      ["t.lua"] = [[
it("spins", function() rapid.run("spin.lua", { frames = {1, 2}, script_timeout = 0.3 }) end)
it("comes after", function() end)]],
      ["u.lua"] = passing,
    }
    local result = folder:test "t.lua u.lua"
    assert.equal(1, result.status)
    assert.truthy(result.stderr:find("--script-timeout", 1, true), result.stderr)
    assert.truthy(result.stdout:find("FAILED spins\n", 1, true), result.stdout)
    assert.truthy(result.stdout:find("\n2 passed, 1 failed, 0 skipped\n$"), result.stdout)
  end)
end)
