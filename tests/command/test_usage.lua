-- The command's help, and how it reads its arguments.
local command = require "testing.command"
local rapid = command.rapid

local scene = [[
local rapid = require "rapid"
local count = rapid.param("count", 3, "points along an edge")
return rapid.create { points = rapid.points.grid { size = {count, 1, 1}, spacing = 1 } } :gravity {} :solve {}
]]

describe("rapid", function()
  it("alone prints its commands", function()
    local result = rapid ""
    assert.equal(0, result.status)
    for _, name in ipairs { "run", "check", "nodes", "info", "diff", "test" } do
      assert.truthy(result.stdout:find("\n  " .. name .. " ", 1, true), name)
    end
    assert.equal("", result.stderr)
  end)

  it("prints its version, and the help of each command", function()
    local version = rapid "--version"
    assert.equal(0, version.status)
    assert.truthy(version.stdout:match "^rapid %d+%.%d+%.%d+\n$")
    assert.equal(0, rapid("--help").status)
    local help = rapid "run --help"
    assert.equal(0, help.status)
    for _, option in ipairs { "--frames", "--output", "--set", "--seed", "--threads", "--stats", "--script-timeout",
      "--script-memory", "--quiet", "--verbose", "--camera", "--size" } do
      assert.truthy(help.stdout:find(option, 1, true), option)
    end
  end)

  it("knows what an unknown command was meant to be", function()
    local result = rapid "rnu scene.lua"
    assert.equal(2, result.status)
    assert.equal('rapid: unknown command "rnu"; did you mean "run"?\n', result.stderr)
  end)

  it("says how a graph that stands alone is run", function()
    local result = rapid "scene.lua"
    assert.equal(2, result.status)
    assert.equal(("rapid: no command; to run the scene, type: %s run scene.lua\n"):format(command.binary()),
      result.stderr)
    local by_name = command.shell([[PATH="$(dirname "$RAPID"):$PATH" rapid scene.lua]])
    assert.equal("rapid: no command; to run the scene, type: rapid run scene.lua\n", by_name.stderr)
  end)

  it("says how a list is given to --set, which the shell splits without quotes", function()
    assert.equal('rapid run: unexpected argument "tint=0.2"; the shell has split a list, so put it in quotes: '
      .. "--set 'tint={...}'\n", rapid("run scene.lua --set tint=0.1 tint=0.2 tint=0.9").stderr)
    assert.equal('rapid run: unexpected argument "rate=5"; to set a value, type: --set rate=5\n',
      rapid("run scene.lua rate=5").stderr)
  end)

  it("knows what an unknown option was meant to be", function()
    local result = rapid "run scene.lua --thraeds 2"
    assert.equal(2, result.status)
    assert.equal('rapid run: unknown option "--thraeds"; did you mean "--threads"?\n', result.stderr)
  end)

  it("misses a graph that is not named", function()
    local result = rapid "run -f 1-4"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("rapid run: GRAPH is required", 1, true), result.stderr)
  end)

  it("refuses values of options that are none, and says what would be right", function()
    local frames = "; it must be a frame (12), a range (1-48), or a range and a step (1-48x2)"
    for arguments, message in pairs {
      ["-f 1..4"] = "-f 1..4: a - is missing" .. frames,
      ["-f 5-3"] = "-f 5-3: it ends before it begins" .. frames,
      ["-f 1-4x0"] = "-f 1-4x0: the step must be at least 1" .. frames,
      ["--seed -1"] = '--seed = "-1"; it must be a whole number from 0 to 2^64 - 1',
      ["--threads many"] = '--threads = "many"; it must be a whole number, at least 0',
      ["--script-timeout 0"] = '--script-timeout = "0"; it must be a number above 0',
      ["--script-memory 1T"] = '--script-memory = "1T"; it must be a number of bytes above 0, such as 1073741824, ' ..
        '512M or 1G',
      ["--set count"] = '--set "count"; it must be NAME=VALUE',
      ["--cache ''"] = '--cache = ""; it must be the name of a folder',
      ["--stats ''"] = '--stats = ""; it must be the name of a file',
      ["--size 1280"] = '--size = "1280"; it must be WIDTHxHEIGHT, each from 1 to 16384',
    } do
      local result = rapid("run scene.lua " .. arguments)
      assert.equal(2, result.status)
      assert.equal("rapid run: " .. message .. "\n", result.stderr)
    end
  end)
