-- graphs/swarm.lua: the claims in its header.
describe("graphs/swarm.lua", function()
  local result = rapid.run("graphs/swarm.lua", { frames = {1, 112} })

  it("touches no pillar", function()
    for _, points in result:frames() do assert.equal(0, points:max "hittotal") end
  end)

  it("has everybody on the ring, at rest, at 4.5 s", function()
    local points = result[109]
    assert.equal(6000, #points)
    for i = 1, #points do
      local p = points[i]
      assert.near(p.goal, p.P, 1e-4)
      assert.near({0, 0, 0}, p.v, 2e-3)
      assert.is_true(p.goal.x > 2.2 and p.goal.x < 3.8)
    end
  end)
end)
