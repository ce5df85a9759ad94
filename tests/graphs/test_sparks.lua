-- graphs/sparks.lua: the claims in its header.
describe("graphs/sparks.lua", function()
  local result = rapid.run("graphs/sparks.lua", { frames = {1, 60}, set = { rate = 1200 } })

  it("has no spark below the floor", function()
    for _, points in result:frames() do
      if #points > 0 then assert.is_true(points:min("P").y >= -1e-6) end
    end
  end)

  it("cools each spark by e in the cooling time, whenever it was born", function()
    local points = result[60]
    for i = 1, #points do
      local p = points[i]
      assert.near(math.exp(-p.age / 0.4), p.heat, 2e-6)
      assert.equal(p.heat < 0.01, p:within "cold")
    end
  end)

  it("emits them evenly: ages are multiples of 1 / rate", function()
    local points = result[8] -- before the first one dies
    assert.equal(math.floor(1200 * 7 / 24), #points)
    for i = 2, #points do assert.near(1 / 1200, points[i - 1].age - points[i].age, 1e-6) end
  end)
end)