end)

describe("the order of options", function()
  it("never matters", function()
    local folder = command.folder()
    folder:write("scene.lua", scene)
    for i, arguments in ipairs {
      "run scene.lua -f 3 -o a#.csv --set count=2 --threads 1 --quiet",
      "--quiet --threads 1 -f 3 run --set count=2 -o b#.csv scene.lua",
      "-o c#.csv --set count=2 -f 3 --threads=1 run --quiet scene.lua",
      "run --set=count=2 -f3 scene.lua --threads 1 -od#.csv --quiet",
    } do
      local result = rapid(arguments, { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      assert.equal(folder:read "a0003.csv", folder:read(("abcd"):sub(i, i) .. "0003.csv"))
    end
    assert.truthy(folder:read "a0003.csv")
  end)

  it("lets a value be called like a command", function()
    local folder = command.folder()
    folder:write("check", scene)
    assert.equal(0, rapid("--stats test -f 1 -o a.csv run ./check", { cwd = folder.path }).status)
    assert.same({ "a.csv", "check", "test" }, folder:list())
  end)
end)

describe("standard output", function()
  it("that nobody reads any more is no failure", function()
    local result = command.shell '"$RAPID" nodes | true; "$RAPID" nodes --json | head -c 1'
    assert.equal(0, result.status)
    assert.equal("[", result.stdout)
    assert.equal("", result.stderr)
  end)

  it("that can't be written is one", function()
    local result = rapid "nodes >/dev/full"
    assert.equal(1, result.status)
    assert.equal("standard output can't be written: No space left on device\n", result.stderr)
  end)
end)

describe("a command that is a program of its own", function()
  it("is listed with the others, in order of name", function()
    local names = {}
    local list = rapid("--help").stdout:match "\nSubcommands:\n(.*)"
    for line in list:gmatch "[^\n]+" do names[#names + 1] = line:match "^  (%l+)" end
    local sorted = { unpack(names) }
    table.sort(sorted)
    assert.same(sorted, names)
    local listed = " " .. table.concat(names, " ") .. " "
    for _, name in ipairs { "run", "study", "view", "wedge" } do
      assert.truthy(listed:find(" " .. name .. " ", 1, true), name)
    end
  end)

  it("gets all arguments, and options may stand before its name", function()
    local result = rapid "--threads 2 wedge --set nonsense nothing.lua"
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("rapid wedge: ", 1, true), result.stderr)
    local misspelt = rapid("study some.lua --jsno").stderr
    assert.equal('rapid study: unknown option "--jsno"; did you mean "--json"?\n', misspelt)
    assert.equal(0, rapid("view --help").status)
  end)

  it("knows no other command", function()
    local result = command.shell '"${RAPID%/bin/rapid}/libexec/rapid/view" run scene.lua'
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find('unknown command "run"', 1, true), result.stderr)
  end)

  it("has the command, not itself, do what others do for it", function()
    local folder = command.folder()
    folder:write("scene.lua", scene)
    local reported = rapid("wedge scene.lua --vary count=2,3 --farm slurm --dry-run", { cwd = folder.path }).stdout
    assert.truthy(reported:find("/rapid run ", 1, true), reported)
    assert.truthy(reported:find("/rapid wedge ", 1, true), reported)
    assert.is_nil(reported:find("libexec", 1, true), reported)
  end)

  it("that is not there is named, with its place", function()
    local folder = command.folder()
    local line = 'mkdir bin && cp "$RAPID" bin/rapid && bin/rapid view scene.lua'
    local result = command.shell(line, { cwd = folder.path })
    assert.equal(2, result.status)
    local place = folder.path .. "/libexec/rapid/view can't be started (No such file or directory)"
    assert.truthy(result.stderr:find(place, 1, true), result.stderr)
  end)
end)
