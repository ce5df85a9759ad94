-- mill: paddles rotate among falling grain.
local rapid = require "rapid"

describe("mill", function()
  local result = rapid.run("graphs/mill.lua", { frames = {1, 40} })

  it("lets no grain into a paddle or below the floor", function()
    local inside = 0
    for frame, points in result:frames() do
      local angle = math.rad(-120 * (frame - 1) / 24)
      for i = 1, #points do
        local P = points[i].P - vec3(0, 1.1, 0)
        local x, y = P.x * math.cos(angle) + P.y * math.sin(angle), P.y * math.cos(angle) - P.x * math.sin(angle)
        x, y = math.abs(x), math.abs(y)
        local depth = math.min(math.max(math.min(0.8 - x, 0.075 - y), math.min(0.075 - x, 0.8 - y)),
          0.4 - math.abs(P.z))
        inside = math.max(inside, depth) -- inside the boxes; their level set rounds the edges by half a voxel
      end
      if #points > 0 then assert.truthy(points:min("P").y >= 0) end
    end
    assert.truthy(inside < 0.0125, inside)
  end)

  it("lets no grain meet the edge of a paddle again and again, up to the limit of contacts", function()
    local many = rapid.run("graphs/mill.lua", { frames = {1, 20}, set = { rate = 20000 } })
    for _, warning in ipairs(many.warnings) do assert.is_nil(warning:find("reached the limit", 1, true), warning) end
  end)

  it("throws some of it up", function()
    local highest = -1e9
    for i = 1, #result[40] do highest = math.max(highest, result[40][i].v.y) end
    assert.truthy(highest > 0.5, highest)
  end)
end)
