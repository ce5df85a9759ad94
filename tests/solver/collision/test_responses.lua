-- Points at a collider: responses, the paper's methods, and the hit attributes.
local scene = require "testing.scene"

-- A point that falls from 2 m onto the floor, at 24 frames a second.
local function fall(options, frames, after)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 2, 0}}, v = {{1, 0, 0}} } } :gravity {}
  :collide { shape = rapid.shape.plane {}, %s } %s :solve {}]]):format(options, after or ""), { frames = {1, frames} })
end

local landing = math.sqrt(2 * 2 / 9.81)
local impact = 9.81 * landing

describe("the response", function()
  it("slide takes the normal part of the velocity and leaves the other, but for friction", function()
    local points = fall("response = 'slide', bounce = 0.9", 48)[48]
    assert.equal(0, points[1].P.y)
    assert.near({1, 0, 0}, points[1].v, 1e-6)
    points = fall("response = 'slide', friction = 0.1", 17)[17]
    assert.near({1 - 0.1 * impact - 0.1 * 9.81 * (16 / 24 - landing), 0, 0}, points[1].v, 1e-5)
  end)

  it("stick holds the point where it has hit, whatever pulls", function()
    local result = fall("response = 'stick'", 96)
    assert.near({landing, 0, 0}, result[48][1].P, 1e-5)
    assert.same_points(result[48], result[96])
    -- On a ceiling, and on a level set's wall.
    local points = scene.run([[
return rapid.create { fps = 24,
    points = rapid.points.from { P = {{0, 0, 0}, {0.1, 0, 0}}, v = {{0, 9, 0}, {9, 0.5, 0}} } }
  :gravity {} :turbulence { amplitude = 20 }
  :collide { shape = rapid.shape.plane { normal = {0, -1, 0}, offset = -1 }, response = "stick" }
  :collide { shape = rapid.levelset.box { size = {1, 4, 4}, center = {2.5, 0, 0}, voxel = 0.05 }, response = "stick" }
  :solve { substeps = 2 }]], { frames = {1, 97} })
    assert.near(1, points[97][1].P.y, 1e-6)
    assert.near(2, points[97][2].P.x, 1e-5)
    assert.same_points(points[49], points[97])
  end)

  it("die ends the point's life at the contact", function()
    local result = fall("response = 'die'", 48)
    local last = 1 + math.floor(landing * 24)
    assert.equal(1, #result[last])
    assert.equal(0, #result[last + 1])
    local group = scene.run([[
return rapid.create { fps = 24, points = two } :gravity {}
  :group { name = "mortal", where = function(p) return p.id == 1 end }
  :collide { shape = rapid.shape.plane {}, response = "die", group = "mortal" } :solve { substeps = 3 }]],
      { frames = {48, 48} })[48]
    assert.equal(1, #group)
    assert.equal(0, group[1].id)
    assert.truthy(group[1].P.y < -10)
  end)
end)

describe("the method", function()
  -- Returns the largest height error, over two seconds, of a ball that bounces with 0.7.
  local function off(method, substeps)
    local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 2, 0}} } } :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.7, method = "%s" } :solve { substeps = %d }]])
      :format(method, substeps), { frames = {1, 37} })
    local worst = 0
    for frame = 1, 37 do
      local t, speed = (frame - 1) / 24, 0.7 * impact
      local y = 2 - 9.81 * t * t / 2
      if t >= landing then
        t = t - landing
        while t >= 2 * speed / 9.81 do t, speed = t - 2 * speed / 9.81, speed * 0.7 end
        y = speed * t - 9.81 * t * t / 2
      end
      worst = math.max(worst, math.abs(result[frame][1].P.y - y))
    end
    return worst
  end

  it("continuous is exact, backtrack nearly, and project converges with the step", function()
    assert.truthy(off("continuous", 1) < 1e-4)
    assert.truthy(off("backtrack", 1) < 0.02, off("backtrack", 1))
    local coarse, fine = off("project", 1), off("project", 16)
    assert.truthy(coarse > 0.1 and fine < coarse / 6, ("%g %g"):format(coarse, fine))
  end)

  it("project and backtrack leave no point below a plane, in a ball or in a level set", function()
    for _, method in ipairs { "project", "backtrack" } do
      local points = scene.run(([[
return rapid.create { fps = 24 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 3, 0} }, rate = 20000, speed = 2, life = 2 } :gravity {}
  :collide { shape = rapid.shape.sphere { radius = 1 }, method = "%s", bounce = 0.3 }
  :collide { shape = rapid.levelset.torus { radius = 2, tube = 0.4, voxel = 0.04, half_width = 8 }, method = "%s" }
  :collide { shape = rapid.shape.plane { offset = -1 }, method = "%s", bounce = 0.3 }
  :solve { substeps = 4 }]]):format(method, method, method), { frames = {40, 40} })[40]
      assert.points(points).finite()
      assert.truthy(points:min("P").y >= -1 - 1e-6)
      for i = 1, #points, 5 do assert.truthy(points[i].P:length() >= 1 - 0.02) end
    end
  end)
end)

describe("record", function()
  it("writes the last contact to the hit attributes", function()
    local result = fall("record = true, bounce = 0.5", 20, ":attribute { mass = 3 }")
    local first = result[1 + math.ceil(landing * 24)][1]
    assert.equal(1, first.hittotal)
    assert.equal(1, first.hitnum)
    assert.near({landing, 0, 0}, first.hitpos, 1e-5)
    assert.near({0, 1, 0}, first.hitnml, 0)
    assert.near({0, 0, 0}, first.hitv, 0)
    assert.near(landing, first.hittime, 1e-6)
    assert.near(3 * 1.5 * impact, first.hitimpulse, 1e-3)
    assert.equal(0, first.hitpath)
    local later = result[20][1]
    assert.equal(1, later.hittotal)
    assert.equal(0, later.hitnum)
    assert.near(landing, later.hittime, 1e-6)
    assert.equal(0, result[2][1].hittotal)
  end)

  it("skips contacts below the given speed, and names the collider", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 2, 0}, {5, 0.1, 0}} } } :gravity {}
  :collide { shape = rapid.shape.sphere { radius = 0.1, center = {9, 9, 9} } }
  :collide { shape = rapid.shape.plane {}, bounce = 0.2, record = 3 }
  :solve { substeps = 2 }]], { frames = {24, 24} })[24]
    assert.equal(1, result[1].hittotal)
    assert.equal(1, result[1].hitpath)
    assert.equal(0, result[2].hittotal)
  end)

  it("makes no attribute where nothing records", function()
    assert.falsy(pcall(function() return fall("bounce = 0.5", 3)[3][1].hittotal end))
  end)
end)

describe("a collide node", function()
  it("refuses unknown values", function()
    local function message(options)
      local text = "return rapid.create {} :collide { shape = rapid.shape.plane {}, %s } :solve {}"
      return scene.error(text:format(options))
    end
    assert.match('method = "continous" is unknown; did you mean "continuous"', message "method = 'continous'")
    assert.match('response = "bouncy"', message "response = 'bouncy'")
    assert.match('record = %-1 is out of range', message "record = -1")
    assert.match('record = "yes" has the wrong type', message "record = 'yes'")
  end)
end)
