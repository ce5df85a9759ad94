-- graphs/embers.lua: the claims in its header.
describe("graphs/embers.lua", function()
  local result = rapid.run("graphs/embers.lua", { frames = {1, 120} })

  it("has no ember left that has gone out", function()
    for _, points in result:frames() do
      if #points > 0 then assert.is_true(points:min "heat" >= 0.06) end
    end
    assert.is_true(#result[120] < 900 * 119 / 24) -- some have died
  end)

  it("moves finitely, and upwards on the whole", function()
    for _, points in result:frames() do assert.points(points).finite() end
    assert.is_true(result[120]:mean("P").y > 0.3)
  end)
end)
