-- graphs/dissolve.lua: the claims in its header.
describe("graphs/dissolve.lua", function()
  local result = rapid.run("graphs/dissolve.lua", { frames = {1, 60}, set = { count = 4000 } })
  local start = result[1]

  it("moves no point before its colour says, and each point afterwards", function()
    local early, late = 0, 0
    for frame = 10, 60, 10 do
      local time = (frame - 1) / 24
      for i = 1, #result[frame] do
        local p = result[frame][i]
        local before = start:by_id(p.id)
        if before.Cd.x * 3 > time then
          early = early + 1
          assert.equal(before.P, p.P)
          assert.is_false(p:within "loose")
        else
          assert.is_true(p:within "loose")
          if before.Cd.x * 3 < time - 0.2 then
            late = late + 1
            assert.is_true((p.P - before.P):length() > 1e-3)
          end
        end
      end
    end
    assert.is_true(early > 3000 and late > 3000)
  end)

  it("is painted as its vertices are: blue falls as red grows, green is the same", function()
    local least, most = 1, 0
    for i = 1, #start do
      local Cd = start[i].Cd
      least, most = math.min(least, Cd.x), math.max(most, Cd.x)
      assert.near(0.3, Cd.y, 1e-6)
      assert.near(0.5 - 0.4 * Cd.x, Cd.z, 1e-6)
    end
    assert.is_true(least < 0.15 and most > 0.85)
  end)

  it("removes points that have been loose for two seconds", function()
    assert.is_true(#result[60] < #start)
    for i = 1, #result[60] do
      local p = result[60][i]
      if p:within "loose" then assert.is_true(59 / 24 - start:by_id(p.id).Cd.x * 3 < 2.1) end
    end
  end)
end)
