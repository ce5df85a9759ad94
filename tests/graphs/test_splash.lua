-- graphs/splash.lua: the claims in its header.
describe("graphs/splash.lua", function()
  local command = require "testing.command"
  local folder = command.folder()
  local text = io.open("graphs/splash.lua"):read "*a"
  -- Droplets stay where they are born, and the drops are a separate output.
  local body = text:gsub("return crown:merge%b()", [[
local born = rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = drops, on = "hit", min_speed = 2, count = 24, split = true, inherit_velocity = 0 } :solve {}
return born]])
  local points = rapid.run(folder:write("apart.lua", body), { frames = {1, 36} })[36]

  it("begins droplets on a surface, at the distance of the drop's radius", function()
    assert.is_true(#points > 24 * 50)
    local on_stone, on_pool = 0, 0
    for i = 1, #points do
      local P = points[i].P
      local from_stone = (P - vec3(0, 0.2, 0)):length() - 0.6 - 0.022
      local from_pool = P.y - 0.022
      assert.near(0, math.min(from_stone, from_pool), 2e-6)
      if from_pool < from_stone then on_pool = on_pool + 1 else on_stone = on_stone + 1 end
    end
    assert.is_true(on_stone > 200 and on_pool > 200)
  end)

  it("gives the droplets the mass and the volume of their drop together", function()
    local mass, volume = {}, {}
    for i = 1, #points do
      local p = points[i]
      mass[p.parent] = (mass[p.parent] or 0) + p.mass
      volume[p.parent] = (volume[p.parent] or 0) + p.pscale ^ 3
    end
    for _, sum in pairs(mass) do assert.near(4e-5, sum, 1e-10) end
    for _, sum in pairs(volume) do assert.near(0.022 ^ 3, sum, 1e-10) end
  end)

  it("emits within the frame: births occur at all moments between frames", function()
    local parts, count = {}, 0
    for i = 1, #points, 24 do
      local part = math.floor(points[i].birthtime * 24 % 1 * 8) + 1
      parts[part], count = (parts[part] or 0) + 1, count + 1
    end
    for part = 1, 8 do assert.near(count / 8, parts[part] or 0, 5 * math.sqrt(count / 8)) end
  end)
end)
