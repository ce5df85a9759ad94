-- Unusual setups of colliders and points that nevertheless occur in practice.
local scene = require "testing.scene"

local function run(chain, points, frames, options)
  local given = { frames = {1, frames} }
  for name, value in pairs(options or {}) do given[name] = value end
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { %s } } %s :solve {}]]):format(points, chain), given)
end

describe("a shell of four voxels", function()
  -- They cross it about 2,300 times per frame.
  it("keeps in points of up to 10^5 m/s, with their speed", function()
    local result = scene.run([[
local voxel = 0.05
local shell = rapid.levelset.sphere { radius = 1 + 4 * voxel, voxel = voxel }
  :subtract(rapid.levelset.sphere { radius = 1, voxel = voxel })
return rapid.create { fps = 24, seed = 1 }
  :emit { source = rapid.mesh.sphere { radius = 0.5 }, impulse = { [1] = 40 }, speed = 1e5, spread = 180 }
  :collide { shape = shell, bounce = 1 } :solve {}]], { frames = {1, 3} })
    assert.same({}, result.warnings)
    for i = 1, 40 do
      assert.truthy(result[3][i].P:length() <= 1.001, tostring(result[3][i].P))
      assert.near(1e5, result[3][i].v:length(), 10)
    end
  end)
end)

describe("a paddle that turns by 40 degrees a frame", function()
  for _, shape in ipairs { "rapid.levelset.box { size = {2, 0.16, 1}, center = {1.2, 0, 0}, voxel = 0.04 }",
    "rapid.shape.box { size = {2, 0.16, 1}, center = {1.2, 0, 0} }" } do
    it("sweeps up every point in its way: " .. shape:match "rapid%.%w+%.%w+", function()
      -- In one turn of 9 frames it passes all positions between its ends.
      local places = {}
      for i = 0, 199 do
        local angle, r = 2 * math.pi * ((i * 0.618034) % 1), 0.45 + 1.5 * i / 199
        if math.abs(math.sin(angle) * r) > 0.09 or math.cos(angle) < 0 then -- not inside at first
          places[#places + 1] = ("{%.9g, %.9g, %.9g}"):format(r * math.cos(angle), r * math.sin(angle),
            0.8 * ((i * 0.7548) % 1 - 0.5))
        end
      end
      local result = run((":collide { shape = %s, bounce = 0.2, record = true, transform = function(frame) "
        .. "return rapid.rotate({0, 0, 1}, 40 * 24 * frame.time) end }"):format(shape),
        "P = {" .. table.concat(places, ", ") .. "}", 10)
      for i = 1, #places do
        local p = result[10][i]
        assert.truthy(p.hittotal > 0, ("%d, from %s"):format(p.id, places[i]))
      end
    end)
  end
end)

describe("a level set's cube", function()
  local cube = ":collide { shape = rapid.levelset.box { size = {2, 2, 2}, voxel = 0.1 }, bounce = 0.5, friction = 0.2 }"

  it("is met at its corner and along its edge, at any speed", function()
    for _, speed in ipairs { 1, 1e3, 1e6 } do
      local result = run(cube, ("P = {{2, 2, 2}, {2, 2, 0.3}}, v = {{%g, %g, %g}, {%g, %g, 0}}"):format(-speed, -speed,
        -speed, -speed, -speed), 49)
      for _, points in result:frames() do
        for i = 1, 2 do
          local P = points[i].P
          assert.truthy(math.max(P.x, P.y, P.z) > 0.93, tostring(P)) -- it rounds corners by less than a voxel
        end
      end
      -- It returns along the same path, by the symmetry of the field, slowed by the bounce.
      if speed == 1 then
        assert.near({-0.5, -0.5, -0.5}, -result[49][1].v, 0.02)
        assert.near({-0.5, -0.5, 0}, -result[49][2].v, 0.02)
      end
    end
  end)

  it("holds points that lie exactly on it, bit-identical", function()
    local points = run(":gravity {} " .. cube, "P = {{0, 1, 0}, {1, 0, 0}, {0.5, 1, 0.5}}", 25)
    assert.equal(1, points[25][1].P.y)
    assert.equal(0.5, points[25][3].P.x)
    local free = run(cube, "P = {{0, 1, 0}, {1, 0, 0}, {1, 1, 1}}", 25)
    assert.same_points(free[1], free[25])
  end)

  it("lets out what is born at its centre, on its medial planes and in its corners, without giving it speed", function()
    local result = run(":gravity {} " .. cube,
      "P = {{0, 0, 0}, {0.5, 0.5, 0}, {0, 0.9, 0.9}, {0.97, 0.97, 0.97}, {0.3, 0, 0}}", 3)
    for i = 1, 5 do
      local p = result[3][i]
      assert.truthy(math.max(math.abs(p.P.x), math.abs(p.P.y), math.abs(p.P.z)) > 0.93, tostring(p.P))
      assert.truthy(p.v:length() <= 9.81 * 2 / 24 + 1e-5)
    end
    assert.same({}, result.warnings)
  end)
end)

