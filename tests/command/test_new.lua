-- rapid new: its files run, pass and are well-formed, and it never overwrites a file.
local command = require "testing.command"

describe("rapid new", function()
  it("makes a scene that runs and a test that passes", function()
    local folder = command.folder()
    local made = command.rapid("new rain", { cwd = folder.path })
    assert.equal(0, made.status)
    local rapid = command.binary() -- the path by which it is called, as the user may have no other
    assert.equal("made rain.lua\nmade test_rain.lua\nmade .luacheckrc\nmade .luarc.json\n" ..
      ("now: %s run rain.lua -f 1-96 -o rain.####.png\n     %s test test_rain.lua\n"):format(rapid, rapid), made.stdout)
    assert.same({ ".luacheckrc", ".luarc.json", "rain.lua", "test_rain.lua" }, folder:list())
    assert.is_nil(folder:read("rain.lua"):find("NAME", 1, true))

    assert.equal(0, command.rapid("run rain.lua -f 1-3 --quiet", { cwd = folder.path }).status)
    local tested = command.rapid("test test_rain.lua", { cwd = folder.path })
    assert.equal("2 passed, 0 failed, 0 skipped\n", tested.stdout)
    assert.equal(0, tested.status)
    local checked = command.shell("luacheck --quiet --no-color .", { cwd = folder.path })
    assert.equal("Total: 0 warnings / 0 errors in 2 files\n", checked.stdout)
  end)

  it("never overwrites: with either file there it makes neither", function()
    for _, name in ipairs { "rain.lua", "test_rain.lua" } do
      local folder = command.folder()
      folder:write(name, "mine")
      local result = command.rapid("new rain", { cwd = folder.path })
      assert.equal(2, result.status)
      assert.equal(name .. ": exists already and is not changed; choose another name\n", result.stderr)
      assert.same({ name }, folder:list())
      assert.equal("mine", folder:read(name))
    end
  end)

  it("leaves the folder's own settings alone", function()
    local folder = command.folder()
    folder:write(".luacheckrc", "mine")
    assert.equal(0, command.rapid("new snow", { cwd = folder.path }).status)
    assert.equal("mine", folder:read ".luacheckrc")
  end)

  it("refuses an illegal name, and the name of a node", function()
    local folder = command.folder()
    for name, expected in pairs {
      ["../rain"] = 'rapid new: "../rain" can\'t be the name of a scene; it must consist of letters, digits, _ and ' ..
        '-, ' ..
        "and begin with a letter or _\n",
      ["swirl"] = 'rapid new: "swirl" is the name of a node, and swirl.lua would hide it from the scenes in this ' ..
        "folder; choose another name\n",
    } do
      local result = command.rapid("new " .. name, { cwd = folder.path })
      assert.equal(2, result.status)
      assert.equal(expected, result.stderr)
    end
    assert.same({}, folder:list())
  end)
end)
