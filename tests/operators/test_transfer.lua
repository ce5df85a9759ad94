-- transfer: attributes of the nearest position on a mesh.
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
  it("gives each point the values of the nearest position, inside the mesh and beyond its edges", function()
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

  it("reports wrong arguments", function()
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

describe("closest", function()
  -- The square from above, queried by a kernel.
  local function requested(kernel, options, points, square)
    scene.folder:write("square.ply", ply)
    return scene.run(([[
local square = %s
return rapid.create { fps = 24, points = %s }
  :attribute { near = {0, 0, 0}, heat = -1, wet = -1, way = {0, 0, 0} } :points("ask", function(p) %s end) :solve {}]])
      :format(square or 'rapid.mesh.read "square.ply"',
        points or "rapid.points.grid { size = {2, 1, 2}, spacing = 0.11, center = {0.5, 0.4, 0.5} }", kernel),
      options or { frames = {2, 2} })[2]
  end

  it("is the nearest position on a mesh, with the values of vertices and faces there", function()
    local points = requested [[
p.near, p.heat, p.way = square:closest(p.P), square:closest(p.P, "heat"), square:closest(p.P, "way")
p.wet = square:closest(p.P, "wet")]]
    assert.is_true(#points > 2000)
    for i = 1, #points do
      local p = points[i]
      local x, z = clamp(p.P.x), clamp(p.P.z)
      assert.near({x, 0, z}, p.near, 1e-5)
      assert.near(x, p.heat, 1e-5)
      assert.near({x, 0, z}, p.way, 1e-5)
      if math.abs(x - z) > 1e-3 then assert.equal(x > z and 0.25 or 0.75, p.wet) end
    end
  end)

  it("follows a mesh that moves, with normals that turn with it", function()
    local square = [[rapid.mesh.from { points = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}},
      faces = {{1, 2, 3, 4}}, values = { heat = {0, 0, 1, 1}, N = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}} } }
      :transform(function(frame)
        return rapid.translate(0, 5, 0) * rapid.rotate({0, 0, 1}, 90 * (frame.number - 1))
      end)]]
    local points = requested([[p.near, p.heat, p.way = square:closest(p.P), square:closest(p.P, "heat"),
      square:closest(p.P, "N") ]], nil, "rapid.points.from { P = {{3, 5.5, 0.2}} }", square)
    -- A quarter of a turn about z: x points up, and y to -x.
    assert.near({0, 5.5, 0.2}, points[1].near, 1e-5)
    assert.near(0.75, points[1].heat, 1e-5)
    assert.near({-1, 0, 0}, points[1].way, 1e-5)
  end)

  it("follows a sequence, with the values of its first file", function()
    for file = 1, 3 do
      local at_height = ply:gsub("\n(%d) 0 (%d %d %d %d %d)", ("\n%%1 %d %%2"):format(file))
      scene.folder:write(("lift.%04d.ply"):format(file), at_height)
    end
    local points = requested([[p.near, p.heat = square:closest(p.P), square:closest(p.P, "heat")]], nil,
      "rapid.points.from { P = {{0.25, 7, 0.5}} }", 'rapid.mesh.read "lift.####.ply"')
    assert.near({0.25, 2, 0.5}, points[1].near, 1e-5)
    assert.near(0.25, points[1].heat, 1e-5)
  end)

  it("is a position on a shape, and on a level set within its band", function()
    local points = requested("p.near = square:closest(p.P)", nil, "rapid.points.from { P = {{3, 0, 4}, {0, -9, 0}} }",
      "rapid.shape.sphere { radius = 1 }")
    assert.near({0.6, 0, 0.8}, points[1].near, 1e-6)
    assert.near({0, -1, 0}, points[2].near, 1e-6)
    points = requested("p.near = square:closest(p.P)", nil, "rapid.points.from { P = {{1.05, 0, 0}} }",
      "rapid.levelset.sphere { radius = 1, voxel = 0.05 }")
    assert.near({1, 0, 0}, points[1].near, 0.005) -- a tenth of a voxel
  end)

  it("has the same bits on 1, 2 and 7 threads", function()
    local grid = "rapid.points.grid { size = {2, 2, 2}, spacing = 0.06 }"
    local kernel = [[p.near, p.heat = square:closest(p.P), square:closest(p.P, "heat")]]
    local one = requested(kernel, { frames = {2, 2}, threads = 1 }, grid)
    assert.is_true(#one > 30000)
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one, requested(kernel, { frames = {2, 2}, threads = threads }, grid))
    end
  end)

  it("reports wrong arguments", function()
    local function fault(kernel, shape)
      scene.folder:write("square.ply", ply)
      return scene.error(([[
local square, ball = rapid.mesh.read "square.ply", rapid.shape.sphere {}
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :attribute { heat = 0 }
  :points("ask", function(p) %s end) :solve {}]]):format(kernel), shape)
    end
    assert.matches('the mesh has no attribute "heet"', fault 'p.heat = square:closest(p.P, "heet")', 1, true)
    assert.matches("needs the name of an attribute of a mesh, not \"heat\"",
      fault 'p.heat = ball:closest(p.P, "heat")', 1, true)
    assert.matches("shape:closest(P) needs a vec3, not 3", fault "p.heat = square:closest(3).x", 1, true)
  end)
end)
