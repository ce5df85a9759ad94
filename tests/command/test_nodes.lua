-- rapid nodes: the node types, from their own declarations.
local command = require "testing.command"
local json = require "dkjson"

describe("rapid nodes", function()
  local all = json.decode(command.rapid("nodes --json").stdout)

  it("lists every node with a line of documentation, in order of name", function()
    local result = command.rapid "nodes"
    assert.equal(0, result.status)
    local names, docs = {}, {}
    for name, doc in result.stdout:gmatch "([%w_]+) +([^\n]+)\n" do
      names[#names + 1] = name
      docs[#docs + 1] = doc
    end
    assert.equal(#all, #names)
    for i, node in ipairs(all) do
      assert.equal(node.name, names[i])
      assert.equal(node.doc, docs[i])
      assert.truthy(i == 1 or names[i - 1] < names[i])
    end
  end)

  it("ends with status 2 and the folder where Rapid's own files in Lua are missing", function()
    local folder = command.folder()
    command.shell('cp "$RAPID" rapid', { cwd = folder.path })
    local result = command.shell("./rapid nodes", { cwd = folder.path })
    assert.match("Rapid's Lua files are missing; they belong in share/rapid/lua", result.stderr)
    assert.equal(2, result.status)
  end)

  it("has the nodes of the simulation chain", function()
    local known = {}
    for _, node in ipairs(all) do known[node.name] = node end
    for name in ("create emit gravity collide solve points attribute group delete merge write"):gmatch "%a+" do
      assert.truthy(known[name], name)
    end
  end)

  it("describes every parameter: type, default, range, unit and documentation", function()
    for _, node in ipairs(all) do
      assert.truthy(#node.doc > 0, node.name)
      local page = command.rapid("nodes " .. node.name)
      assert.equal(0, page.status)
      assert.truthy(page.stdout:find(node.doc, 1, true), node.name)
      for _, param in ipairs(node.params) do
        local line = page.stdout:match("\n  " .. param.name .. " [^\n]*")
        assert.truthy(line, node.name .. " " .. param.name)
        assert.truthy(#param.doc > 0 and line:find(param.doc, 1, true), line)
        assert.truthy(line:find("[" .. param.type, 1, true), line)
        if param.unit ~= "" then assert.truthy(line:find(", " .. param.unit, 1, true), line) end
        if type(param.default) == "number" then
          assert.truthy(line:find("default " .. ("%.14g"):format(param.default), 1, true), line)
        end
      end
    end
  end)

  it("shows a page of one node, in words and as JSON", function()
    local page = command.rapid "nodes gravity"
    assert.equal(0, page.status)
    assert.truthy(page.stdout:find(":gravity{...}\n", 1, true))
    assert.truthy(page.stdout:find("default {0, -9.81, 0}", 1, true), page.stdout)
    local gravity = json.decode(command.rapid("nodes gravity --json").stdout)
    assert.equal("gravity", gravity.name)
    for _, param in ipairs(gravity.params) do
      if param.name == "g" then assert.same({ 0, -9.81, 0 }, param.default) end
    end
  end)

  it("shows how a value becomes a function of the frame, and the example runs", function()
    local example = command.rapid("nodes wind").stdout:match("\nA value may be a function of the frame: (velocity " ..
      "= [^\n]+)\n")
    local folder = command.folder()
    folder:write("scene.lua", ([[local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :wind { %s } :solve {}
]]):format(example))
    assert.equal(0, command.rapid("run scene.lua -f 1-3 --quiet", { cwd = folder.path }).status)
    assert.falsy(command.rapid("nodes create").stdout:find("function of the frame", 1, true))
  end)

  it("knows what an unknown node was meant to be", function()
    local result = command.rapid "nodes gravty"
    assert.equal(2, result.status)
    assert.equal('unknown node "gravty"; did you mean "gravity"?\n', result.stderr)
  end)

  it("writes annotations for editors: those that are there, in Lua, of every node and parameter", function()
    local written = command.rapid "nodes --annotations"
    assert.equal(0, written.status)
    local file = assert(io.open("lua/rapid.d.lua"))
    local committed = file:read "*a"
    file:close()
    assert.is_true(committed == written.stdout,
      "lua/rapid.d.lua is out of date; rapid nodes --annotations >lua/rapid.d.lua writes it")
    assert(loadstring(committed))
    assert.equal("---@meta rapid\n", committed:match "^[^\n]*\n")
    for _, node in ipairs(all) do
      local class = committed:match("%-%-%-@class rapid%.params%." .. node.name .. "\n(.-)\n\n")
      assert.truthy(class, node.name)
      for _, param in ipairs(node.params) do
        local line = class:match("%-%-%-@field " .. param.name .. "%?? [^\n]*")
        assert.truthy(line and line:find(param.doc, 1, true), node.name .. " " .. param.name)
        assert.is_nil(line:find "^%-%-%-@field [%w_]+%?? any ", line)
      end
      assert.truthy(committed:find("\nfunction [%w_]+[.:]" .. node.name .. "%("), node.name)
    end
  end)

  it("refuses the annotations of one node", function()
    local result = command.rapid "nodes gravity --annotations"
    assert.equal(2, result.status)
    assert.equal("rapid nodes: --annotations describes all nodes; remove gravity\n", result.stderr)
  end)

  it("has the nodes that lie in the current folder and on RAPID_PATH, and tells what is wrong with one", function()
    local here, path = command.folder(), command.folder()
    local function define(folder, name, more)
      folder:write(name .. ".lua", ('local rapid = require "rapid" return rapid.node { name = %q, doc = "Of %s." %s }')
        :format(name, name, more or ", points = function(p) p.v = p.v end"))
    end
    define(here, "hop")
    define(path, "skip")
    define(here, "wrong", ", points = 3")
    here:write("scene.lua", 'error "a scene is not run"')
    local list = command.shell(("RAPID_PATH=%s $RAPID nodes"):format(path.path), { cwd = here.path })
    assert.truthy(list.stdout:find("\nhop +Of hop%.\n"), list.stdout)
    assert.truthy(list.stdout:find("\nskip +Of skip%.\n"), list.stdout)
    assert.truthy(list.stderr:find("^warning: wrong%.lua:1: "), list.stderr)
    assert.equal(0, list.status)
    assert.truthy(command.rapid("nodes hop", { cwd = here.path }).stdout:find("^:hop{%.%.%.}\nOf hop%.\n"))
    assert.equal(2, command.rapid("nodes skip", { cwd = here.path }).status)
  end)
end)
