-- Pruning changes no bit of the outputs: each run is compared with one that prunes nothing, and with one in which
-- another file requests more.
local amount = require "tests.amount"
local command = require "testing.command"
local csv_rows = require "tests.csv_rows"

local function same_files(folder, scene, arguments, outputs)
  local further = { pruned = "", all = "--keep-all", requested = "-o other.{output}.####.csv:mass,pscale,age,life" }
  for how, options in pairs(further) do
    local line = ("run %s %s %s"):format(scene, arguments, options)
    for _, output in ipairs(outputs) do line = line .. (" -o %s/%s"):format(how, output) end
    local result = command.rapid(line, { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
  end
  local compared = 0
  for _, name in ipairs(folder:list()) do
    local other = name:match "^pruned/(.*)"
    if other then
      compared = compared + 1
      assert.equal(folder:read(name), folder:read("all/" .. other), name)
      assert.equal(folder:read(name), folder:read("requested/" .. other), name)
    end
  end
  assert.truthy(compared > 0)
end

local function scene(body)
  local folder = command.folder()
  folder:write("scene.lua", 'local rapid = require "rapid"\n' .. body)
  return folder
end

local emit = ":emit { source = rapid.mesh.sphere { radius = 1 }, rate = 500, "

describe("what is left out", function()
  local cases = {
    ["an attribute that only emit makes"] = emit .. "attributes = { heat = 1, Cd = {1, 0, 0} } } :gravity {} :solve {}",
    ["an attribute of the source"] =
      ":emit { source = rapid.points.from { P = {{0, 0, 0}}, heat = {2} }, rate = 99 } :solve {}",
    ["an attribute of the initial points"] = ":solve {}",
    ["a default"] = emit .. "} :attribute { heat = 3 } :solve {}",
    ["life and age where nobody dies"] = emit .. "life = math.huge } :gravity {} :solve {}",
    ["birth times"] = emit .. "life = {0.1, 0.3} } :gravity {} :solve {}",
    ["a group"] = emit ..
      'group = "born" } :group { name = "right", where = function(p) return p.P.x > 0 end } :solve {}',
    ["an attribute that a node behind solve makes"] = emit .. "} :solve {} :attribute { pscale = 0.5 }",
    ["an attribute of merged points"] = emit .. '} :merge(rapid.create { seed = 4 }' .. emit ..
      "life = 0.2, attributes = { heat = 1 }, name = \"other\" } ) :gravity {} :solve {}",
    ["the age of points that are merged with mortal ones"] = emit .. '} :solve {} :merge(rapid.create { seed = 4 }' ..
      emit .. 'life = 0.2, name = "other" } :solve { name = "last" })',
  }
  for what, chain in pairs(cases) do
    it("changes nothing that is asked for: " .. what, function()
      local folder = scene(
        "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}}, spare = {1} } }" .. chain)
      same_files(folder, "scene.lua", "-f 1-8", { "named.####.csv:mass" })
      same_files(folder, "scene.lua", "-f 1-8", { "everything.####.csv" })
    end)
  end

  -- Points that are merged into others have their own values, or the defaults, whatever the others have. Lists an
  -- attribute of the point at y = 5, and its value.
  local sheet = ":attribute { pscale = 0.03, mass = 4 } "
  local read = ':points("read", function(p) p.v = vec3(p.heat, 0, 0) end) '
  local both = {
    ["merged after solve"] = { sheet .. ":contact {} :solve {} :merge(other:solve {})", "pscale", 0 },
    ["merged into points without it"] =
      { ":contact {} :solve {} :merge(other" .. sheet .. ":solve {})", "pscale", 0.03 },
    ["adopted before solve"] = { sheet .. ":contact {} :merge(other) :solve {}", "mass", 1 },
    ["made in both chains"] =
      { ":attribute { heat = 4 } " .. read .. ":merge(other:attribute { heat = 2 }) :solve {}", "vx", 2 },
    ["ages"] = { emit .. 'life = 0.2 } :solve {} :merge(other:solve {})', "age", 7 / 24 },
  }
  for what, case in pairs(both) do
    it("leaves the points of another chain what they have: " .. what, function()
      local chain, name, value = unpack(case)
      local folder = scene('local other = rapid.create { points = rapid.points.from { P = {{0, 5, 0}} } }\n' ..
        "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }" .. chain)
      same_files(folder, "scene.lua", "-f 1-8", { "everything.####.csv" })
      same_files(folder, "scene.lua", "-f 1-8", { "named.####.csv:" .. (name == "vx" and "mass" or name) })
      local rows, found = csv_rows(folder:read "pruned/named.0008.csv"), 0
      for _, row in ipairs(rows) do
        if row.Py == 5 then
          found = found + 1
          assert.near(value, row[name], 1e-6)
        end
      end
      assert.equal(1, found)
    end)
  end

  it("brings no attribute of one output into the file of another", function()
    local folder = scene("local other = rapid.create { points = rapid.points.from { P = {{0, 5, 0}} } } :solve {}\n" ..
      "return { main = rapid.create {}" .. emit .. "life = 0.2, attributes = { pscale = 0.1 } } :contact {} " ..
      ":solve {} :merge(other), other = other }")
    same_files(folder, "scene.lua", "-f 1-4", { "{output}.####.csv" })
    assert.equal("id,Px,Py,Pz,vx,vy,vz", folder:read "pruned/other.0004.csv":match "^[^\n]*")
  end)

  it("is nothing of points that no solve moves", function()
    local folder = scene('return rapid.create { points = rapid.points.from { P = {{0, 5, 0}}, spare = {1} } }' ..
      emit .. "} :attribute { heat = 2 }")
    same_files(folder, "scene.lua", "-f 1-4", { "everything.####.csv" })
    assert.matches("\n0,0,5,0,", folder:read "pruned/everything.0004.csv")
  end)

  it("changes no example scene", function()
    local folder, count = command.folder(), 0
    for path in command.shell("ls $PWD/graphs/*.lua").stdout:gmatch "%S+" do
      count = count + 1
      local is_chosen = amount.thorough or count % 4 == 1
      if is_chosen then same_files(folder, path, "-f 6-12x6", { path:match "([%w_]+)%.lua" .. ".####.csv" }) end
    end
    assert.truthy(count >= 5)
  end)

  it("is not in the file of an output that did not ask for it", function()
    local folder = scene("return rapid.create {}" .. emit .. '} :solve {} :write { file = "written.####.csv" }')
    local result = command.rapid("run scene.lua -f 2 -o all.####.csv -o some.####.csv:age", { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
    local function header(name) return folder:read(name):match "^[^\n]*" end
    assert.equal("id,Px,Py,Pz,vx,vy,vz", header "all.0002.csv")
    assert.equal("id,Px,Py,Pz,vx,vy,vz", header "written.0002.csv")
    assert.equal("id,Px,Py,Pz,vx,vy,vz,age", header "some.0002.csv")
  end)
end)
