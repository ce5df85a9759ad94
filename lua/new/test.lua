-- NAME.lua: what must stay true of it.
describe("NAME", function()
  local result = rapid.run("NAME.lua", { frames = {1, 48}, set = { rate = 500 } })

  it("emits its drops at the given rate", function()
    assert.equal(math.floor(500 * 23 / 24), #result[24])
  end)

  it("stays finite and above the floor", function()
    for _, points in result:frames() do
      assert.points(points).finite()
      assert.points(points).outside(function(P) return P.y end, 1e-5)
    end
  end)
end)
