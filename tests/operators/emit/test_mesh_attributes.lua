-- Attributes and groups of meshes from files, for points born on them or near them.
local scene = require "testing.scene"

-- Two adjacent squares in the plane y = 0, x from 0 to 1 and 1 to 2. Texture coordinates have a seam at x = 1: u goes
-- from 0 to 1 on both.
local obj = [[
v 0 0 0 1 0 0
v 1 0 0 1 0 0
v 1 0 1 1 0 0
v 0 0 1 1 0 0
v 2 0 0 1 0 0
v 2 0 1 1 0 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 1 0
g left
usemtl wood
f 4/4/1 3/3/1 2/2/1 1/1/1
g right
usemtl stone
f 3/4/1 6/3/1 5/2/1 2/1/1
]]

-- The same with numbers of faces and groups of faces, in PLY.
local ply = [[
ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
property float heat
element face 2
property list uchar int vertex_indices
property float wet
property uchar group_right
property list uchar float flags
element edge 1
property int vertex1
property int vertex2
end_header
0 0 0 0
1 0 0 1
1 0 1 1
0 0 1 0
2 0 0 2
2 0 1 2
4 3 2 1 0 0.25 0 1 5
4 2 5 4 1 0.75 1 1 6
0 1
]]

local function born(file, more)
  return scene.run(([[
return rapid.create { fps = 24 } :emit { source = rapid.mesh.read %q, count = 3000, %s } :solve {}]])
    :format(file, more or ""), { frames = {2, 2} })
end

describe("a point born on a mesh of an OBJ file", function()
  scene.folder:write("squares.obj", obj)

  it("has its texture coordinates, seams included, its normals and colours", function()
    local points = born("squares.obj")[2]
    assert.equal(3000, #points)
    for i = 1, #points do
      local p = points[i]
      local u = p.P.x <= 1 and p.P.x or p.P.x - 1
      if math.abs(p.P.x - 1) > 1e-5 then assert.near({u, p.P.z, 0}, p.uv, 1e-5) end
      assert.near({0, 1, 0}, p.N, 1e-6)
      assert.near({1, 0, 0}, p.Cd, 1e-6)
    end
  end)

  it("is on the faces of a group, by part or by material", function()
    for _, group in ipairs { "left", "wood" } do
      local points = born("squares.obj", ("source_group = %q"):format(group))[2]
      assert.equal(3000, #points)
      assert.is_true(points:max("P").x <= 1)
      -- Uniform on the square: mean 1/2, variance 1/12.
      assert.near(0.5, points:mean("P").x, 5 * math.sqrt(1 / 12 / 3000))
      assert.near(0.5, points:mean("P").z, 5 * math.sqrt(1 / 12 / 3000))
    end
    assert.is_true(born("squares.obj", 'source_group = "stone"')[2]:min("P").x >= 1)
  end)

  it("is an error for missing groups, and for sources without groups", function()
    local function message(more)
      return scene.error(("return rapid.create {} :emit { %s, count = 1 } :solve {}"):format(more))
    end
    assert.matches('has no group of faces "rigth"; did you mean "right"?',
      message 'source = rapid.mesh.read "squares.obj", source_group = "rigth"', 1, true)
    assert.matches('source_group: the mesh "sphere" has no group of faces "left"; it has none',
      message 'source = rapid.mesh.sphere {}, source_group = "left"', 1, true)
    assert.matches('source_group = "left" needs a mesh and from = "surface"',
      message 'source = two, source_group = "left"', 1, true)
  end)
end)

describe("a point born on a mesh of a PLY file", function()
  scene.folder:write("squares.ply", ply)

  it("has the values of its vertices and of its faces, and births go by either", function()
    local points = born "squares.ply"[2]
    for i = 1, #points do
      assert.near(points[i].P.x, points[i].heat, 1e-5)
      if math.abs(points[i].P.x - 1) > 1e-5 then
        assert.equal(points[i].P.x < 1 and 0.25 or 0.75, points[i].wet)
      end
    end
    local wet = born("squares.ply", 'density = "wet"')[2]
    local right = 0
    for i = 1, #wet do if wet[i].P.x > 1 then right = right + 1 end end
    assert.near(0.75 * 3000, right, 5 * math.sqrt(3000 * 0.75 * 0.25))
    -- The density is constant on a face.
    assert.near(0.5, wet:mean("P").z, 5 * math.sqrt(1 / 12 / 3000))
    assert.is_true(born("squares.ply", 'source_group = "right"')[2]:min("P").x >= 1)
    -- Both: linear on the group's faces only; for a density x from 1 to 2 the mean is 14/9.
    local both = born("squares.ply", 'source_group = "right", density = "heat"')[2]
    assert.near(14 / 9, both:mean("P").x, 5 * math.sqrt(0.08 / 3000))
  end)

  it("is an error that lists the attributes of the file", function()
    local warnings = table.concat(born("squares.ply").warnings, "\n")
    assert.matches('not read: the list "flags" of its faces', warnings, 1, true)
    assert.matches('not read: the 1 elements "edge"', warnings, 1, true)
  end)
end)

describe("what is born on a mesh of a glTF file", function()
  it("has its texture coordinates, normals and colours, and a group for its node and its material", function()
    -- A triangle (0,0,0) (1,0,0) (0,0,-1): positions, normals, texture coordinates and colours one after the other.
    local ffi = require "ffi"
    local floats = ffi.new("float[?]", 9 + 9 + 6 + 12, {
      0, 0, 0, 1, 0, 0, 0, 0, -1,
      0, 1, 0, 0, 1, 0, 0, 1, 0,
      0, 0, 1, 0, 0, 1,
      1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1,
    })
    scene.folder:write("one.bin", ffi.string(floats, ffi.sizeof(floats)))
    scene.folder:write("one.gltf", [[{
      "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
      "nodes": [{"name": "sail", "mesh": 0}], "materials": [{"name": "cloth"}],
      "meshes": [{"name": "one", "primitives": [{"material": 0, "attributes":
        {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3}}]}],
      "buffers": [{"uri": "one.bin", "byteLength": 144}],
      "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36},
        {"buffer": 0, "byteOffset": 36, "byteLength": 36},
        {"buffer": 0, "byteOffset": 72, "byteLength": 24}, {"buffer": 0, "byteOffset": 96, "byteLength": 48}],
      "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, -1], "max": [1, 0, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"},
        {"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC4"}]}]])
    for _, group in ipairs { "", 'source_group = "sail"', 'source_group = "cloth"' } do
      local points = born("one.gltf", group)[2]
      assert.equal(3000, #points)
      for i = 1, #points do
        local p = points[i]
        local b, c = p.P.x, -p.P.z
        -- glTF counts v downwards, Rapid upwards.
        assert.near(b, p.uv.x, 1e-5)
        assert.near({0, 1, 0}, p.N, 1e-6)
        assert.near({1 - b - c, b, c}, p.Cd, 1e-5)
      end
    end
  end)
end)

