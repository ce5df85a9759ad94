-- hourglass: sand that runs through a neck.
local rapid = require "rapid"

local tube, neck, middle, r = 0.3, 0.05, 0.55, 0.01

local function passed(points)
  local count = 0
  for i = 1, #points do
    if points[i].P.y < middle then count = count + 1 end
  end
  return count
end

describe("hourglass", function()
  local result = rapid.run("graphs/hourglass.lua", { frames = {1, 72} })

  it("lets through as much in each half second, however little is left above", function()
    local first = passed(result[48]) - passed(result[36])
    for f = 60, 72, 12 do
      local now = passed(result[f]) - passed(result[f - 12])
      assert.truthy(now > 0.75 * first and now < 1.3 * first, ("%d, then %d"):format(first, now))
    end
  end)

  it("lets no sand into the glass", function()
    local deepest = 0
    for _, points in result:frames() do
      for i = 1, #points do
        local P = points[i].P
        local across = math.sqrt(P.x ^ 2 + P.z ^ 2) - (tube + neck)
        deepest = math.max(deepest, tube + r - math.sqrt(across ^ 2 + (P.y - middle) ^ 2))
      end
    end
    assert.truthy(deepest < 0.002, deepest) -- the level set's voxels measure 15 mm
  end)
end)
