-- The radius at which points collide with shapes if :contact gives their size and :collide does not.
local scene = require "testing.scene"

-- Eight stacked spheres, at rest after two seconds; `radius` of :contact, further columns and parameters.
local function stack(contact, collide, columns)
  return scene.run(([[
local P = {}
for i = 1, 8 do P[i] = {0, 0.2 * i - 0.1, 0} end
local r = {}
for i = 1, 8 do r[i] = 0.1 end
return rapid.create { fps = 24, points = rapid.points.from { P = P, %s } }
  :gravity {} :contact { %s } :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.5, %s }
  :solve { substeps = 12 }]]):format(columns or "", contact, collide or ""), { frames = {1, 49} })[49]
end

local function same(a, b)
  for i = 1, #a do
    assert.equal(a[i].P, b[i].P)
    assert.equal(a[i].v, b[i].v)
  end
end

describe("the radius of collisions", function()
  it("is that of contacts where nothing else gives one: a stack stands as high as its spheres", function()
    for _, given in ipairs { {"radius = 0.1", ""}, {'radius = rapid.attr "r"', "r = r"} } do
      local points = stack(given[1], "", given[2])
      for i = 1, 8 do assert.near({0, 0.2 * i - 0.1, 0}, points[i].P, 0.01) end
      same(stack(given[1], "radius = 0.1", given[2]), points)
    end
  end)

  it("is the collider's own, or pscale, before that", function()
    same(stack("radius = 0.1", "radius = 0.1"), stack("radius = 0.1", "", "pscale = r"))
    local sunk = stack("radius = 0.1", "radius = 0")
    assert.near(0, sunk[1].P.y, 1e-6)
  end)

  it("is not that of a contact in whose group the point is not", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 1, 0}, {5, 1, 0}} } }
  :group { name = "grains", where = function(p) return p.id == 0 end }
  :gravity {} :contact { radius = 0.1, group = "grains" } :collide { shape = rapid.shape.plane {}, bounce = 0 }
  :solve { substeps = 4 }]], { frames = {48, 48} })[48]
    assert.near(0.1, points[1].P.y, 1e-6)
    assert.near(0, points[2].P.y, 1e-6)
  end)
end)

describe("grains that lie on a collider with their centers", function()
  it("come to rest in a stack, as those that lie on it with their surface", function()
    for _, radius in ipairs { 0, 0.005, 0.05 } do
      local result = scene.run(([[
local P = {}
for i = 0, 4 do P[i + 1] = {0, %g + 0.1 * i, 0} end
return rapid.create { fps = 24, points = rapid.points.from { P = P } } :gravity {}
  :collide { shape = rapid.shape.plane {}, radius = %g, bounce = 0 } :contact { radius = 0.05, friction = 0.5 }
  :solve { substeps = 10 }]]):format(radius, radius), { frames = {1, 96} })
      for i = 1, 5 do
        local p = result[96][i]
        assert.near(0, p.v:length(), 1e-6)
        assert.near(radius + 0.1 * (i - 1), p.P.y, 0.01 * 0.05 * i)
      end
    end
  end)
end)