describe("attributes that a glTF file names by itself", function()
  local ffi = require "ffi"

  -- A triangle with _HEAT, as floats or as normalized bytes, and _Way; the buffer is a separate file, inline text, or
  -- part of a binary file.
  local function document(uri, heat)
    return ([[{
      "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_HEAT": 1, "_Way": 2, "_PAIR": 3}}]}],
      "buffers": [{%%s"byteLength": 96}],
      "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36},
        {"buffer": 0, "byteOffset": 36, "byteLength": 12%s},
        {"buffer": 0, "byteOffset": 48, "byteLength": 36}],
      "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, -1], "max": [1, 0, 0]},
        {"bufferView": 1, "componentType": %s, "count": 3, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"}]}]])
      :format(heat == "bytes" and ', "byteStride": 4' or "", heat == "bytes" and '5121, "normalized": true' or "5126")
      :format(uri)
  end
  local function bytes(heat)
    local buffer = ffi.new("uint8_t[96]")
    local floats = ffi.cast("float*", buffer)
    for k, x in ipairs { 0, 0, 0, 1, 0, 0, 0, 0, -1 } do floats[k - 1] = x end
    for k, x in ipairs { 0, 1, 0.2 } do
      if heat == "bytes" then buffer[36 + 4 * (k - 1)] = x * 255 else floats[8 + k] = x end
    end
    for k, x in ipairs { 1, 0, 0, 0, 1, 0, 0, 0, 1 } do floats[11 + k] = x end
    return ffi.string(buffer, 96)
  end
  local digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
  local function base64(text)
    return (text:gsub("(.)(.)(.)", function(a, b, c)
      local word = (a:byte() * 256 + b:byte()) * 256 + c:byte()
      local group = ""
      for shift = 18, 0, -6 do
        local k = math.floor(word / 2 ^ shift) % 64 + 1
        group = group .. digits:sub(k, k)
      end
      return group
    end))
  end
  local function check(file, tolerance)
    local points = born(file, "")[2]
    assert.equal(3000, #points)
    for i = 1, #points do
      local p = points[i]
      local b, c = p.P.x, -p.P.z
      assert.near(b + 0.2 * c, p.HEAT, tolerance)
      assert.near({1 - b - c, b, c}, p.Way, 1e-5)
    end
  end

  it("are those of the points that are born on it", function()
    scene.folder:write("own.bin", bytes "floats")
    scene.folder:write("own.gltf", document('"uri": "own.bin", ', "floats"))
    check("own.gltf", 1e-5)
    scene.folder:write("text.gltf",
      document('"uri": "data:application/octet-stream;base64,' .. base64(bytes "bytes") .. '", ', "bytes"))
    check("text.gltf", 1e-5)

    local text, data = document("", "floats"), bytes "floats"
    text = text .. (" "):rep(-#text % 4)
    local head = ffi.new("uint32_t[5]", 0x46546c67, 2, 28 + #text + #data, #text, 0x4e4f534a)
    local second = ffi.new("uint32_t[2]", #data, 0x004e4942)
    scene.folder:write("own.glb", ffi.string(head, 20) .. text .. ffi.string(second, 8) .. data)
    check("own.glb", 1e-5)
  end)

  it("are reported if they are neither numbers nor vectors of three", function()
    scene.folder:write("own.bin", bytes "floats")
    scene.folder:write("own.gltf", document('"uri": "own.bin", ', "floats"))
    local result = scene.command("check", [[
return rapid.create {} :emit { source = rapid.mesh.read "own.gltf", count = 1 } :solve {}]], "")
    assert.matches('the attribute "_PAIR"', result.stderr, 1, true)
  end)
end)

describe("the normals of a mesh", function()
  it("turn with the mesh, and are not those of the mesh at rest where it moves", function()
    scene.folder:write("squares.obj", obj)
    local function points(transform)
      return scene.run(([[
return rapid.create { fps = 24 } :emit { source = rapid.mesh.read "squares.obj":transform(%s), count = 100 } :solve {}
]]):format(transform), { frames = {2, 2} })[2]
    end
    local turned = points "rapid.rotate({1, 0, 0}, 90)"
    for i = 1, #turned do assert.near({0, 0, 1}, turned[i].N, 1e-6) end
    local moving = points "{ [1] = rapid.rotate({1, 0, 0}, 0), [9] = rapid.rotate({1, 0, 0}, 90) }"
    for _, name in ipairs(moving:names()) do assert.is_true(name ~= "N") end
  end)
end)
