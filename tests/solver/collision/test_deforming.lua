-- Colliders that deform, jump, appear and disappear.
local scene = require "testing.scene"
local command = require "testing.command"

-- Writes a box for each frame, moved by place(frame), {x, y, z}; half edges 0.5, 0.1, 0.5.
local function write_boxes(name, frames, place)
  for frame = 1, frames do
    local at, lines = place(frame), {}
    for corner = 0, 7 do
      local x, y, z = corner % 2, math.floor(corner / 2) % 2, math.floor(corner / 4)
      lines[#lines + 1] = ("v %.9g %.9g %.9g"):format(x - 0.5 + at[1], 0.2 * y - 0.1 + at[2], z - 0.5 + at[3])
    end
    for _, face in ipairs { "1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6" } do
      lines[#lines + 1] = "f " .. face
    end
    scene.folder:write(("%s.%04d.obj"):format(name, frame), table.concat(lines, "\n") .. "\n")
  end
end

local function run(collide, points, frames, more)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { %s } } %s :collide { %s } :solve {}]])
    :format(points, more or "", collide), { frames = {1, frames} })
end

describe("a sequence of files as a collider", function()
  it("drives points before it as a wall does, at any speed", function()
    for _, step in ipairs { 0.02, 0.5, 4 } do -- m per frame; it is 0.2 m thick
      write_boxes("wall", 26, function(frame) return {0, step * (frame - 1), 0} end)
      local start = 3 * step + 0.1 + step / 3
      local p = run([[bounce = 0.5,
        shape = rapid.levelset.from_mesh(rapid.mesh.read "wall.####.obj", { voxel = 0.05 })]],
        ("P = {{0.1, %.9g, 0.1}}"):format(start), 12)[12][1]
      local speed = 24 * step
      local met = (start - 0.1) / speed
      assert.near(1.5 * speed, p.v.y, 1e-3 * speed)
      assert.near(start + 1.5 * speed * (11 / 24 - met), p.P.y, 2e-3 + 1e-3 * step)
    end
  end)

  it("carries what rests on it, and keeps it on its surface", function()
    write_boxes("lift", 30, function(frame) return {0, 0.3 * math.sin(frame / 3), 0} end)
    local result = run([[bounce = 0, friction = 1,
      shape = rapid.levelset.from_mesh(rapid.mesh.read "lift.####.obj", { voxel = 0.05 })]],
      "P = {{0.1, 0.6, 0.1}}", 30, ":gravity {}")
    for frame, points in result:frames() do
      local above = points[1].P.y - 0.1 - 0.3 * math.sin(frame / 3)
      assert.truthy(above > -1e-4, ("%d: %g"):format(frame, above))
    end
  end)

  it("is moved by :transform and by transform besides", function()
    write_boxes("slow", 12, function(frame) return {0, 0.1 * frame, 0} end)
    local by_transform = run([[shape = rapid.levelset.from_mesh(rapid.mesh.read "slow.####.obj", { voxel = 0.05 }),
      transform = rapid.translate(3, 0, 0)]], "P = {{3, 0.9, 0}}", 12)
    local by_shape = run([[shape = rapid.levelset.from_mesh(rapid.mesh.read "slow.####.obj", { voxel = 0.05 })
      :transform(rapid.translate(3, 0, 0))]], "P = {{3, 0.9, 0}}", 12)
    local by_mesh = run([[shape = rapid.levelset.from_mesh(
      rapid.mesh.read("slow.####.obj"):transform(rapid.translate(3, 0, 0)), { voxel = 0.05 })]],
      "P = {{3, 0.9, 0}}", 12)
    assert.truthy(by_transform[12][1].v.y > 1)
    assert.same_points(by_transform[12], by_shape[12])
    assert.same_points(by_transform[12], by_mesh[12])
  end)

  it("has the same bits on 1, 2 and 7 threads, with any method", function()
    write_boxes("beat", 20, function(frame) return {0, 0.4 * math.sin(frame), 0} end)
    for _, method in ipairs { "continuous", "backtrack", "project" } do
      local text = ([[
return rapid.create { fps = 24, seed = 2 }
  :emit { source = rapid.mesh.box { size = {0.9, 0.1, 0.9}, center = {0, 1, 0} }, rate = 40000 } :gravity {}
  :collide { shape = rapid.levelset.from_mesh(rapid.mesh.read "beat.####.obj", { voxel = 0.04 }), friction = 0.2,
    method = %q } :solve { substeps = 2 }]]):format(method)
      local one = scene.run(text, { frames = {18, 18}, threads = 1 })[18]
      assert.points(one).finite()
      for _, threads in ipairs { 2, 7 } do
        assert.same_points(one, scene.run(text, { frames = {18, 18}, threads = threads })[18])
      end
    end
  end)

  it("names the frame where the mesh vanishes below its voxels", function()
    write_boxes("thin", 3, function() return {0, 0.025, 0} end)
    local flat = scene.folder:read("thin.0003.obj"):gsub("%-0%.075 ", "0.0249 "):gsub("0%.125 ", "0.0251 ")
    scene.folder:write("thin.0003.obj", flat)
    local message = scene.error([[
return rapid.create { fps = 24, points = two }
  :collide { shape = rapid.levelset.from_mesh(rapid.mesh.read "thin.####.obj", { voxel = 0.05 }) } :solve {}]])
    assert.truthy(message:find('scene.lua:2: node "collide1": mesh "thin.0003.obj" vanishes', 1, true), message)
  end)
end)

