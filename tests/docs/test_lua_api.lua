-- Compares docs/lua-api.md with the program: both have the same nodes, parameters, fields, methods and constructors,
-- and the document's scenes run.
local command = require "testing.command"
local document = require "testing.document"
local json = require "dkjson"

local page = document.read "docs/lua-api.md"
local annotations = command.rapid "nodes --annotations".stdout
local nodes = json.decode(command.rapid "nodes --json".stdout)

describe("docs/lua-api.md", function()
  it("lists each node once by task, and no others", function()
    local listed = {}
    for cells in document.rows(document.section(page, "## Nodes"):match "| task.-\n\n") do
      for name in cells[2]:gmatch "`[%w.]*[.:]([%w_]+)`" do
        assert.is_nil(listed[name], name)
        listed[name] = true
      end
    end
    local there = {}
    for _, node in ipairs(nodes) do there[node.name] = true end
    assert.same(there, listed)
  end)

  it("has the reference that the declarations and the examples give", function()
    local written = command.shell '"$RAPID" nodes --json | python3 docs/reference/nodes.py --print'
    assert.equal("", written.stderr)
    assert.is_true(written.stdout == page,
      "docs/lua-api.md is out of date; rapid nodes --json | python3 docs/reference/nodes.py writes it")
  end)

  it("has one row for each parameter of a node, and no others", function()
    local checked = 0
    for _, node in ipairs(nodes) do
      local expected, found = {}, {}
      for _, param in ipairs(node.params) do
        -- The reference states this parameter once for all nodes.
        local is_common = param.name == "group" and param.doc:find "^limits the node to the points of this group"
        if not is_common then expected[param.name] = 1 end
      end
      local head = "\n### " .. (node.name == "create" and "rapid.create" or ":" .. node.name) .. "\n"
      local _, from = page:find(head, 1, true)
      local section = page:sub(assert(from, head), (page:find("\n###? ", from) or 0) - 1)
      for name in section:gmatch "\n| `([%w_]+)` |" do found[name] = (found[name] or 0) + 1 end
      assert.same(expected, found, node.name)
      checked = checked + 1
    end
    assert.truthy(checked > 50, checked)
  end)

  it("has the fields and methods of a point, and no others", function()
    local section = document.section(page, "## Kernels")
    local fields, methods = {}, {}
    local class = annotations:match "%-%-%-@class rapid%.Point\n(.-)\n\n"
    for name in class:gmatch "%-%-%-@field ([%w_]+) " do fields[name] = true end
    for name in annotations:gmatch "function Point:([%w_]+)%(" do methods[name] = true end
    assert.truthy(fields.P and fields.hitpath and methods.rand)
    local named, called = {}, {}
    for cells in document.rows(section) do
      for word in pairs(document.code(cells[1])) do
        if word:match "^p%.(%w+)$" then named[word:match "^p%.(%w+)$"] = true end
        if word:match "^p:(%w+)%(" then called[word:match "^p:(%w+)%("] = true end
      end
    end
    assert.same(fields, named)
    assert.same(methods, called)
  end)

  it("has the fields of frame and step", function()
    local section = document.section(page, "## Kernels")
    for class, value in pairs { Frame = "frame", Step = "step" } do
      local fields = annotations:match("%-%-%-@class rapid%." .. class .. "[^\n]*\n(.-)\n\n")
      for name in fields:gmatch "%-%-%-@field ([%w_]+) " do
        assert.truthy(section:find(("`%s.%s`"):format(value, name), 1, true), value .. "." .. name)
      end
    end
  end)

  it("names every constructor and method of the library, and no others", function()
    local there = {}
    for name in annotations:gmatch "\nfunction (rapid%.[%w_.]+)%(" do
      there[name] = true
      local short = name:match "^rapid%.math%.(.*)"
      assert.truthy(page:find(name, 1, true) or (short and page:find("`" .. short, 1, true)), name)
    end
    assert.truthy(there["rapid.mesh.torus"] and there["rapid.levelset.from_points"])
    for word in pairs(document.code(page)) do
      local name = word:match "^(rapid%.[%l_]+%.[%l_]+)"
      if name then assert.truthy(there[name], name) end
    end
    for class in ("Vec3 Quat Mesh Shape LevelSet Grid"):gmatch "%a+" do
      for name in annotations:gmatch("\nfunction " .. class .. ":([%w_]+)%(") do
        assert.truthy(page:find(":" .. name, 1, true), class .. ":" .. name)
      end
    end
  end)

  it("shows scenes that run", function()
    local folder = command.folder()
    local scene, generations, picture, node, curve = unpack(document.blocks(page, "lua"))
    folder:write("scene.lua", scene)
    folder:write("generations.lua", generations)
    folder:write("picture.lua", picture)
    folder:write("curve.lua", curve)
    folder:write("swirl.lua", node)
    folder:write("turned.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid {} } :swirl { strength = 2 } :solve {}]])
    for _, name in ipairs { "scene", "generations", "picture", "curve", "turned" } do
      local result = command.rapid(("run %s.lua -f 1-3 --quiet"):format(name), { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
    end
  end)

  it("shows a test that passes", function()
    local folder = command.folder()
    local file = folder:write("test_sparks.lua", document.blocks(page, "lua")[6])
    assert.equal(0, command.rapid("test " .. command.quoted(file)).status)
  end)
end)
