-- Foreign records, which merge, wedge, farm and --cache find in folders: whatever their contents, they are read or
-- refused, at once and in a few lines.
local address_space = require "tests.address_space"
local command = require "testing.command"

local longest_message = 10000

-- Runs a shell command; `complaint` describes a wrong ending.
local function ended(folder, line, environment)
  local result = command.shell(address_space(4194304) .. " ulimit -t 10; timeout -k 1 60 " .. line,
    { cwd = folder.path, environment = environment })
  if result.status > 2 then
    result.complaint = "ended with " .. result.status
  elseif result.status > 0 and (#result.stderr + #result.stdout == 0 or #result.stderr > longest_message) then
    result.complaint = ("said %d bytes"):format(#result.stderr)
  elseif result.stderr:find "[%z\1-\8\11-\31\127]" then
    result.complaint = "said control characters"
  end
  return result
end

local function record(changes)
  local fields = { rapid_part = "2", part = "1", parts = "1", sample = "null",
    frames = '{"first": 1, "last": 1, "step": 1}', fps = "24", start = "1", identity = "{}",
    files = '[{"frame": 1, "points": 1, "hash": "4706843b3f6f2b3c"}]' }
  for name, value in pairs(changes) do fields[name] = value end
  local list = {}
  for name, value in pairs(fields) do list[#list + 1] = ('"%s": %s'):format(name, value) end
  return "{" .. table.concat(list, ", ") .. "}"
end

-- Contents that are no kind of record.
local nonsense = {
  "", "{", "null", "[]", '"' .. ("x"):rep(1000000), ("x"):rep(1000000), ("["):rep(1000000), "\27[2J",
  '{"rapid_part": ' .. ("["):rep(200000) .. ("]"):rep(200000) .. "}",
  '{"rapid_farm": ' .. ("["):rep(200000) .. ("]"):rep(200000) .. "}", '{"rapid_part": 2, "rapid_farm": 1}',
}

describe("the record of a part", function()
  local function merge(text, points)
    local folder = command.folder()
    folder:write("a_part1of1.csv.json", text)
    folder:write("a_part1of1.0001.csv", points or "id,Px,Py,Pz\n0,1,2,3\n")
    local result = ended(folder, '"$RAPID" merge -o whole.####.csv "a_part{part}.####.csv" --quiet')
    result.whole = folder:read "whole.0001.csv"
    return result
  end

  it("is read where it is one", function()
    local result = merge(record {})
    assert.equal("", result.stderr)
    assert.equal("id,Px,Py,Pz,vx,vy,vz\n0,1,2,3,0,0,0\n", result.whole)
  end)

  it("is an error that names it where it is none", function()
    for _, text in ipairs(nonsense) do
      local result = merge(text)
      assert.is_nil(result.complaint, text:sub(1, 40) .. ": " .. (result.complaint or ""))
      assert.equal(2, result.status, text:sub(1, 40))
      assert.match("^a_part1of1.csv.json: is not the record of a part", result.stderr)
    end
  end)

  it("promises no more parts and frames than there can be, and what is missing is told in short", function()
    for _, changes in ipairs {
      { parts = "2147483647" }, { parts = "1e300" }, { parts = "100001" }, { parts = "100000" }, { part = "0" },
      { part = "-1" }, { part = '"1"' }, { frames = '{"first": 1, "last": 9223372036854775807, "step": 1}' },
      { frames = '{"first": -9223372036854775808, "last": 9223372036854775807, "step": 9223372036854775807}' },
      { frames = '{"first": -2147483648, "last": 2147483647, "step": 1}' },
      { frames = '{"first": 1, "last": 2147483647, "step": 2}' }, { frames = '{"first": 1, "last": 0, "step": 1}' },
      { frames = '{"first": 1, "last": 3, "step": 0}' }, { fps = "0" }, { fps = "-1" }, { fps = "1e999" },
      { sample = '"all"' }, { files = "{}" }, { files = "[1]" }, { files = "[{}]" },
      { files = '[{"frame": 1, "points": -1, "hash": ""}]' }, { files = '[{"frame": 1e300, "points": 1, "hash": ""}]' },
      { identity = '{"a": {}}' }, { start = "{}" },
    } do
      local text = record(changes)
      local result = merge(text)
      assert.is_nil(result.complaint, text .. ": " .. (result.complaint or ""))
      assert.equal(2, result.status, text .. result.stderr)
    end
  end)

  it("is one of points with any ids", function()
    local least, most = "-9223372036854775808", "9223372036854775807"
    local files = '[{"frame": 1, "points": 2, "hash": "a11992f57f2ee215"}]'
    local result = merge(record { files = files }, ("id,Px,Py,Pz\n%s,1,2,3\n%s,4,5,6\n"):format(least, most))
    assert.equal("", result.stderr)
    assert.equal(("id,Px,Py,Pz,vx,vy,vz\n%s,1,2,3,0,0,0\n%s,4,5,6,0,0,0\n"):format(least, most), result.whole)
  end)
end)

describe("FARM.json", function()
  -- Replaces Slurm's programs by ones that know no job.
  local function folder_with(text)
    local folder = command.folder()
    command.shell('mkdir bin out out/FARM && for name in sbatch squeue scancel; do ' ..
      'printf "#!/bin/sh\\n" >bin/$name; chmod +x bin/$name; done', { cwd = folder.path })
    folder:write("out/FARM.json", text)
    return folder
  end
  local function farm(folder, action)
    return ended(folder, 'env PATH="$PWD/bin:$PATH" "$RAPID" farm ' .. action .. " out/FARM.json")
  end
  local function job(changes, folder)
    return ([[{"rapid_farm": 1, "name": "a", "folder": ".", "outputs": "%s/out", "options": [], "command": [],
      "tasks": [{"name": "one", "command": [], "job": 0}], "last": {"commands": [], "needs_all": true, "job": 0}%s}]])
      :format(folder, changes)
  end

  it("is an error that names it where it is none", function()
    for _, text in ipairs(nonsense) do
      local result = farm(folder_with(text), "status")
      assert.is_nil(result.complaint, text:sub(1, 40) .. ": " .. (result.complaint or ""))
      assert.equal(2, result.status, text:sub(1, 40))
      assert.match("^out/FARM.json: is not a FARM.json", result.stderr)
    end
  end)

  it("is printed without terminal commands, and its tasks are not waited for", function()
    local folder = folder_with ""
    folder:write("out/FARM.json", job(', "name": "\\u001b[2J"', folder.path))
    command.shell("mkfifo out/FARM/1.status", { cwd = folder.path })
    local result = farm(folder, "status")
    assert.is_nil(result.complaint)
    assert.equal("\\x1b[2J: 1 tasks: 1 lost\none: lost, " .. folder.path .. "/out/FARM/1.log\n", result.stdout)
  end)
end)

describe("the script of a job", function()
  it("has no lines that a name has brought", function()
    local folder = command.folder()
    local scene = 'local rapid = require "rapid" local n = rapid.param("n", "x") return rapid.create {} :solve {}'
    folder:write("a\ntouch seen\n.lua", scene)
    folder:write("scene.lua", scene)
    local named = ended(folder, '"$RAPID" wedge "a\ntouch seen\n.lua" --vary n=1,2 -f 1 --farm slurm --dry-run')
    assert.equal(2, named.status, named.stderr)
    assert.match("^%-%-farm: the name of the job .* has a control character", named.stderr)
    local valued = ended(folder, '"$RAPID" wedge scene.lua --vary "n=1,2\ntouch seen" -f 1 --farm slurm --dry-run')
    assert.equal("", valued.stderr)
    folder:write("script", valued.stdout:match "^#[^\n]*\n(.*)$")
    command.shell("SLURM_ARRAY_TASK_ID=0 sh script", { cwd = folder.path })
    assert.is_nil(folder:read "seen")
  end)
end)

describe("a wedge", function()
  it("of more rows than anybody waits for is refused", function()
    local folder = command.folder()
    folder:write("scene.lua", 'local rapid = require "rapid" return rapid.create {} :solve {}')
    local ten = " --vary solve.substeps=1,2,3,4,5,6,7,8,9,10"
    local result = ended(folder, '"$RAPID" wedge scene.lua -f 1' .. ten:gsub("solve", "a") .. ten:gsub("solve", "b") ..
      ten:gsub("solve", "c") .. ten:gsub("solve", "d") .. ten:gsub("solve", "e") .. ten)
    assert.equal(2, result.status)
    assert.equal("--vary: there are more than 100000 combinations; give fewer values\n", result.stderr)
  end)
end)

describe("the statistics of a wedge's rows", function()
  it("are neither waited for nor believed: the row has failed", function()
    local folder = command.folder()
    folder:write("scene.lua", 'local rapid = require "rapid" return rapid.create {} :solve {}')
    command.shell("mkdir farm", { cwd = folder.path })
    for _, text in ipairs(nonsense) do
      folder:write("farm/2.json", text)
      folder:write("farm/1.status", "0")
      folder:write("farm/2.status", "0")
      command.shell("rm -f farm/1.json; mkfifo farm/1.json", { cwd = folder.path })
      local result = ended(folder, '"$RAPID" wedge scene.lua --vary solve.substeps=1,2 -f 1 --collect farm')
      assert.is_nil(result.complaint, text:sub(1, 40) .. ": " .. (result.complaint or ""))
    end
    folder:write("farm/2.json", '{"seconds": 1, "peak_bytes": 1, "frames": [{"frame": "one"}]}')
    local result = ended(folder, '"$RAPID" wedge scene.lua --vary solve.substeps=1,2 -f 1 --collect farm')
    assert.equal(1, result.status)
    assert.match("failed: farm/2.json: does not contain the statistics of a run", result.stderr)
  end)
end)

describe("the folder of a cache", function()
  local scene = 'local rapid = require "rapid" ' ..
    "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :gravity {} :solve {}"
  local function go_on(line)
    local folder = command.folder()
    folder:write("scene.lua", scene)
    folder:write("victim", "precious")
    assert.equal(0, ended(folder, '"$RAPID" run scene.lua -f 1-12 --quiet --cache cache').status)
    command.shell("cd cache && " .. line, { cwd = folder.path })
    local result = ended(folder, '"$RAPID" run scene.lua -f 1-14 --quiet --cache cache --memory 1G')
    assert.is_nil(result.complaint, line .. ": " .. (result.complaint or ""))
    assert.equal("precious", folder:read "victim", line)
    assert.is_nil(folder:read "seen", line)
    return result
  end

  it("makes and changes nothing elsewhere, and is not waited for", function()
    for _, name in ipairs { ".lock", "journal", "snapshot.0010.rapid", "snapshot.0012.rapid" } do
      for _, line in ipairs { "mkfifo %s", "ln -s /dev/zero %s", "ln -s ../seen %s", "ln -s ../victim %s", "mkdir %s",
        "head -c 100000 /dev/urandom >%s", "truncate -s 300G %s" } do
        go_on(("rm -f %s; " .. line):format(name, name))
      end
    end
  end)

  it("is an error that names what is wrong with it", function()
    assert.match("^%-%-cache cache: its .lock is a link", go_on("rm .lock; ln -s ../seen .lock").stderr)
    assert.match("^cache/journal: can't be read: it is not a regular file", go_on("rm journal; mkfifo journal").stderr)
    assert.match("^cache/journal: the whole file would need about 300%.0 GiB, but only %d+ MiB of 1%.0 GiB are free; "
      .. "read a smaller file, or set %-%-memory\n$", go_on("truncate -s 300G journal").stderr)
  end)
end)

describe("the folder of a view's cache", function()
  it("makes and changes nothing elsewhere", function()
    local folder = command.folder()
    folder:write("scene.lua", 'local rapid = require "rapid" ' ..
      "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :solve {}")
    folder:write("victim", "precious")
    local view = '"$RAPID" view scene.lua -f 1-3 --no-open --cache cache'
    command.shell("timeout 60 " .. view .. " >said 2>&1 & " ..
      "until [ -e cache/view/*/journal ]; do kill -0 $! || exit 1; sleep 0.02; done; kill $!; wait $!; exit 0",
      { cwd = folder.path })
    command.shell("cd cache/view/*/ && rm journal && ln -s ../../../victim journal", { cwd = folder.path })
    command.shell("timeout 4 " .. view .. " >said 2>&1", { cwd = folder.path })
    assert.equal("precious", folder:read "victim")
    command.shell("cd cache/view && rm -f .lock && ln -s ../../seen .lock", { cwd = folder.path })
    local result = ended(folder, view)
    assert.equal(2, result.status)
    assert.match("^%-%-cache cache: its .lock is a link", result.stderr)
    assert.is_nil(folder:read "seen")
  end)
end)
