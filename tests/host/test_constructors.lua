-- Every constructor of the graph language: its result, measured from outside, and its errors.
local scene = require "testing.scene"

-- Points born on or in a source.
local function born(source, options, before)
  local text = ("%s return rapid.create { seed = 3 } :emit { source = %s, count = 2000, birth = 'end', %s } :solve {}")
    :format(before or "", source, options or "")
  return scene.run(text, { frames = {2, 2} })[2]
end

local function each(points, f)
  for i = 1, #points do f(points[i].P) end
end

-- Returns the height at which a point that falls from (x, 10, z) comes to rest on a shape.
local function height(shape, x, z, before)
  local text = [[
%s return rapid.create { points = rapid.points.from { P = {{%g, 10, %g}} } } :gravity {}
  :collide { shape = %s, bounce = 0, friction = 100 } :solve {}]]
  return scene.run(text:format(before or "", x, z, shape), { frames = {60, 60} })[60][1].P.y
end

local function fault(expression)
  local message = scene.error("local value = " .. expression .. " return rapid.create {}")
  return (message:gsub("^scene%.lua:1: ", ""))
end

describe("rapid.mesh", function()
  it(".sphere has its points on a sphere", function()
    local points = born "rapid.mesh.sphere { radius = 2, divisions = 48, center = {1, 2, 3} }"
    assert.equal(2000, #points)
    -- A chord over 1/48 of the circle sags by r (1 - cos(pi/48)). The sag doubles if it occurs in both directions.
    local sag = 2 * 2 * (1 - math.cos(math.pi / 48))
    each(points, function(P) assert.near(2 - sag / 2, (P - vec3(1, 2, 3)):length(), sag / 2 + 1e-5) end)
  end)

  it(".box has its points on the sides of a box", function()
    local points = born "rapid.mesh.box { size = {2, 4, 6}, center = {1, 0, 0} }"
    each(points, function(P)
      local x, y, z = math.abs(P.x - 1) / 1, math.abs(P.y) / 2, math.abs(P.z) / 3
      assert.near(1, math.max(x, y, z), 1e-6)
    end)
    assert.near({2, 2, 3}, points:max "P", 0.05)
  end)

  it(".grid is flat, and faces up", function()
    local points = born("rapid.mesh.grid { size = {4, 2}, divisions = 3, center = {0, 1, 0} }", "speed = 5")
    each(points, function(P) assert.near(1, P.y, 1e-6) end)
    assert.near({2, 1, 1}, points:max "P", 0.05)
    assert.near({0, 5, 0}, points:min "v", 1e-6)
  end)

  it(".torus has its points about a ring around the y axis", function()
    local points = born "rapid.mesh.torus { radius = 2, tube = 0.5, divisions = 64 }"
    each(points, function(P)
      local ring = math.sqrt(P.x * P.x + P.z * P.z) - 2
      -- 64 chords around the axis, 16 around the tube.
      local sag = 2.5 * (1 - math.cos(math.pi / 64)) + 0.5 * (1 - math.cos(math.pi / 16))
      assert.near(0.5, math.sqrt(ring * ring + P.y * P.y), sag)
    end)
  end)

  it(".from is made of points and faces", function()
    local points = born "rapid.mesh.from { points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, faces = {{1, 2, 3}} }"
    each(points, function(P)
      assert.equal(0, P.y)
      assert.truthy(P.x >= 0 and P.z >= 0 and P.x + P.z <= 1 + 1e-6)
    end)
  end)

  it(".from has values at its vertices, which births between them interpolate", function()
    local points = born("rapid.mesh.from { points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, faces = {{1, 2, 3}}, " ..
      "values = { heat = {5, 7, 2}, Cd = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}} } }")
    for i = 1, #points do
      local p = points[i]
      assert.near(5 + 2 * p.P.x - 3 * p.P.z, p.heat, 2e-6)
      assert.near({p.P.x, p.P.z, 0}, p.Cd, 1e-6)
    end
  end)

  it(".read reads a file next to the graph", function()
    scene.folder:write("roof.obj", "v 0 1 0\nv 2 1 0\nv 2 1 2\nv 0 1 2\nf 1 4 3 2\n")
    local points = born "rapid.mesh.read 'roof.obj'"
    each(points, function(P) assert.equal(1, P.y) end)
    assert.near({2, 1, 2}, points:max "P", 0.05)
  end)

  it("of every kind takes a character of the file's name literally after a backslash", function()
    local ball = scene.command("run", "rapid.levelset.sphere { voxel = 0.1 }:write 'ball.vdb' return rapid.create {}",
      "-f 1 --quiet")
    assert.equal("", ball.stderr)
    os.rename(scene.folder:file "ball.vdb", scene.folder:file "ball#2.vdb")
    scene.folder:write("roof#2.obj", "v 0 1 0\nv 2 1 0\nv 2 1 2\nf 1 3 2\n")
    scene.folder:write("line#2.obj", "v 0 1 0\nv 2 1 0\nl 1 2\n")
    scene.folder:write("one#2.csv", "Px,Py,Pz\n0,1,0\n")
    local result = scene.run([[
local roof, line = rapid.mesh.read "roof\\#2.obj", rapid.curve.read "line\\#2.obj"
return rapid.create { points = rapid.points.read "one\\#2.csv" }
  :emit { source = roof, count = 2 } :emit { source = line, count = 3 }
  :collide { shape = rapid.levelset.read "ball\\#2.vdb" } :solve {}]])
    assert.equal(1 + 2 * (2 + 3), #result[3])
  end)

  it("is moved, turned and scaled, by the right motion first", function()
    local points = born [[
rapid.mesh.grid { size = {2, 2} }:transform(rapid.translate(10, 0, 0) * rapid.rotate({0, 0, 1}, 90) * rapid.scale(3))]]
    -- Scaled to 6 x 6, turned into the plane x = 0, moved to x = 10.
    each(points, function(P) assert.near(10, P.x, 1e-5) end)
    assert.near({10, 3, 3}, points:max "P", 0.05)
    assert.near({10, -3, -3}, points:min "P", 0.05)
  end)
end)

describe("rapid.levelset", function()
  it("makes solids whose surface is where it should be", function()
    local voxel = 0.05
    for shape, expected in pairs {
      ["rapid.levelset.sphere { radius = 1, voxel = 0.05 }"] = 1,
      ["rapid.levelset.sphere { radius = 1, voxel = 0.05, center = {0, 3, 0} }"] = 4,
      ["rapid.levelset.box { size = {2, 3, 2}, voxel = 0.05 }"] = 1.5,
      ["rapid.levelset.from_mesh(rapid.mesh.box { size = {2, 1, 2} }, { voxel = 0.05 })"] = 0.5,
      ["rapid.levelset.from_mesh(rapid.mesh.sphere { divisions = 64 }, { voxel = 0.05, half_width = 5 })"] = 1,
    } do
      assert.near(expected, height(shape, 0, 0), voxel, shape)
    end
    assert.near(0.5, height("rapid.levelset.torus { radius = 2, tube = 0.5, voxel = 0.05 }", 2, 0), voxel)
    assert.truthy(height("rapid.levelset.torus { radius = 2, tube = 0.5, voxel = 0.05 }", 0, 0) < -5)
  end)

  it("emits points on its surface", function()
    each(born "rapid.levelset.sphere { radius = 1, voxel = 0.05 }", function(P)
      assert.near(1, P:length(), 0.01)
    end)
  end)

  it("emits points in its volume", function()
    local points = born("rapid.levelset.box { size = {2, 2, 2}, voxel = 0.05 }", "from = 'volume'")
    assert.near({0, 0, 0}, points:mean "P", 5 * math.sqrt(3 * 4 / 12 / 2000))
    assert.near({1, 1, 1}, points:max "P", 0.05)
  end)

  it("is written in a run alone, and read again", function()
    local text = [[
rapid.levelset.sphere { radius = 1, voxel = 0.05 }:write("ball.vdb") return rapid.create {}]]
    scene.command("check", text)
    assert.is_nil(scene.folder:read "ball.vdb")
    scene.run(text, { frames = {1, 1} })
    assert.is_nil(scene.folder:read "ball.vdb")
    local result = scene.command("run", text, "-f 1 --quiet")
    assert.equal("", result.stderr)
    assert.truthy(scene.folder:read "ball.vdb")
    assert.near(1, height("rapid.levelset.read 'ball.vdb'", 0, 0), 0.05)
    assert.near(1, height("rapid.levelset.read('ball.vdb', { grid = 'surface' })", 0, 0), 0.05)
  end)
end)

describe("rapid.shape", function()
  it("makes solids without a grid", function()
    for shape, expected in pairs {
      ["rapid.shape.plane {}"] = 0,
      ["rapid.shape.plane { normal = {0, 2, 0}, offset = 3 }"] = 1.5,
      ["rapid.shape.sphere { radius = 2, center = {0, 1, 0} }"] = 3,
      ["rapid.shape.box { size = {1, 5, 1} }"] = 2.5,
    } do
      assert.near(expected, height(shape, 0, 0), 1e-5, shape)
    end
  end)

  it("emits points on it, evenly by area, and in it, evenly by volume", function()
    -- Checks that the mean of f is within five standard errors of its exact mean; sigma is the standard deviation of f.
    local function mean_is(expected, sigma, points, f)
      local sum = 0
      each(points, function(P) sum = sum + f(P) end)
      assert.near(expected, sum / #points, 5 * sigma / math.sqrt(#points))
    end
    local center = vec3(1, 2, 3)
    local ball, box = "rapid.shape.sphere { radius = 2, center = {1, 2, 3} }", "rapid.shape.box { size = {1, 2, 4} }"

    local points = born(ball)
    each(points, function(P) assert.near(2, (P - center):length(), 1e-5) end)
    -- On a sphere each coordinate is uniform.
    for _, axis in ipairs { "x", "y", "z" } do
      mean_is(center[axis], 2 / math.sqrt(3), points, function(P) return P[axis] end)
      mean_is(4 / 3, 4 * math.sqrt(1 / 5 - 1 / 9), points, function(P) return (P[axis] - center[axis]) ^ 2 end)
    end

    points = born(ball, "from = 'volume'")
    -- r³ is uniform below R³.
    mean_is(4, 8 / math.sqrt(12), points, function(P) return (P - center):length() ^ 3 end)
    mean_is(1, 2 / math.sqrt(5), points, function(P) return P.x end)

    points = born(box)
    -- Faces of 2 x 4, 1 x 4 and 1 x 2, 28 m² in total.
    for axis, part in pairs { x = 16 / 28, y = 8 / 28, z = 4 / 28 } do
      local half = ({ x = 0.5, y = 1, z = 2 })[axis]
      mean_is(part, math.sqrt(part * (1 - part)), points, function(P)
        return math.abs(math.abs(P[axis]) - half) < 1e-6 and 1 or 0
      end)
    end

    points = born(box, "from = 'volume'")
    for axis, edge in pairs { x = 1, y = 2, z = 4 } do
      mean_is(0, edge / math.sqrt(12), points, function(P) return P[axis] end)
      mean_is(edge ^ 2 / 12, edge ^ 2 * math.sqrt(1 / 80 - 1 / 144), points, function(P) return P[axis] ^ 2 end)
    end
  end)

  it(".plane slopes as its normal says", function()
    assert.near(-1, height("rapid.shape.plane { normal = {1, 1, 0} }", 1, 0), 1e-5)
  end)
end)

describe("rapid.points", function()
  it(".from holds the columns that it is given, of their types", function()
    local points = scene.run([[
return rapid.create { points = rapid.points.from { P = {{1, 2, 3}, vec3(4, 5, 6)}, v = {{0, 0, 1}, {0, 0, 2}},
  heat = {0.5, 7}, up = {{0, 1, 0}, vec3(1, 0, 0)}, orient = {{0, 0, 0, 1}, {1, 0, 0, 0}} } }]], { frames = {1, 1} })[1]
    assert.near({4, 5, 6}, points[2].P, 0)
    assert.near({0, 0, 2}, points[2].v, 0)
    assert.equal(0.5, points[1].heat)
    assert.near({1, 0, 0}, points[2].up, 0)
    assert.same({ 0, 1 }, { points[1].id, points[2].id })
    assert.equal("quat(1, 0, 0, 0)", tostring(points[2].orient))
  end)

  it(".grid stands at the centres of the cells of a box", function()
    local points = scene.run(
      "return rapid.create { points = rapid.points.grid { size = {1, 0.5, 0}, spacing = 0.25, center = {10, 0, 0} } }",
      { frames = {1, 1} })[1]
    assert.equal(4 * 2 * 1, #points)
    assert.near({9.625, -0.125, 0}, points:min "P", 1e-6)
    assert.near({10.375, 0.125, 0}, points:max "P", 1e-6)
  end)

  it(".read reads the files of a run", function()
    local text = [[
return rapid.create { points = rapid.points.from { P = {{1, 2, 3}, {4, 5, 6}}, heat = {0.5, 7} } } :solve {}]]
    for _, format in ipairs { "vdb", "bgeo", "ply", "csv", "npz", "prt", "usda", "vtp" } do
      local result = scene.command("run", text, ("-f 1 -o made.####.%s --quiet"):format(format))
      assert.equal("", result.stderr)
      local points = scene.run(("return rapid.create { points = rapid.points.read 'made.0001.%s' }"):format(format),
        { frames = {1, 1} })[1]
      assert.near({4, 5, 6}, points:by_id(1).P, 0)
      assert.equal(7, points:by_id(1).heat)
    end
  end)

  it("emits points at the source's points", function()
    local points = born("two", "from = 'points'")
    each(points, function(P) assert.truthy((P.x == 0 or P.x == 1) and P.y == 1 and P.z == 0) end)
  end)
end)

describe("a constructor with arguments that nothing can be made of", function()
  it("says why, with the line of the call", function()
    for expression, expected in pairs {
      ["rapid.mesh.sphere { radius = 0 }"] = "radius = 0 is out of range; it must be above 0",
      ["rapid.mesh.sphere { radius = 'big' }"] = 'radius = "big" has the wrong type; it must be a number',
      ["rapid.mesh.sphere { raduis = 1 }"] = 'unknown option "raduis"; did you mean "radius"?',
      ["rapid.mesh.sphere(2)"] = "needs a table of options, not 2",
      ["rapid.mesh.sphere { 2 }"] = "rapid.mesh.sphere: 2 has no name; write { NAME = value, ... }",
      ["rapid.mesh.box { size = 2 }"] = "size = 2 has the wrong type; it must be a vec3 or {x, y, z}",
      ["rapid.mesh.box { size = {1, -1, 1} }"] = "size = {1, -1, 1}: each edge must be above 0",
      ["rapid.mesh.grid { size = {1, 2, 3} }"] = "size must be two lengths above 0, {x, z}",
      ["rapid.mesh.torus { divisions = 3.5 }"] = "rapid.mesh.torus: divisions = 3.5 is not whole; " ..
        "it must be an integer",
      ["rapid.mesh.torus { radius = 1, tube = 2 }"] = "tube of a mesh torus = 2 is out of range; it must be below " ..
        "its radius, 1",
      ["rapid.mesh.from {}"] = "rapid.mesh.from: points is missing: positions {{x, y, z}, ...}",
      ["rapid.mesh.from { points = {{0, 0, 0}}, faces = {{1, 2, 3}} }"] = "rapid.mesh.from: face 1 has the corner " ..
        "2; a corner must be a whole number from 1 to 1",
      ["rapid.mesh.from { points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, faces = {{1, 2, 3}}, values = { h = {1} } }"] =
        "values: h has 1 values; it must be a list of 3 values, one for each of `points`",
      ["rapid.mesh.from { points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, faces = {{1, 2, 3}}, values = { id = {} } }"] =
        "values: id can't be given, because the birth of a point sets it; choose another name",
      ["rapid.mesh.read()"] = "rapid.mesh.read: the path is missing",
      ["rapid.mesh.read 'none.obj'"] = 'rapid.mesh.read: there is no mesh file "none.obj"',
      ["rapid.mesh.read(5)"] = "path = 5 has the wrong type; it must be a string",
      ["rapid.levelset.from_mesh()"] = "the mesh is missing",
      ["rapid.mesh.read(('x/'):rep(3000) .. 'a.obj')"] = 'rapid.mesh.read: there is no mesh file "x/x/',
      ["rapid.levelset.read(('x/'):rep(3000) .. 'a.vdb')"] = 'there is no file "x/x/',
      ["rapid.grid.read(('x'):rep(300) .. '.vdb')"] = 'there is no file "xxx',
      ["rapid.levelset.from_mesh(two)"] = "mesh = points has the wrong type",
      ["rapid.levelset.from_mesh(rapid.mesh.box {}, { voxel = -1 })"] = "voxel = -1 is out of range; it must be " ..
        "at least 2e-05",
      ["rapid.levelset.from_mesh(rapid.mesh.box { center = {0, 1e15, 0} })"] = 'mesh "box" reaches 1e+15 m from the ' ..
        "origin, more than 2^31 voxels of 0.1 m; move it nearer to the origin, and move the level set back",
      ["rapid.levelset.from_mesh(rapid.mesh.box { center = {0, 1e8, 0} })"] = 'mesh "box" is flat: its size is 1 x ' ..
        "0 x 1 m; a level set needs an inside",
      ["rapid.levelset.sphere { radius = 1, voxel = 2e-5 }"] = "use a voxel of at least 0.000198 m",
      ["rapid.levelset.sphere { radius = 1, voxel = 10 }"] = "use a voxel of at most 1 m",
      ["rapid.levelset.read 'none.vdb'"] = 'there is no file "none.vdb"',
      ["rapid.shape.plane { normal = {0, 0, 0} }"] = "normal of a plane = {0, 0, 0} has no direction; its length " ..
        "must be above 0",
      ["rapid.shape.sphere { radius = -1 }"] = "radius = -1 is out of range; it must be above 0",
      ["rapid.shape.box { size = {0, 1, 1} }"] = "size = {0, 1, 1}: each edge must be above 0",
      ["rapid.points.from {}"] = "P is missing; give P = {{x, y, z}, ...}",
      ["rapid.points.from()"] = "rapid.points.from needs a table of columns: { P = {{x, y, z}, ...} }",
      ["rapid.points.from { P = {{0, 0, 0}}, heat = {1, 2} }"] = "heat has 2 values; it must be a list of 1 " ..
        "values, like P",
      ["rapid.points.from { P = {{0, 0, 0}}, id = {4} }"] = "id can't be given; ids count from 0",
      ["rapid.points.from { P = {{0, 0}} }"] = "P = {0, 0} has the wrong type; it must be a list of {x, y, z}",
      ["rapid.points.from { P = {{0, 0, 0}, {1, 1, 1}}, a = {1, {1, 2, 3}} }"] = "a[2] is {1, 2, 3}; " ..
        "it must be a float, like the first",
      ["rapid.points.grid { size = {2, 1, -1} }"] = "size = {2, 1, -1}: each edge must be at least 0",
      ["rapid.points.grid { spacing = 0 }"] = "spacing = 0 is out of range; it must be above 0",
      ["rapid.points.grid { spacing = 1e-6 }"] = "at most 2^31 are possible",
      ["rapid.points.read 'none.vdb'"] = "rapid.points.read: none.vdb: can't be read: No such file or directory",
      ["rapid.fog.read 'none.vdb'"] = "rapid.fog.read: there is no file",
      ["rapid.levelset.sphere { radius = 1, voxel = 0.2 }:write 'ball.vdb' rapid.fog.read 'ball.vdb'"] =
        "there is no fog of floats",
      ["rapid.translate(1, 2)"] = "rapid.translate needs three numbers, rapid.translate(x, y, z); one is nil",
      ["rapid.rotate({0, 0, 0}, 90)"] = "rapid.rotate: the axis has length 0; give it a direction",
      ["rapid.rotate({0, 1, 0})"] = "rapid.rotate: the degrees is missing",
      ["rapid.scale(0)"] = "rapid.scale: factor = 0 is out of range; it must be above 0",
      ["rapid.scale()"] = "rapid.scale: the factor is missing",
      ["rapid.scale(2) * 3"] = "second = 3 has the wrong type",
      ["rapid.mesh.box {}:transform(3)"] = "motion = 3 has the wrong type",
      ["rapid.mesh.box {}:smooth {}"] = 'a mesh has no "smooth"',
    } do
      local message = fault(expression)
      assert.truthy(message:find(expected, 1, true), expression .. ": " .. message)
      assert.falsy(message:find("scene.lua", 1, true), message)
    end
  end)
end)
