-- graphs/snow.lua: the claims in its header.
describe("graphs/snow.lua", function()
  local function run(set) return rapid.run("graphs/snow.lua", { frames = {1, 112}, set = set }) end
  local result = run { rate = 1500 }

  -- Returns the flakes of a frame that lie above the ground, by id.
  local function lying(points)
    local list = {}
    for i = 1, #points do
      local p = points[i]
      if p.v:length() < 1e-4 and p.P.y > 0.1 then list[p.id] = p.P end
    end
    return list
  end
  local function size(list)
    local count = 0
    for _ in pairs(list) do count = count + 1 end
    return count
  end

  it("lets no flake move that lies on the still fir", function()
    local before, after = lying(result[70]), result[82]
    assert.is_true(size(before) > 300, size(before))
    for id, P in pairs(before) do assert.equal(P, after:by_id(id).P) end
  end)

  it("is shaken off by more than the adhesion", function()
    -- At a height h the fir is accelerated by up to 5° (10 π)² h sin(π t) = 86 h m/s²: above 0.8 m by 3 x 22 m/s².
    local before, after = lying(result[82]), result[112]
    local high, fallen = 0, 0
    for id, P in pairs(before) do
      if P.y > 0.8 then
        high = high + 1
        if after:by_id(id).P.y < P.y - 0.2 then fallen = fallen + 1 end
      end
    end
    assert.is_true(high > 100 and fallen > 0.9 * high, fallen .. " of " .. high)
  end)

  it("stays on whatever the motion, where it sticks fast", function()
    local fast = run { rate = 600, adhesion = 1000 }
    local before, after = lying(fast[82]), fast[112] -- at 4.625 s the fir is back in its initial position
    assert.is_true(size(before) > 100)
    for id, P in pairs(before) do assert.near(P, after:by_id(id).P, 1e-4) end
  end)
end)