describe("a method that puts points back", function()
  it("finds the way out as deep as a step has taken them, whatever band the level set came with", function()
    for _, method in ipairs { "project", "backtrack" } do
      local points = run((":collide { shape = rapid.levelset.box { size = {2, 2, 2}, voxel = 0.05 }, method = %q, "
        .. "bounce = 0.5 }"):format(method), "P = {{0, 1.5, 0}}, v = {{0, -24, 0}}", 2)
      assert.near(12, points[2][1].v.y, 1e-4)
      -- It moves 1 m per frame, and meets the cube in the middle of the frame.
      assert.near(method == "project" and 1 or 1.25, points[2][1].P.y, 1e-4)
    end
  end)
end)

describe("a level set's ball", function()
  it("lets out what is born at its centre, with and without a pull", function()
    local ball = ":collide { shape = rapid.levelset.sphere { radius = 1, voxel = 0.05 } }"
    for _, chain in ipairs { ball, ":gravity {} " .. ball } do
      local result = run(chain, "P = {{0, 0, 0}, {0, 0, 0}}, v = {{0, 0, 0}, {1e-3, 0, 0}}", 4)
      for i = 1, 2 do assert.truthy(result[4][i].P:length() > 0.999, tostring(result[4][i].P)) end
      assert.same({}, result.warnings)
    end
  end)
end)

describe("a level set's block", function()
  it("lets out what is born deep inside on a stiff, damped spring", function()
    local result = run(":spring { stiffness = 4e6, damping = 0.048, target = {0, 0.3, 0} } " ..
      ":collide { shape = rapid.levelset.box { size = {2, 2, 2}, voxel = 0.05 } }",
      "P = {{0.4, 0.3, 0.2}}, v = {{-2, 3, 1}}, mass = {1e-5}", 9)
    for frame = 2, 9 do
      local P = result[frame][1].P
      assert.truthy(math.max(math.abs(P.x), math.abs(P.y), math.abs(P.z)) > 0.99 and P:length() < 5, tostring(P))
    end
  end)
end)

describe("a level set's ball that moves", function()
  it("lets out what is deep inside, beyond its band, at its surface", function()
    local result = run(":collide { shape = rapid.levelset.sphere { radius = 1, voxel = 0.05 }, "
      .. "transform = function(frame) return rapid.translate(12 * frame.time, 0, 0) end }",
      "P = {{0.01, 0.02, 0.03}}", 2)
    local r = (result[2][1].P - vec3(12 / 24, 0, 0)):length()
    assert.truthy(r > 0.999 and r < 1.6, tostring(r)) -- plus a bounce
  end)
end)

describe("a mesh that is inside out", function()
  it("is reported, and keeps points out as it would the right way round", function()
    -- A tetrahedron whose faces point inwards.
    local faces = { "{{1, 2, 3}, {1, 3, 4}, {1, 4, 2}, {2, 4, 3}}", "{{1, 3, 2}, {1, 4, 3}, {1, 2, 4}, {2, 3, 4}}" }
    local results = {}
    for k, list in ipairs(faces) do
      results[k] = scene.run(([[
local body = rapid.mesh.from { points = {{0, 0, 0}, {2, 0, 0}, {0, 0, 2}, {0, 2, 0}}, faces = %s }
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.4, 3, 0.4}, {0.9, 2, 0.2}} } } :gravity {}
  :collide { shape = rapid.levelset.from_mesh(body, { voxel = 0.05 }) } :solve {}]]):format(list), { frames = {1, 25} })
    end
    local warned = {}
    for k = 1, 2 do warned[k] = table.concat(results[k].warnings, "\n"):find("is inside out", 1, true) ~= nil end
    assert.truthy(warned[1] ~= warned[2])
    assert.same_points(results[1][25], results[2][25])
  end)
end)

describe("a ball at rest", function()
  -- The voxels at the edge of a band have next to no gradient, which says nothing about the distance.
  it("gives what is born anywhere in it no energy, and moves it no farther than to its surface", function()
    for _, ball in ipairs {"rapid.shape.sphere { radius = 1 }", "rapid.levelset.sphere { radius = 1, voxel = 0.05 }",
                           "rapid.levelset.sphere { radius = 1, voxel = 0.05, center = {0, 0, 0} }:offset(0.0)"} do
      local result = scene.run(([[
return rapid.create { fps = 24 } :emit { source = rapid.shape.sphere { radius = 0.99 }, from = "volume",
    impulse = { [2] = 2000 } } :collide { shape = %s } :solve {}]]):format(ball), { frames = {1, 3} })
      assert.equal(2000, #result[3])
      for i = 1, 2000 do
        local p = result[3][i]
        assert.near(1, p.P:length(), 2e-3)
        assert.near(0, p.v:length(), 1e-6)
      end
    end
  end)
end)
