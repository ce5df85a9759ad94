-- emit by a density: an attribute of a mesh's vertices, or of points.
local scene = require "testing.scene"

-- A square [0, 1]² with heat = x, and two triangles.
local square = [[
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float heat
element face 2
property list uchar int vertex_indices
end_header
0 0 0 0
1 0 0 1
1 0 1 1
0 0 1 0
3 0 2 1
3 0 3 2
]]

local function run(source, emit)
  scene.folder:write("square.ply", square)
  return scene.run(("return rapid.create { fps = 24 } :emit { source = %s, %s } :solve {}"):format(source, emit),
    { frames = {1, 2} })[2]
end

local function mean(points, value)
  local sum = 0
  for i = 1, #points do sum = sum + value(points[i]) end
  return sum / #points
end

describe("emit by a density", function()
  it("distributes births over faces in proportion to it, and points have it as an attribute", function()
    local points = run('rapid.mesh.read "square.ply"', 'count = 20000, density = "heat"')
    assert.equal(20000, #points)
    -- A density of 2x has the mean 2/3 and a variance of 1/18.
    assert.near(2 / 3, mean(points, function(p) return p.P.x end), 5 * math.sqrt(1 / 18 / 20000))
    for i = 1, 100 do assert.near(points[i].P.x, points[i].heat, 1e-6) end
    local uniform = run('rapid.mesh.read "square.ply"', "count = 20000")
    assert.near(1 / 2, mean(uniform, function(p) return p.P.x end), 5 * math.sqrt(1 / 12 / 20000))
  end)

  it("draws vertices and points in proportion to it", function()
    local vertices = run('rapid.mesh.read "square.ply"', 'count = 100, density = "heat", from = "points"')
    for i = 1, #vertices do assert.near(1, vertices[i].P.x, 0) end
    local points = run("rapid.points.from { P = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, w = {0, 1, 3} }",
      'count = 20000, density = "w"')
    -- The values 2 and 3 with probabilities 1/4 and 3/4.
    assert.near(2.75, mean(points, function(p) return p.P.x end), 5 * math.sqrt(3 / 16 / 20000))
  end)

  it("is refused by name if the source does not have it", function()
    local function error_of(source, emit)
      return scene.error(("return rapid.create {} :emit { source = %s, count = 1, %s } :solve {}"):format(source, emit))
    end
    scene.folder:write("square.ply", square)
    local read = 'rapid.mesh.read "square.ply"'
    assert.truthy(error_of(read, 'density = "haet"')
      :find('the source has no float with this name; did you mean "heat"?', 1, true))
    assert.truthy(error_of("rapid.shape.sphere {}", 'density = "heat"'):find("must be an attribute of points", 1, true))
    assert.truthy(error_of(read, 'density = "heat", from = "volume"'):find("which a volume does not have", 1, true))
    assert.truthy(error_of("rapid.points.from { P = {{0, 0, 0}}, w = {-1} }", 'density = "w"')
      :find("w is -1 at point 0 of the source; a density must be finite and at least 0", 1, true))
    assert.truthy(error_of("rapid.points.from { P = {{0, 0, 0}}, w = {0} }", 'density = "w"')
      :find("w is 0 at all points of the source", 1, true))
    assert.truthy(error_of("rapid.create {} :solve {}", 'density = "heat"')
      :find('write :spawn { from = chain, count = 1, density = "heat" }', 1, true))
  end)
end)
