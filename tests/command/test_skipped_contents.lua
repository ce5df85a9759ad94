-- Data that readers of points skip is reported per file, in the warnings of a run and by rapid info.
local scene = require "testing.scene"

local function warnings(file)
  local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.read %q } :solve {}]]):format(file), { frames = {1, 1} })
  return table.concat(result.warnings, "\n"), result[1]
end

local function big(n, size)
  local text = ""
  for k = size - 1, 0, -1 do text = text .. string.char(math.floor(n / 256 ^ k) % 256) end
  return text
end

describe("what a reader leaves out", function()
  it("is reported for .bgeo: primitives", function()
    -- A point at 0 with a string attribute, and spheres (7), of which only the number can be reported.
    scene.folder:write("one.bgeo", "BgeoV" .. big(5, 4) .. big(1, 4) .. big(3, 4) .. big(0, 4):rep(2) .. big(1, 4) ..
      big(0, 4):rep(3) .. big(4, 2) .. "kind" .. big(1, 2) .. big(4, 4) .. big(1, 4) .. big(4, 2) .. "rock" ..
      big(0, 4):rep(3) .. "\63\128\0\0" .. big(0, 4) .. big(7, 4) .. "\0\255")
    local text, points = warnings "one.bgeo"
    assert.matches('rapid.points.read: ".*one.bgeo": not read: its 3 primitives', text)
    assert.equal("rock", points[1].kind)
  end)

  it("is reported for .ply: other elements", function()
    scene.folder:write("one.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n" ..
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0\n1 0\n")
    assert.matches('not read: its 2 elements "face"', warnings "one.ply", 1, true)
  end)

  it("is reported for .usda: arrays of other types, and of other numbers of values", function()
    scene.folder:write("one.usda", [[
#usda 1.0
def Points "a"
{
    point3f[] points = [(0, 0, 0)]
    asset[] primvars:kind = [@rock@]
    float[] primvars:three = [1, 2, 3]
}
]])
    local text = warnings "one.usda"
    assert.matches("not read: primvars:kind of the type asset[]", text, 1, true)
    assert.matches("not read: primvars:three of 3 values, but there are 1 points", text, 1, true)
  end)

  it("is reported for .vtp: arrays of text, and polygons", function()
    scene.folder:write("one.vtp", [[
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="1" NumberOfPolys="2"><PointData><DataArray type="String" Name="kind" format="ascii">114 0
</DataArray></PointData><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0</DataArray>
</Points></Piece></PolyData></VTKFile>]])
    local text = warnings "one.vtp"
    assert.matches('not read: the array "kind" of the type String, 1 numbers per point', text, 1, true)
    assert.matches("not read: its 2 polygons", text, 1, true)
  end)

  it("is nothing of a file that Rapid wrote, and what is left is read", function()
    for _, extension in ipairs { "bgeo", "csv", "npz", "ply", "prt", "usda", "vdb", "vtp" } do
      local written = scene.command("run", 'return rapid.create { points = two } :attribute { heat = 2 } :solve {}',
        ("-f 1 -o back.%s --quiet"):format(extension))
      assert.equal(0, written.status, written.stderr)
      local text, points = warnings("back." .. extension)
      assert.equal("", text, extension)
      assert.equal(2, points:min "heat")
    end
  end)

  it("is reported by rapid info", function()
    scene.folder:write("one.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n" ..
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0\n")
    local command = require "testing.command"
    local shown = command.rapid("info one.ply", { cwd = scene.folder.path })
    assert.matches('note        not read: its 1 elements "face"', shown.stdout, 1, true)
    local json = require "dkjson"
    local reported = json.decode(command.rapid("info one.ply --json", { cwd = scene.folder.path }).stdout)
    assert.same({ 'not read: its 1 elements "face"' }, reported.left_out)
  end)
end)
