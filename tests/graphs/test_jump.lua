-- graphs/jump.lua: the claims in its header.
describe("graphs/jump.lua", function()
  local scene = require "testing.scene"
  local text = io.open("graphs/jump.lua"):read "*a":gsub("return splash.*", "return { main = splash, drops = drops }")
  local result = rapid.run(scene.folder:write("jump.lua", text), { frames = {1, 60} })
  local drops = result:output "drops"

  it("has drops that ride on the figure, up and down", function()
    local top, riding = drops[11], 0 -- 0.42 s after the start: the top of the first hop
    for i = 1, #top do
      -- Drops that ride along have almost no velocity there except that of the rotation.
      if math.abs(top[i].v.y) < 0.3 and top[i].P.y > 0.6 then riding = riding + 1 end
    end
    assert.is_true(riding > 300, riding)
  end)

  it("begins droplets on the floor, at their drops' radius", function()
    local born, count = {}, 0
    for frame = 2, 60 do
      for i = 1, #result[frame] do
        local p = result[frame][i]
        if not born[p.id] then born[p.id], count = true, count + 1 end
        assert.is_true(p.P.y > 0)
      end
    end
    assert.is_true(count > 500, count)
  end)
end)
