-- rapid.param: values that the command line replaces.
local scene = require "testing.scene"

-- Returns the parameter's value in a scene, as text.
local function value(default, setting, before)
  local message = scene.error(("%s error(tostring(rapid.param('x', %s)), 0)"):format(before or "", default),
    { set = { x = setting } })
  return (message:gsub("^scene%.lua:%d+: ", ""))
end

describe("rapid.param", function()
  it("is its default where nothing is set", function()
    for default, expected in pairs {
      ["5"] = "5", ["0.25"] = "0.25", ["true"] = "true", ["false"] = "false", ["'soft'"] = "soft", ["''"] = "",
      ["vec3(1, 2, 3)"] = "vec3(1, 2, 3)", ["{1, 2, 3}"] = "vec3(1, 2, 3)",
    } do
      assert.equal(expected, value(default), default)
    end
  end)

  it("is what --set says, of its default's type", function()
    for _, case in ipairs {
      { "5", "7", "7" }, { "5", "-2.5e-3", "-0.0025" }, { "5", "inf", "inf" }, { "5", " 7", "7" },
      { "true", "false", "false" }, { "false", "1", "true" }, { "true", "0", "false" },
      { "'soft'", "hard", "hard" }, { "'soft'", "5", "5" }, { "'soft'", "", "" }, { "'soft'", "a = b", "a = b" },
      { "vec3(0, 0, 0)", "1,2,3", "vec3(1, 2, 3)" }, { "{0, 0, 0}", "{1, -2, 0.5}", "vec3(1, -2, 0.5)" },
    } do
      assert.equal(case[3], value(case[1], case[2]), case[1] .. " set to " .. case[2])
    end
  end)

  it("keeps its type: a setting is text or a number as the default is", function()
    scene.run("assert(rapid.param('x', 'soft') == '5') return rapid.create {}", { set = { x = 5 }, frames = {1, 1} })
    scene.run("assert(rapid.param('x', 1) == 0.1) return rapid.create {}", { set = { x = 0.1 }, frames = {1, 1} })
    scene.run("assert(rapid.param('x', false) == true) return rapid.create {}", { set = { x = true }, frames = {1, 1} })
    scene.run("assert(rapid.param('x', {0, 0, 0}) == vec3(1, 2, 3)) return rapid.create {}",
      { set = { x = {1, 2, 3} }, frames = {1, 1} })
  end)

  it("refuses a setting of another type, with its default", function()
    for _, case in ipairs {
      { "5", "fast", "a number, like the default 5" }, { "5", "", "a number, like the default 5" },
      { "5", "1,2", "a number, like the default 5" }, { "5", "nan", "a number, like the default 5" },
      { "5", "true", "a number, like the default 5" }, { "5", "7m", "a number, like the default 5" },
      { "true", "yes", "true or false, like the default true" },
      { "{0, 0, 0}", "1,2", "a vec3 x,y,z, like the default {0, 0, 0}" },
      { "{0, 0, 0}", "1,2,3,4", "a vec3 x,y,z, like the default {0, 0, 0}" },
      { "{0, 0, 0}", "up", "a vec3 x,y,z, like the default {0, 0, 0}" },
    } do
      assert.equal(("--set x=%s: the value must be %s"):format(case[2], case[3]), value(case[1], case[2]))
    end
  end)

  it("is refused by the command before the first frame, with file and line", function()
    local text = "\nlocal rate = rapid.param('rate', 5, 'born per second')\nreturn rapid.create {}"
    local result = scene.command("check", text, "--set rate=fast")
    assert.equal("scene.lua:2: --set rate=fast: the value must be a number, like the default 5\n", result.stderr)
    assert.equal(2, result.status)
    result = scene.command("run", text, "--set raet=5")
    assert.equal('scene.lua: --set raet=5: the graph has no parameter "raet"; did you mean "rate"?\n', result.stderr)
    assert.equal(2, result.status)
  end)

  it("is the same value wherever it is used", function()
    assert.equal("7", value("5", 7, "local first = rapid.param('x', 5) assert(first == 7)"))
    assert.equal('rapid.param("x"): its default was 4 before and is 5 here; give each parameter one default, or ' ..
      "another name", value("5", nil, "rapid.param('x', 4)"))
  end)

  it("takes a name, a default and a line of documentation", function()
    for text, expected in pairs {
      ["rapid.param()"] = "rapid.param needs a name, a default and a line of documentation",
      ["rapid.param(5, 5)"] = "rapid.param needs a name, a default and a line of documentation",
      ["rapid.param('x')"] = 'rapid.param("x"): the default is nil; it must be a number, a boolean, a string or a vec3',
      ["rapid.param('x', {1, 2})"] = 'rapid.param("x"): the default is {1, 2}; it must be a number, a boolean, ' ..
        "a string or a vec3",
      ["rapid.param('x', print)"] = 'rapid.param("x"): the default is a function; it must be a number, a boolean, ' ..
        "a string or a vec3",
    } do
      assert.equal("scene.lua:1: " .. expected, scene.error("local x = " .. text))
    end
  end)

  it("reaches the nodes, the kernels in every state, and the modules", function()
    scene.folder:write("speeds.lua", "local rapid = require 'rapid'\nreturn { up = rapid.param('up', 1) }")
    local result = scene.run([[
local right, speeds = rapid.param("right", 1), require "speeds"
return rapid.create { points = rapid.points.grid { size = {30, 30, 30}, spacing = 1 }, fps = rapid.param("fps", 24) }
  :points("k", function(p) p.v = vec3(right, speeds.up, 0) end) :solve {}]],
      { set = { right = 3, up = 7, fps = 10 }, threads = 4, frames = {2, 2} })
    assert.near({3, 7, 0}, result[2]:min "v", 0)
    assert.near({3, 7, 0}, result[2]:max "v", 0)
    -- Centres of cells from -14.5 to 14.5, moved for a tenth of a second.
    assert.near({14.8, 15.2, 14.5}, result[2]:max "P", 1e-5)
  end)
end)
