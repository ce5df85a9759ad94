-- Files of a few megabytes that repeat one thing many times: the reading time grows in proportion to their size, and
-- messages about them stay short.
local command = require "testing.command"

local many = 200000

-- Repeats a text for each number.
local function repeated(text)
  local list = {}
  for i = 1, many do list[i] = text:format(i, i) end
  return table.concat(list)
end

local place = "property float x\nproperty float y\nproperty float z\n"
local triangle = "0 0 0\n1 0 0\n0 1 0\n"
local usda = '#usda 1.0\n(\nmetersPerUnit = 1\n)\ndef Points "points"\n{\npoint3f[] points = [(0, 0, 0)]\n%s}\n'

local points = {
  ["values.usda"] = usda:format(repeated "float[] primvars:a%d = [1]\n"),
  ["samples.usda"] = usda:format(repeated "float[] primvars:a%d = [1]\nfloat[] primvars:a%d.timeSamples = {1: [1]}\n"),
  ["types.usda"] = usda:format(repeated "matrix4d[] primvars:a%d = [1]\n"),
  ["sizes.usda"] = usda:format(repeated "float[] primvars:a%d = [1, 2]\n"),
  ["elements.ply"] = "ply\nformat ascii 1.0\nelement vertex 1\n" .. place ..
    repeated "element a%d 1\nproperty int b\n" .. "end_header\n0 0 0\n" .. ("1\n"):rep(many),
}
local meshes = {
  ["vertices.ply"] = "ply\nformat ascii 1.0\nelement vertex 3\n" .. place .. repeated "property float a%d\n" ..
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n" ..
    triangle:gsub("\n", (" 0"):rep(many) .. "\n") .. "3 0 1 2\n",
  ["faces.ply"] = "ply\nformat ascii 1.0\nelement vertex 3\n" .. place .. "element face 1\n" ..
    repeated "property list uchar int a%d\n" .. "property list uchar int vertex_indices\nend_header\n" .. triangle ..
    ("0 "):rep(many) .. "3 0 1 2\n",
  ["elements.ply"] = "ply\nformat ascii 1.0\nelement vertex 3\n" .. place ..
    "element face 1\nproperty list uchar int vertex_indices\n" .. repeated "element a%d 1\nproperty int b\n" ..
    "end_header\n" .. triangle .. "3 0 1 2\n" .. ("1\n"):rep(many),
}

local function try(files, chain)
  local folder = command.folder()
  for name, text in pairs(files) do
    folder:write(name, text)
    folder:write("scene.lua", ('local rapid = require "rapid"\nreturn rapid.create {%s} :solve {}\n'):format(
      chain:format(name)))
    local result = command.shell('ulimit -t 20; exec "$RAPID" run scene.lua -f 1-1 --quiet', { cwd = folder.path })
    assert.truthy(result.status == 0 and #result.stderr < 10000,
      ("%s: ended with %d, said %d bytes: %s"):format(name, result.status, #result.stderr, result.stderr:sub(1, 500)))
  end
end

describe("a file that is there to be slow, or long", function()
  it("is read in time, as points, where it has one thing many times", function()
    try(points, 'points = rapid.points.read "%s"')
  end)

  it("is read in time, as a mesh, where it has one thing many times", function()
    try(meshes, '} :emit { source = rapid.mesh.read "%s", count = 1')
  end)

  it("is reported in lines of bounded length if it has one endless name", function()
    local folder = command.folder()
    local endless = ("n"):rep(100000)
    local header = "id,Px,Py,Pz," .. endless
    for i = 1, 1000 do header = header .. ",a" .. i end
    folder:write("a.csv", header .. "\n0,0,0,0" .. (",1"):rep(1001) .. "\n")
    for _, line in ipairs { "info a.csv", "diff a.csv a.csv" } do
      local result = command.rapid(line, { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      assert.truthy(#result.stdout < 300000, ("%s: %d bytes"):format(line, #result.stdout))
    end
    folder:write("a.usda", usda:format("matrix4d[] primvars:" .. endless .. " = [1]\n"))
    folder:write("scene.lua", [[
      local rapid = require "rapid"
      local chain = rapid.create { points = rapid.points.read "a.usda" }:points(("n"):rep(1e6), function(p) end)
      for i = 1, 100 do chain = chain:points("n" .. i, function(p) end) end
      return chain]])
    local result = command.rapid("run scene.lua -f 1-1", { cwd = folder.path })
    assert.match('^warning: rapid%.points%.read: "a%.usda": not read: primvars:n+ %[%.%.%. %d+ bytes %.%.%.%] '
      .. "n+ of the type matrix4d%[%]\n", result.stderr:sub(1, 5000))
    assert.truthy(#result.stderr < 10000, #result.stderr)
    result = command.rapid("explain scene.lua", { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
    assert.truthy(#result.stdout < 5e6, #result.stdout)
  end)

  it("is shown with names and texts that are cut, in one line each", function()
    local folder = command.folder()
    local endless = ("n"):rep(60000)
    folder:write("a.usda", usda:format('float[] primvars:' .. endless .. " = [1]\n"))
    folder:write("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" .. place .. "property uchar group_" .. endless ..
      "\nend_header\n0 0 0 1\n")
    folder:write("a.csv", 'id,Px,Py,Pz,group:' .. endless .. ',"name\27[2J",text\n0,0,0,0,1,2,' .. endless .. "\n")
    folder:write("b.csv", 'id,Px,Py,Pz,group:' .. endless .. ',"name\27[2J",text\n0,0,0,0,0,3,' .. endless .. "b\n")
    for line, status in pairs {
      ["info a.usda"] = 0, ["info a.ply"] = 0, ["info a.csv"] = 0, ["diff a.csv b.csv"] = 1, ["diff a.csv a.ply"] = 1,
    } do
      local result = command.rapid(line, { cwd = folder.path })
      assert.equal(status, result.status, line .. ": " .. result.stderr)
      assert.truthy(#result.stdout < 4000, ("%s: %d bytes"):format(line, #result.stdout))
      assert.falsy(result.stdout:find "[%z\1-\8\11-\31\127]", result.stdout)
      assert.match("n %[%.%.%. %d+ bytes %.%.%.%] n", result.stdout)
    end
  end)

  it("is written in little memory if it has one endless string", function()
    local folder = command.folder()
    -- In .npz all strings of an attribute have the same length: 80 MB here.
    local text = "id,Px,Py,Pz,name\n0,0,0,0," .. ("n"):rep(1e5) .. "\n"
    for i = 1, 199 do text = text .. i .. ",0,0,0,n" .. i .. "\n" end
    folder:write("a.csv", text)
    folder:write("scene.lua", 'return require "rapid".create { points = require "rapid".points.read "a.csv" }\n')
    local function peak(output)
      local result = command.rapid("run scene.lua -f 1-1 --threads 1 -o " .. output, { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      return tonumber(result.stdout:match "([%d.]+) MiB of memory")
    end
    local little, padded = peak "a.####.csv", peak "a.####.npz"
    assert.truthy(padded < little + 20, ("%g MiB as .csv, %g as .npz"):format(little, padded))
  end)
end)
