-- :interact in a chain: two points with a simple closed form; tests/solver covers its equations.
local scene = require "testing.scene"

local function two(frames, parameters, extra)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, 0, 0}}, v = {{2, 0, 0}, {0, 0, 0}} } }
  :group { name = "first", where = function(p) return p.id == 0 end }
  :interact { radius = 1e6, %s } %s :solve {}]]):format(parameters, extra or ""), { frames = {frames, frames} })[frames]
end

describe("interact", function()
  it("brings neighbours to one velocity at twice the rate of alignment, and keeps momentum", function()
    local points = two(13, "alignment = 1.5")
    assert.near({1 + math.exp(-2 * 1.5 * 0.5), 0, 0}, points[1].v, 2e-6)
    assert.near({1 - math.exp(-2 * 1.5 * 0.5), 0, 0}, points[2].v, 2e-6)
    assert.near(1, points[1].P.x + points[2].P.x, 2e-6) -- the mean continued at 1 m/s
  end)

  it("is among the points of its group", function()
    local points = two(13, 'alignment = 1.5, group = "first"')
    assert.near({2, 0, 0}, points[1].v, 0)
    assert.near({0, 0, 0}, points[2].v, 0)
  end)

  it("adds to what other forces do", function()
    local points = two(25, "alignment = 1", ":gravity {}")
    assert.near(-9.81, points[1].v.y, 1e-5)
  end)

  it("acts in every substep, together with other forces, and keeps momentum", function()
    for _, substeps in ipairs { 1, 2, 8 } do
      local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2 } }
  :points("stir", function(p, frame)
      if frame.number == 2 then p.v = vec3(p:rand(1), p:rand(2), p:rand(3)) end
    end)
  :interact { radius = 0.5, separation = 5, cohesion = 3, alignment = 2, drag = 1 }
  :drag { linear = 1.5 } :spring { target = rapid.shape.sphere { radius = 1e3, center = {0, 0, 1e3} }, stiffness = 0 }
  :solve { substeps = %d }]]):format(substeps), { frames = {2, 26} })
      local function momentum(points)
        local sum = vec3(0, 0, 0)
        for i = 1, #points do sum = sum + points[i].v end
        return sum
      end
      assert.near(momentum(result[2]) * math.exp(-1.5), momentum(result[26]), 125 * 24 * 2 ^ -22)
    end
  end)

  it("converges to the second order by its sub-steps", function()
    local function places(substeps)
      return scene.run(([[
return rapid.create { fps = 4, points = rapid.points.from { P = {{-0.3, 0, 0}, {0.3, 0, 0}, {0, 0.4, 0.1}},
    v = {{0, 0.3, 0}, {0, -0.3, 0}, {0.1, 0, 0}} } }
  :interact { radius = 2, cohesion = 2 } :collide { shape = rapid.shape.plane { offset = -5 } }
  :solve { substeps = %d }]]):format(substeps), { frames = {5, 5} })[5]
    end
    local right = places(256)
    local function off(substeps)
      local sum = 0
      for i, p in ipairs { places(substeps):by_id(0), places(substeps):by_id(1), places(substeps):by_id(2) } do
        sum = sum + (p.P - right:by_id(i - 1).P):length()
      end
      return sum
    end
    assert.near(4, off(4) / off(8), 0.5)
    assert.near(4, off(8) / off(16), 0.5)
  end)

  -- At each of the two kicks of a frame, the point that heeds the other loses half of the fraction 1 - e^(-2 k t) of
  -- the difference.
  it("is heeded by those alone that see it", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, v = {{2, 0, 0}, {1, 0, 0}} } }
  :interact { radius = 1e6, alignment = 1.5, view = 180 } :solve {}]], { frames = {13, 13} })[13]
    assert.near({1, 0, 0}, points[2].v, 0)
    assert.near({1 + ((1 + math.exp(-3 / 48)) / 2) ^ 24, 0, 0}, points[1].v, 1e-5)
  end)

  it("is with the nearest few, where `most` says so", function()
    local function speeds(parameters)
      local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}} } }
  :interact { radius = 10, separation = 1e-3]] .. parameters .. "} :solve {}", { frames = {2, 2} })[2]
      return points[1].v.x, points[2].v.x, points[3].v.x
    end
    -- Weights 0.9, 0.8 and 0.7: the share with one neighbour is 1.
    local a, b, c = speeds ", most = 1"
    assert.near(-0.9e-3 / 24, a, 1e-8)
    assert.near(0.9e-3 / 24, b, 1e-8)
    assert.near(0.8e-3 / 24, c, 1e-8)
    local x, y, z = speeds ", most = 2"
    assert.near(-1e-3 / 24, x, 1e-8) -- (0.9 + 0.7) / 1.6
    assert.near(0.1e-3 / 1.7 / 24, y, 1e-8)
    assert.near(1e-3 / 24, z, 1e-8)
  end)

  it("turns those aside that would meet, before they do", function()
    -- The nearest approach is 0.1 m, in a second: the first kick has 0.8 · 0.75 of the avoidance.
    local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {2, 0.1, 0}},
    v = {{1, 0, 0}, {-1, 0, 0}} } }
  :interact { radius = 10, avoidance = 1e-3, foresight = 4, clearance = 0.5 } :solve {}]], { frames = {2, 2} })[2]
    local kicks = 0.8 * (0.75 + 1 - 23 / 24 / 4) / 48 * 1e-3
    assert.near({1, -kicks, 0}, points[1].v, 1e-8)
    assert.near({-1, kicks, 0}, points[2].v, 1e-8)
    -- On a head-on course they choose opposite sides, and pass.
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {4, 0, 0}}, v = {{1, 0, 0}, {-1, 0, 0}} } }
  :interact { radius = 10, avoidance = 4, foresight = 3, clearance = 0.5 } :solve { substeps = 2 }]],
      { frames = {1, 73} })
    local nearest = math.huge
    for _, pair in result:frames() do nearest = math.min(nearest, (pair[1].P - pair[2].P):length()) end
    assert.truthy(nearest > 0.3, nearest)
    assert.truthy(result[73][1].P.x > result[73][2].P.x + 0.5)
  end)

  it("reports wrong arguments", function()
    assert.truthy(scene.error("return rapid.create {} :interact {} :solve {}"):find("radius", 1, true))
    assert.truthy(scene.error("return rapid.create {} :interact { radius = 1, drag = -1 } :solve {}")
      :find("drag = -1 is out of range", 1, true))
    local text = "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, mass = {0} } } " ..
      ":interact { radius = 1 } :solve {}"
    assert.truthy(scene.error(text, { frames = {1, 2} })
      :find('mass = 0 is out of range; it must be above 0', 1, true))
  end)

  it("finds neighbours within any radius, however small compared with the scene", function()
    for _, radius in ipairs { 1e-9, 1e-6, 1, 1e6 } do
      -- Two that approach within the radius, and one a hundred million times as far.
      local points = scene.run(([[
local r = %g
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {r / 2, 0, 0}, {1e8 * r, 0, 0}},
    v = {{r, 0, 0}, {-r, 0, 0}, {r, 0, 0}} } }
  :interact { radius = r, drag = 1e9 } :solve {}]]):format(radius), { frames = {2, 2} })[2]
      assert.near({0, 0, 0}, points[1].v / radius, 0.51) -- w is a half at half the radius
      assert.is_true(points[1].v.x < 0.6 * radius and points[2].v.x > -0.6 * radius)
      assert.near({1, 0, 0}, points[3].v / radius, 1e-6)
    end
  end)
end)
