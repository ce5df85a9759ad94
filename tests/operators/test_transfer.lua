-- transfer: attributes of the nearest place of a mesh.
local scene = require "testing.scene"

local ply = [[
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float heat
property float wayx
property float wayy
property float wayz
element face 2
property list uchar int vertex_indices
property float wet
end_header
0 0 0 0 0 0 0
1 0 0 1 1 0 0
1 0 1 1 1 0 1
0 0 1 0 0 0 1
3 0 2 1 0.25
3 0 3 2 0.75
]]

local function run(transfer, options, points)
  scene.folder:write("square.ply", ply)
  return scene.run(([[
local square = rapid.mesh.read "square.ply"
return rapid.create { fps = 24, points = %s } :transfer { %s } :solve {}]]):format(
    points or "rapid.points.grid { size = {2, 1, 2}, spacing = 0.11, center = {0.5, 0.4, 0.5} }", transfer),
    options or { frames = {2, 2} })[2]
end

local function clamp(x) return math.max(0, math.min(1, x)) end

describe("transfer", function()
  it("gives each point the values of the nearest place, inside of the mesh and beyond its edges", function()
    local points = run "source = square"
    assert.is_true(#points > 2000)
    for i = 1, #points do
      local p = points[i]
      local x, z = clamp(p.P.x), clamp(p.P.z)
      assert.near(x, p.heat, 1e-5)
      assert.near({x, 0, z}, p.way, 1e-5)
      -- The faces meet at the diagonal x = z; the first has the corner (1, 0).
      if math.abs(x - z) > 1e-3 then assert.equal(x > z and 0.25 or 0.75, p.wet) end
    end
  end)

  it("gives those that are named, to points of a group that are near enough", function()
    local points = run([[source = square, attributes = {"heat"}, distance = 0.3]])
    for i = 1, #points do
      local p = points[i]
      local x, z = clamp(p.P.x), clamp(p.P.z)
      local away = math.sqrt((p.P.x - x) ^ 2 + p.P.y ^ 2 + (p.P.z - z) ^ 2)
      if math.abs(away - 0.3) > 1e-4 then assert.near(away < 0.3 and x or 0, p.heat, 1e-5) end
    end
    for _, name in ipairs(points:names()) do assert.is_true(name ~= "way" and name ~= "wet") end
  end)

  it("follows a mesh that moves, as it is at the end of the frame", function()
    local points = run([[source = square:transform {
      [1] = rapid.translate(0, 0, 0), [2] = rapid.translate(0.5, 0, 0) }]], nil,
       "rapid.points.from { P = {{0.75, 1, 0.5}, {1.5, 0, 0}} }")
    assert.near(0.25, points[1].heat, 1e-5)
    assert.near(1, points[2].heat, 1e-5)
  end)

  it("follows a sequence, with the values of each file", function()
    for file = 1, 3 do
      scene.folder:write(("body.%04d.ply"):format(file), (ply:gsub("\n1 0 0 1 ", ("\n1 0 0 %d "):format(file))))
    end
    local points = run([[source = rapid.mesh.read "body.####.ply", attributes = {"heat"}]], nil,
      "rapid.points.from { P = {{1, 1, 0}} }")
    assert.near(2, points[1].heat, 1e-5)
  end)

  it("has the same bits on 1, 2 and 7 threads", function()
    local one = run("source = square", { frames = {2, 2}, threads = 1 })
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one, run("source = square", { frames = {2, 2}, threads = threads }))
    end
  end)

  it("is told what is wrong", function()
    local function message(transfer)
      scene.folder:write("square.ply", ply)
      return scene.error(('local square = rapid.mesh.read "square.ply" return rapid.create { points = two } ' ..
        ":transfer { %s } :solve {}"):format(transfer))
    end
    assert.matches('has no "haet"; did you mean "heat"?', message 'source = square, attributes = {"haet"}', 1, true)
    assert.matches('the mesh "sphere" has no attributes', message "source = rapid.mesh.sphere {}", 1, true)
    assert.matches("source is missing", message "")
  end)
end)
