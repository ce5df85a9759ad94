-- clumps: a body that rises out of wet sand.
local rapid = require "rapid"

-- Counts the grains above the initial height of the sand.
local function lifted(points)
  local count = 0
  for i = 1, #points do
    if points[i].P.y > 0.5 then count = count + 1 end
  end
  return count
end

local function after_rising(seed, strength)
  local set = { strength = strength }
  return rapid.run("graphs/clumps.lua", { frames = {73, 73}, seed = seed, set = set })[73]
end

describe("clumps", function()
  local wet = after_rising(1)

  -- How a pile tears is chance: the scene's own bonds carry 7 to 59 grains, bonds of four times their strength 40 to
  -- 73, and 8 to 17 dry grains lie on the head.
  it("carries sand that sticks higher than dry sand", function()
    local sticky, loose = 0, 0
    for seed = 1, 3 do
      sticky = sticky + lifted(after_rising(seed, 40))
      loose = loose + lifted(after_rising(seed, 0))
    end
    assert.truthy(sticky > 2 * loose, ("%d wet, %d dry"):format(sticky, loose))
  end)

  it("lets no sand into the body or the floor", function()
    assert.truthy(wet:min("P").y >= 0.04 * 0.999)
    -- At frame 73 the body's lower sphere is at 0.75 m; its voxels measure 3 cm.
    for i = 1, #wet do assert.truthy((wet[i].P - vec3(0, 0.75, 0)):length() > 0.3 + 0.02) end
  end)
end)
