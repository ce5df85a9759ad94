-- graphs/morph.lua: the claims in its header.
describe("graphs/morph.lua", function()
  local result = rapid.run("graphs/morph.lua", { frames = {1, 90}, set = { count = 3000 } })

  -- The same knot in steps so fine that chords do not matter.
  local knot = {}
  for k = 1, 2000 do
    local t = 2 * math.pi * k / 2000
    local ring = 2 + math.cos(3 * t)
    knot[k] = vec3(ring * math.cos(2 * t), 3 + 1.1 * math.sin(3 * t), ring * math.sin(2 * t)) * 0.36
  end

  it("begins as a ball", function()
    local points = result[1]
    assert.equal(3000, #points)
    for i = 1, #points do assert.near(0.7, (points[i].P - vec3(0, 1.08, 0)):length(), 1e-6) end
  end)

  it("has each point at rest at its own position on the knot at 3.5 s", function()
    local points, taken = result[85], {}
    assert.equal(3000, #points)
    for i = 1, #points do
      local p = points[i]
      assert.near(p.goal, p.P, 1e-4)
      assert.near({0, 0, 0}, p.v, 5e-3)
      local place = ("%.6f %.6f %.6f"):format(p.goal.x, p.goal.y, p.goal.z)
      assert.is_nil(taken[place])
      taken[place] = true
      local near = math.huge
      for k = 1, #knot, 4 do near = math.min(near, (knot[k] - p.P):length()) end
      assert.near(0.16, near, 0.012) -- twelve sides: 0.16 cos 15°, plus the steps along the curve
    end
  end)

  it("stays there, as nothing leads a point astray that has arrived", function()
    for i = 1, 3000 do assert.near(result[85][i].P, result[90][i].P, 1e-4) end
  end)
end)