describe("a mesh as a collider", function()
  it("is refused, with the shape to use instead", function()
    local message = scene.error [[
return rapid.create { fps = 24, points = two } :collide { shape = rapid.mesh.box {} } :solve {}]]
    assert.truthy(message:find("use rapid.levelset.from_mesh(mesh, { voxel = 0.02 })", 1, true), message)
  end)

  it("that moves makes a level set that moves with it", function()
    local chain = [[shape = %s, bounce = 0]]
    local mesh = "rapid.mesh.box { size = {1, 0.2, 1} }"
    local motion = ":transform(function(frame) return rapid.translate(0, frame.time, 0) end)"
    local of_mesh = run(chain:format(("rapid.levelset.from_mesh(%s%s, { voxel = 0.05 })"):format(mesh, motion)),
      "P = {{0, 0.5, 0}}", 25)
    local of_set = run(chain:format(("rapid.levelset.from_mesh(%s, { voxel = 0.05 })%s"):format(mesh, motion)),
      "P = {{0, 0.5, 0}}", 25)
    assert.near(1, of_mesh[25][1].v.y, 1e-4)
    assert.same_points(of_set[25], of_mesh[25])
  end)
end)

describe("a collider that jumps", function()
  local jump = [[shape = rapid.shape.sphere { radius = 0.5 }, transform = function(frame)
    return rapid.translate(0.01 * frame.number + (frame.number > 6 and 10 or 0), 0, 0) end]]

  it("sweeps nothing along on the way, and the run says so", function()
    local result = run(jump, "P = {{5, 0, 0}, {10.2, 0, 0}}", 9)
    assert.equal(1, #result.warnings)
    assert.truthy(result.warnings[1]:find('node "collide1": the shape jumps by 10 m to frame 7, '
      .. '1e+03 times as far as in the neighbouring frames; it sweeps no points along', 1, true),
      result.warnings[1])
    local points = result[9]
    assert.near({5, 0, 0}, points[1].P, 0)
    assert.truthy((points[2].P - vec3(10.09, 0, 0)):length() >= 0.5 - 1e-5) -- out of its new position
  end)

  it("sweeps all of the way where cut = {} says that it does not jump", function()
    local points = run(jump .. ", cut = {}", "P = {{5, 0, 0}}", 9)[9]
    assert.truthy(points[1].P.x > 10, points[1].P.x)
    local message = scene.error(("return rapid.create { points = two } :collide { %s, cut = {1.5} } :solve {}")
      :format(jump))
    assert.truthy(message:find("cut has the frame 1.5; frames must be whole numbers", 1, true), message)
  end)
end)

describe("a collider that appears and vanishes", function()
  it("is there at the frames at which its function returns a shape", function()
    local result = run([[shape = (function()
      local floor = rapid.shape.plane {}
      return function(frame) if frame.number >= 5 and frame.number < 30 then return floor end end
    end)(), bounce = 0]], "P = {{0, 0.3, 0}, {0, -1, 0}}", 40, ":gravity {}")
    assert.near(-1 - 0.5 * 9.81 * (3 / 24) ^ 2, result[4][2].P.y, 1e-5)
    assert.equal(0, result[5][2].P.y) -- moved out as soon as the shape exists
    assert.equal(0, result[29][1].P.y)
    assert.near(-0.5 * 9.81 * (11 / 24) ^ 2, result[40][1].P.y, 1e-4)
  end)

  it("may not be nil for good", function()
    local message = scene.error "return rapid.create { points = two } :collide { shape = nil } :solve {}"
    assert.truthy(message:find("shape is missing", 1, true), message)
  end)
end)

-- A body of 3,334 vertices, captured from a dancer, in a folder next to the checkout if it exists.
describe("the jumper", function()
  local folder = command.shell("cd ../shared/assets/jumper && pwd").stdout:match "%S+"

  local test = folder and it or pending
  test("bears points and keeps them out of itself for 120 frames, at one sub-step", function()
    local result = scene.run(([[
local body = rapid.mesh.read "%s/jumper.####.ply"
local still = {}
for frame = 2, 120 do
  still[frame] = rapid.levelset.from_mesh(rapid.mesh.read(("%s/jumper.%%04d.ply"):format(frame)), { voxel = 0.02 })
end
return rapid.create { fps = 24, seed = 1 }
  :emit { source = body, rate = 4000, birth = "random", life = 1, speed = 0.3 }
  :gravity {}
  :collide { shape = rapid.levelset.from_mesh(body, { voxel = 0.02 }), bounce = 0.3, friction = 0.4 }
  :solve {}
  :attribute { above = 0 }
  :points("measure", function(p, frame) if frame.number > 1 then p.above = still[frame.number]:distance(p.P) end end)
]]):format(folder, folder), { frames = {1, 120} })
    local deepest = 0
    for _, points in result:frames() do
      if #points > 0 then deepest = math.min(deepest, points:min("above")) end
    end
    assert.truthy(#result[120] > 3900)
    assert.truthy(deepest > -1e-5, deepest)
  end)
end)
