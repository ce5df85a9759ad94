-- clumps: a body that rises out of wet sand.
local rapid = require "rapid"

-- Mean height of the sand that is above where it lay.
local function lifted(points)
  local count = 0
  for i = 1, #points do
    if points[i].P.y > 0.5 then count = count + 1 end
  end
  return count
end

describe("clumps", function()
  local wet = rapid.run("graphs/clumps.lua", { frames = {73, 73} })[73]

  it("carries sand that sticks higher than dry sand", function()
    local dry = rapid.run("graphs/clumps.lua", { frames = {73, 73}, set = { strength = 0 } })[73]
    assert.truthy(lifted(wet) > 1.2 * lifted(dry), ("%d wet, %d dry"):format(lifted(wet), lifted(dry)))
  end)

  it("lets no sand into the body or the floor", function()
    assert.truthy(wet:min("P").y >= 0.04 * 0.999)
    -- At frame 73 the body's lower sphere is at 0.75 m; its voxels are of 3 cm.
    for i = 1, #wet do assert.truthy((wet[i].P - vec3(0, 0.75, 0)):length() > 0.3 + 0.02) end
  end)
end)
