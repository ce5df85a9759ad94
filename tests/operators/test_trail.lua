-- :trail: where each point was, by id, through births and deaths.
local scene = require "testing.scene"

local text = [[
local rapid = require "rapid"
return rapid.create { seed = 5 }
  :emit    { source = rapid.shape.sphere { radius = 1, center = {0, 3, 0} }, rate = 200, velocity = {1, 2, 0},
             spread = 60, life = {0.1, 0.6} }
  :trail   { places = 5 }
  :gravity {}
  :collide { shape = rapid.shape.plane { offset = 2.5 }, bounce = 0.5 }
  :solve   {}]]

describe(":trail", function()
  local result = rapid.run(scene.folder:write("trail.lua", text), { frames = {1, 20} })

  it("keeps the places of the frames before, to the bit, as many as there were", function()
    local long = 0
    for frame = 2, 20 do
      local points = result[frame]
      assert.is_true(#points > 0)
      for i = 1, #points do
        local p = points[i]
        for place = 1, 5 do
          local before = frame - place >= 1 and result[frame - place]:by_id(p.id)
          if before and place < p.trailnum then assert.equal(before.P, p["trail" .. place]) end
          -- The place after the last of the frames before is that of the birth.
          if before then assert.is_true(p.trailnum >= math.min(5, place + 1)) end
        end
        if p.trailnum == 5 then long = long + 1 end
      end
    end
    assert.is_true(long > 300)
  end)

  it("begins where the point was born", function()
    local points, newborn = result[12], 0
    for i = 1, #points do
      local p = points[i]
      if not result[11]:by_id(p.id) then
        newborn = newborn + 1
        assert.equal(1, p.trailnum)
        assert.near(1, (p.trail1 - vec3(0, 3, 0)):length(), 1e-6)
      end
    end
    assert.is_true(newborn > 3)
  end)

  it("is the same on any number of threads", function()
    for _, threads in ipairs { 2, 7 } do
      local other = rapid.run(scene.folder:file "trail.lua", { frames = {20, 20}, threads = threads })
      assert.same_points(result[20], other[20])
    end
  end)

  it("refuses lengths that it can't have", function()
    for _, places in ipairs { 0, 257, 2.5 } do
      local message = scene.error(("return rapid.create {} :trail { places = %s } :solve {}"):format(places))
      assert.truthy(message:find("places = " .. places, 1, true), message)
    end
  end)
end)
