-- Omissions change no bit of the outputs: each run is compared with one that omits nothing.
local command = require "testing.command"

local function same_files(folder, scene, arguments, outputs)
  for _, keep in ipairs { "pruned", "all" } do
    local line = ("run %s %s %s"):format(scene, arguments, keep == "all" and "--keep-all" or "")
    for _, output in ipairs(outputs) do line = line .. (" -o %s/%s"):format(keep, output) end
    local result = command.rapid(line, { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
  end
  local compared = 0
  for _, name in ipairs(folder:list()) do
    local other = name:match "^pruned/(.*)"
    if other then
      compared = compared + 1
      assert.equal(folder:read(name), folder:read("all/" .. other), name)
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

  it("is nothing of points that no solve moves", function()
    local folder = scene('return rapid.create { points = rapid.points.from { P = {{0, 5, 0}}, spare = {1} } }' .. emit ..
      "} :attribute { heat = 2 }")
    same_files(folder, "scene.lua", "-f 1-4", { "everything.####.csv" })
    assert.matches("\n0,0,5,0,", folder:read "pruned/everything.0004.csv")
  end)

  it("changes no example scene", function()
    local folder, count = command.folder(), 0
    for path in command.shell("ls $PWD/graphs/*.lua").stdout:gmatch "%S+" do
      count = count + 1
      same_files(folder, path, "-f 6-12x6", { path:match "([%w_]+)%.lua" .. ".####.csv" })
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
