-- graphs/fireworks.lua: the claims in its header.
describe("graphs/fireworks.lua", function()
  local command = require "testing.command"
  local folder = command.folder()
  local text = io.open("graphs/fireworks.lua"):read "*a"
  -- The chains separately, with all children left where they are born.
  local body = text:gsub("return sparks:merge%b()", [[
local still = rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = shells, on = "death", inherit_velocity = 0 } :solve {}
local trail = rapid.create { fps = 24 } :points("read_trail", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = stars, rate = 160, birth = "even", inherit_velocity = 0 } :solve {}
return { main = still, trail = trail, stars = stars }]])
  local path = folder:write("apart.lua", body)

  it("bursts each shell at the end of its life, on its parabola", function()
    local result = rapid.run(path, { frames = {1, 48}, set = { stars = 5 } })
    local lives = {1.5, 1.75, 1.6, 1.3}
    local P = {vec3(-6, 0, 0), vec3(0, 0, -3), vec3(6, 0, 1), vec3(-2, 0, 2)}
    local v = {vec3(-0.8, 15.5, 0), vec3(0, 17.5, 0), vec3(1, 16, 0), vec3(0.4, 13, 0)}
    assert.equal(4, #result[48])
    for i = 1, 4 do
      local p = result[48][i]
      local k = p.parent + 1
      local t = lives[k]
      assert.near(t, p.birthtime, 1e-6)
      assert.near(P[k] + v[k] * t - vec3(0, 0.5 * 9.81 * t * t, 0), p.P, 2e-5)
    end
  end)

  it("draws streams along the stars without beads: gaps of a trail follow its speed", function()
    local result = rapid.run(path, { frames = {1, 52}, set = { stars = 3 } })
    local trail, last = result:output "trail"[52], {}
    local gaps = 0
    for i = 1, #trail do
      local p = trail[i]
      local before = last[p.parent]
      if before then
        gaps = gaps + 1
        assert.near(1 / 160, p.birthtime - before.birthtime, 2e-6)
        local gap = (p.P - before.P):length()
        -- 6.5 m/s at first, with a drag of 0.9/s and gravity, which limit the difference between any two gaps.
        if before.gap then assert.near(before.gap, gap, 0.002 * before.gap + (0.9 * 8 + 9.81) / 160 ^ 2) end
        last[p.parent] = { birthtime = p.birthtime, P = p.P, gap = gap }
      else
        last[p.parent] = { birthtime = p.birthtime, P = p.P }
      end
    end
    assert.is_true(gaps > 500)
  end)
end)
