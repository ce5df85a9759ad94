-- graphs/dust.lua: the claims in its header.
describe("graphs/dust.lua", function()
  local scene = require "testing.scene"
  -- Dust that stays where it is born, and the pieces as a separate output.
  local text = io.open("graphs/dust.lua"):read "*a":gsub("return dust.*", [[
local born = rapid.create {}:points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = pieces, rate = rapid.attr "dust", inherit_velocity = 0 } :solve {}
return { main = born, pieces = pieces }]])
  local result = rapid.run(scene.folder:write("dust.lua", text), { frames = {1, 30} })
  local pieces = result:output "pieces"

  it("emits dust on the paths of the pieces, between their positions in two frames", function()
    local points, checked = result[30], 0
    for i = 1, #points, 7 do
      local p = points[i]
      local step = p.birthtime * 24
      local frame = math.floor(step) + 1
      local before, after = pieces[frame] and pieces[frame]:by_id(p.parent), pieces[frame + 1]:by_id(p.parent)
      if before and after then
        -- A parabola deviates from its chord by at most g dt² / 8; a bounce bends it by a fraction of v dt.
        local u = step % 1
        local far = before.v:length() / 24
        assert.is_true((p.P - before.P:lerp(after.P, u)):length() < 0.35 * far + 9.81 / 24 ^ 2 / 8, i)
        checked = checked + 1
      end
    end
    assert.is_true(checked > 500)
  end)

  it("has no gaps: along a piece's way dust is as dense as its rate says", function()
    local count, meant = 0, 0
    local points = result[30]
    for i = 1, #points do
      if points[i].birthtime > 2 / 24 and points[i].birthtime <= 12 / 24 then count = count + 1 end
    end
    for frame = 4, 13 do
      for i = 1, #pieces[frame] do meant = meant + pieces[frame][i].dust / 24 end
    end
    assert.near(meant, count, 0.01 * meant + #pieces[13])
  end)

  it("has none of pieces that lie still", function()
    local late = rapid.run("graphs/dust.lua", { frames = {110, 110} })[110]
    local moving = 0
    for i = 1, #late do if late[i].Alpha == 0 then moving = moving + 1 end end
    assert.is_true(#late < 2000, #late)
  end)
end)
