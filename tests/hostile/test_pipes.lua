-- Files that are not regular, next to a scene or instead of it: Rapid neither blocks on them nor reads them endlessly.
local command = require "testing.command"

local function folder_with(text)
  local folder = command.folder()
  folder:write("scene.lua", 'local rapid = require "rapid"\n' .. text)
  command.shell([[
mkdir out
for name in pipe.lua pipe.csv pipe.ply pipe.bgeo pipe.vdb pipe.obj out/a.0001.csv out/.rapid-0123456789abcdef.unfinished
do mkfifo $name; done
for name in zero.lua zero.csv zero.vdb zero.obj; do ln -s /dev/zero $name; done
truncate -s 100G hole.lua]], { cwd = folder.path })
  return folder
end

local function run(text, arguments)
  return command.shell('timeout -k 1 60 "$RAPID" run scene.lua -f 1 --quiet ' .. (arguments or ""),
    { cwd = folder_with(text).path })
end

local nothing = "return rapid.create {} :solve {}"

describe("a pipe or a device", function()
  it("is no module and no node", function()
    for text, message in pairs {
      ["require 'pipe'"] = 'no module "pipe"; looked for pipe.lua', ["require 'zero'"] = 'no module "zero"',
      ["return rapid.create {} :pipe {}"] = 'unknown node "pipe"',
      ["require 'hole'"] = "the file has more than 64 MiB, too much for a scene or a module",
    } do
      local result = run(text)
      assert.equal(2, result.status, text)
      assert.truthy(result.stderr:find(message, 1, true), result.stderr)
    end
  end)

  it("is read by no reader", function()
    for _, call in ipairs { "points.read 'pipe.csv'", "points.read 'pipe.ply'", "points.read 'pipe.bgeo'",
      "points.read 'pipe.vdb'", "mesh.read 'pipe.obj'", "mesh.read 'pipe.ply'", "levelset.read 'pipe.vdb'",
      "grid.read 'pipe.vdb'", "points.read 'zero.csv'", "mesh.read 'zero.obj'", "levelset.read 'zero.vdb'" } do
      local result = run("rapid." .. call .. " " .. nothing)
      assert.equal(2, result.status, call)
      assert.match("^scene.lua:2: rapid.[%w.]+: .*can't be read: it is not a regular file", result.stderr)
    end
  end)

  it("is no plugin and no test", function()
    local folder = folder_with(nothing)
    command.shell("mkdir plugins tests; mkfifo pipe.so plugins/pipe.so test_pipe.lua tests/test_pipe.lua; " ..
      "ln -s /dev/zero zero.so; ln -s /dev/zero test_zero.lua", { cwd = folder.path })
    for words, message in pairs {
      ['"$RAPID" nodes --plugin pipe.so'] = "pipe.so: the plugin can't be read: it is not a regular file",
      ['"$RAPID" nodes --plugin zero.so'] = "zero.so: the plugin can't be read: it is not a regular file",
      ['RAPID_PLUGIN_PATH=plugins "$RAPID" nodes'] = "plugins/pipe.so: the plugin can't be read: it is not a regular",
      ['"$RAPID" test test_pipe.lua'] = "test_pipe.lua: is not a regular file",
      ['"$RAPID" test test_zero.lua'] = "test_zero.lua: is not a regular file",
      ['"$RAPID" test tests'] = "tests: no tests in this folder",
    } do
      local result = command.shell("timeout -k 1 60 env " .. words, { cwd = folder.path })
      assert.equal(2, result.status, words .. ": " .. result.stderr)
      assert.equal(1, result.stderr:find(message, 1, true), result.stderr)
    end
  end)

  it("is neither written nor waited for in the place of a frame or of an unfinished one", function()
    local result = run(nothing, "-o out/a.####.csv")
    assert.equal(1, result.status)
    assert.equal("out/a.0001.csv: can't be written: it is not a regular file\n", result.stderr)
    assert.equal(0, run(nothing, "-o out/b.####.csv").status)
  end)

  it("is a scene as far as 64 MiB", function()
    local folder = folder_with(nothing)
    local endless = command.shell('timeout -k 1 60 "$RAPID" run zero.lua', { cwd = folder.path })
    assert.equal(2, endless.status)
    assert.equal("zero.lua: the file has more than 64 MiB, too much for a scene or a module\n", endless.stderr)
    local piped = command.shell('cat scene.lua | "$RAPID" run /dev/stdin -f 1 --quiet', { cwd = folder.path })
    assert.equal("", piped.stderr)
    assert.equal(0, piped.status)
  end)
end)
