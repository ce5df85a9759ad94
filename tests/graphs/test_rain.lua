-- graphs/rain.lua: the claims in its header.
describe("graphs/rain.lua", function()
  local scene = require "testing.scene"
  local text = io.open("graphs/rain.lua"):read "*a":gsub("return splash.*", "return { main = rain, splash = splash }")
  local path = scene.folder:write("rain.lua", text)
  local middle = vec3(0, 0.7, 0)

  -- Returns the position on the canopy: the angle from the top, and about the axis; nil for a drop that is not on it.
  local function on_canopy(p)
    local d = p.P - middle
    if math.abs(d:length() - 1.1 - p.pscale) > 0.01 or d.y < 0.6 then return nil end
    return math.acos(d.y / d:length()), math.atan2(d.z, d.x)
  end

  it("runs down the canopy at g sin a / viscosity", function()
    local result = rapid.run(path, { frames = {1, 52}, set = { rate = 2000, viscosity = 25 } })
    local seen, rates = 0, 0
    for frame = 44, 51 do
      for i = 1, #result[frame] do
        local p = result[frame][i]
        local after = result[frame + 1]:by_id(p.id)
        local angle = on_canopy(p)
        local next_angle = after and on_canopy(after)
        -- The drop has been there so long that its initial velocity has decayed: e^(-25/s · 6/24 s) = 0.002.
        local earlier = result[frame - 6]:by_id(p.id)
        if next_angle and earlier and on_canopy(earlier) and angle > 0.15 then
          local between = 0.5 * (angle + next_angle)
          seen = seen + 1
          rates = rates + (next_angle - angle) * 24 * (1.1 + p.pscale) / (9.81 * math.sin(between) / 25)
        end
      end
    end
    assert.is_true(seen > 300, seen)
    assert.near(1, rates / seen, 0.04)
  end)

  it("is thrown off the rim when it is twirled, and as it was before", function()
    local result = rapid.run(path, { frames = {1, 90}, set = { rate = 5000 } })
    local function on(points)
      local count = 0
      for i = 1, #points do if on_canopy(points[i]) then count = count + 1 end end
      return count
    end
    -- At 3.5 s it makes 3 revolutions per second: 1440 · 1.5 / 2 degrees per second, 18.8 rad/s. 14 m/s² hold up to
    -- 0.04 m.
    local wet, spun = on(result[60]), on(result[88])
    assert.is_true(wet > 200, wet)
    assert.is_true(spun < 0.6 * wet, spun .. " of " .. wet)
  end)

  it("splashes where it hits the ground and the canopy", function()
    local result = rapid.run(path, { frames = {1, 30}, set = { rate = 2000 } })
    local splash, ground, canopy = result:output "splash"[30], 0, 0
    for i = 1, #splash do
      local P = splash[i].P
      if P.y < 0.3 then ground = ground + 1 elseif (P - middle):length() < 1.35 then canopy = canopy + 1 end
    end
    assert.is_true(ground > 100 and canopy > 10, ground .. ", " .. canopy)
  end)
end)
