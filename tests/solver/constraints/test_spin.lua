-- contact { spin }: the attributes of points that turn.
local scene = require "testing.scene"

local text = [[
return rapid.create { fps = 24, points = rapid.points.from { P = { {0, 0.1, 0} }, v = { {1, 0, 0} } } }
  :gravity {} :attribute { pscale = 0.1 } :collide { shape = rapid.shape.plane {}, friction = 1, bounce = 0 }
  :contact { %s } :solve {}]]

describe("spin of contact", function()
  it("makes w and orient, which follow from each other", function()
    local result = scene.run(text:format "spin = true", { frames = {24, 25} })
    local before, after = result[24][1], result[25][1]
    assert.near({0, 0, -10 * 5 / 7}, after.w, 1e-4)
    local turned = before.orient:rotate(vec3(1, 0, 0)):dot(after.orient:rotate(vec3(1, 0, 0)))
    assert.near(math.cos(10 * 5 / 7 / 24), turned, 1e-5)
  end)

  it("makes nothing where nobody asks, and points slide to rest", function()
    local point = scene.run(text:format "", { frames = {25, 25} })[25][1]
    assert.falsy(pcall(function() return point.w end))
    assert.near({0, 0, 0}, point.v, 1e-6)
  end)

  it("begins with the w that points have", function()
    local spun = text:format("spin = true"):gsub("v = { {1, 0, 0} }", "w = { {0, 0, -70} }")
    assert.near({2, 0, 0}, scene.run(spun, { frames = {25, 25} })[25][1].v, 1e-4)
  end)

  -- A disc in y <= 0 that turns about the y axis at 3 rad/s, with these points on it.
  local function on_disc(points, contact, frames)
    return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { %s } } :gravity {} :attribute { pscale = 0.1 }
  :collide { shape = rapid.shape.box { size = {20, 1, 20}, center = {0, -0.5, 0} }, friction = 1, bounce = 0,
    transform = function(frame) return rapid.rotate({0, 1, 0}, math.deg(3 * frame.time)) end }
  :contact { spin = true, %s } :solve { substeps = 16, sleep = math.huge }]]):format(points, contact),
      { frames = {1, frames} })
  end

  -- A ball that rolls on a disc moves in a circle at 2/7 of the disc's angular velocity.
  it("rolls in circles on a disc that turns", function()
    -- Rolling: r ω = n × (v - V), V = Ω × P of the disc.
    local result = on_disc("P = {{1, 0.1, 0}}, v = {{0.5, 0, 0}}, w = {{30, 0, -5}}", "rolling = 0", 49)
    local omega, radius = 2 / 7 * 3, 0.5 / (2 / 7 * 3)
    for _, frame in ipairs { 13, 25, 49 } do
      local angle = omega * (frame - 1) / 24
      local expected = vec3(1 + radius * math.sin(angle), 0.1, -radius * (1 - math.cos(angle)))
      assert.near(expected, result[frame][1].P, 5e-3)
    end
  end)

  it("is turned by rolling friction as the disc turns, by 5/2 μ g/r", function()
    local result = on_disc("P = {{0, 0.1, 0}}", "rolling = 0.01", 61)
    for _, frame in ipairs { 13, 25, 61 } do
      assert.near({0, math.min(3, 2.5 * 0.01 * 9.81 / 0.1 * (frame - 1) / 24), 0}, result[frame][1].w, 1e-3)
    end
  end)

  -- From rest, sticking friction gives a ball on top of a turned one v = 2/7 of its surface speed.
  it("feels the speed of the surface, not that of its middle", function()
    local point = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.75, 0}} } }
  :gravity {} :attribute { pscale = 0.25 }
  :collide { shape = rapid.shape.sphere { radius = 0.5 }, friction = 1, bounce = 0,
    transform = function(frame) return rapid.rotate({0, 0, 1}, math.deg(-0.5 * frame.time)) end }
  :contact { spin = true } :solve { substeps = 16 }]], { frames = {1, 2} })[2][1]
    assert.near(2 / 7 * 0.5 * 0.5, point.v.x, 2e-3)
  end)

  it("has rolling friction only with spin", function()
    assert.match("add spin = true", scene.error(text:format "rolling = 0.1"))
    assert.match("rolling = %-1 is out of range", scene.error(text:format "spin = true, rolling = -1"))
  end)
end)
