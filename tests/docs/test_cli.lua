-- Compares docs/cli.md with the command: both have the same options and JSON keys.
local command = require "testing.command"
local document = require "testing.document"
local json = require "dkjson"

local page = document.read "docs/cli.md"
local commands = {}
for name in command.rapid "--help".stdout:match("Subcommands:(\n.-)\n\n"):gmatch "\n  (%l+) " do
  commands[#commands + 1] = name
end

local function sorted(set)
  local list = {}
  for key in pairs(set) do list[#list + 1] = key end
  table.sort(list)
  return list
end

-- Returns the long options in a text or help page.
local function options_of(text)
  local options = {}
  for option in text:gmatch "%-%-(%l[%l-]*)" do options[option] = true end
  return options
end

-- Returns all keys of a value, at any depth, except those of tables that hold results by name.
local function keys_of(value, open, keys)
  keys = keys or {}
  if type(value) == "table" then
    for key, inner in pairs(value) do
      if type(key) == "string" then keys[key] = true end
      if not open[key] then keys_of(inner, open, keys) end
    end
  end
  return keys
end

local function assert_documented(keys, text)
  local code = document.code(text)
  local missing = {}
  for key in pairs(keys) do if not code[key] then missing[#missing + 1] = key end end
  assert.same({}, missing)
end

describe("docs/cli.md", function()
  local of_all = document.section(page, "## Options of every command")
  local of_graphs = document.section(page, "## Options of commands that load a graph")
  local loads_graphs = {
    run = true, check = true, explain = true, graph = true, trace = true, view = true, study = true, wedge = true,
  }

  it("has a section for every command, in the list of commands too", function()
    assert.is_true(#commands >= 9)
    local listed = {}
    for cells in document.rows(page) do
      local name = cells[1]:match "^`rapid (%l+)"
      if name then listed[name] = true end
    end
    for _, name in ipairs(commands) do
      assert.truthy(listed[name], name)
      document.section(page, "## rapid " .. name)
    end
    for name in page:gmatch "\n## rapid (%l+)" do assert.truthy(listed[name], name) end
  end)

  it("documents the options that each command has, and no others", function()
    for _, name in ipairs(commands) do
      local known = options_of(of_all .. document.section(page, "## rapid " .. name)
        .. (loads_graphs[name] and of_graphs or ""))
      local given = options_of(command.rapid(name .. " --help").stdout:match "Options:\n.*")
      for option in pairs(given) do assert.truthy(known[option], name .. " --" .. option) end
      for cells in document.rows(document.section(page, "## rapid " .. name)) do
        for option in pairs(options_of(cells[1])) do assert.truthy(given[option], name .. " --" .. option) end
      end
    end
    for _, name in ipairs(commands) do
      local given = options_of(command.rapid(name .. " --help").stdout)
      for cells in document.rows(of_all) do
        for option in pairs(options_of(cells[1])) do assert.truthy(given[option], name .. " --" .. option) end
      end
      if loads_graphs[name] then
        for cells in document.rows(of_graphs) do
          for option in pairs(options_of(cells[1])) do assert.truthy(given[option], name .. " --" .. option) end
        end
      end
    end
  end)

  it("documents the keys of --stats, and no others", function()
    local folder = command.folder()
    folder:write("all.lua", [[
local rapid = require "rapid"
local cube = rapid.levelset.box { size = {4, 0.4, 4}, voxel = 0.1 }
return rapid.create { points = rapid.points.grid { size = {0.4, 0.4, 0.4}, spacing = 0.1, center = {0, 1, 0} } }
  :attribute { pscale = 0.06 } :detail("none", function() end)
  :gravity {} :turbulence {} :drag { linear = 1000 }
  :collide { shape = cube } :contact { friction = 0.3 } :solve { substeps = 4 }]])
    folder:write("free.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid {} } :attract { center = {3, 0, 0} } :solve {}]])
    folder:write("many.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.09 } }
  :contact { radius = 0.01 } :solve {}]])
    folder:write("rod.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {0, -1, 0}} } } :gravity {}
  :distance { pairs = {{1, 2}}, strength = 1 }
  :group { name = "top", where = function(p) return p.id == 0 end } :pin { group = "top" } :solve {}]])
    local keys = {}
    for _, scene in ipairs { "all", "free", "many", "rod" } do
      local result = command.rapid("run " .. scene .. ".lua -f 1-3 --quiet --stats s.json", { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      keys_of(json.decode(folder:read "s.json"), {}, keys)
    end
    local text = document.section(page, "### Statistics") .. document.section(page, "### Sources of error")
    assert_documented(keys, text)
    for cells in document.rows(text) do
      for key in pairs(document.code(cells[1])) do
        assert.truthy(keys[key] or key == "local", key)
      end
    end
  end)

  it("documents the keys of explain, nodes, study, info and diff", function()
    local folder = command.folder()
    folder:write("ball.lua", [[
local rapid = require "rapid"
return rapid.study {
  name = "ball", frames = {1, 4}, sweep = { substeps = {1, 2} }, lines = "substeps", repeat_runs = 1,
  scene = function(k)
    return rapid.create { points = rapid.points.from { P = {{0, 2, 0}} } }
      :action("pull", function(p) p.force = p.force - p.P end) :solve { substeps = k.substeps }
  end,
  reference = { substeps = 8 },
}]])
    folder:write("scene.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid {} } :group { name = "g", where = function() return true end }
  :gravity {} :solve {}]])
    local inside = { cwd = folder.path }
    assert.equal(0, command.rapid("run scene.lua -f 1-2 --quiet -o a.####.csv", inside).status)
    local outputs = {
      explain = { "explain scene.lua --json", {} },
      nodes = { "nodes --json", { default = true } },
      study = { "study ball.lua --json -o out", { knobs = true, reference = true } },
      info = { "info a.0002.csv --json", {} },
      diff = { "diff a.0001.csv a.0002.csv --json", {} },
    }
    for name, output in pairs(outputs) do
      local result = command.rapid(output[1], inside)
      local keys = keys_of(assert(json.decode(result.stdout), result.stderr), output[2])
      assert.is_true(#sorted(keys) > 3)
      assert_documented(keys, document.section(page, "## rapid " .. name))
    end
  end)
end)
