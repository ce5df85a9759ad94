-- graphs/comet.lua: the claims in its header.
describe("graphs/comet.lua", function()
  local turn, emitter, rate = 60, 0.02, 24000
  local result = rapid.run("graphs/comet.lua", { frames = {1, 8}, set = { turn = turn } })

  -- Returns the points of an emitter at frame 8, in birth order, relative to the emitter's centre.
  local function trail(k)
    local points, found = result[8], {}
    for i = 1, #points do
      local P = points[i].P - vec3(2.6 * (k - 1), 0, 0)
      if P:length() < 1.3 then found[#found + 1] = { id = points[i].id, P = P } end
    end
    table.sort(found, function(a, b) return a.id < b.id end)
    return found
  end

  it("draws a circle without a gap by its spline", function()
    local points = trail(1)
    assert.equal(5 * rate / 24, #points)
    local longest = 0
    for i, p in ipairs(points) do
      assert.near(1, p.P:length(), 0.03 + emitter)
      if i > 1 then longest = math.max(longest, (p.P - points[i - 1].P):length()) end
    end
    -- Each is born at a separate place on the emitter, which moves 60 degrees / 1,000 from birth to birth.
    assert.truthy(longest < 2 * emitter + 1.2 * math.rad(turn) * 24 / rate, longest)
  end)

  it("draws the chords by straight lines", function()
    local nearest = 2
    for _, p in ipairs(trail(2)) do nearest = math.min(nearest, p.P:length()) end
    assert.near(math.cos(math.rad(turn / 2)), nearest, emitter)
  end)

  it("draws spots by none", function()
    local at = {}
    for frame = 2, 8 do
      local angle = math.rad(turn * (frame - 1))
      at[frame] = vec3(math.cos(angle), math.sin(angle), 0)
    end
    for _, p in ipairs(trail(3)) do
      local nearest = 2
      for frame = 2, 8 do nearest = math.min(nearest, (p.P - at[frame]):length()) end
      assert.truthy(nearest <= emitter + 1e-6, nearest)
    end
  end)
end)
