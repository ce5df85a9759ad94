-- debris: rubble of three sizes.
local rapid = require "rapid"
local command = require "testing.command"
local json = require "dkjson"

describe("debris", function()
  local points = rapid.run("graphs/debris.lua", { frames = {84, 84} })[84]

  it("keeps its pieces apart, and above the floor", function()
    local x, y, z, r = {}, {}, {}, {}
    for i = 1, #points do
      local P = points[i].P
      x[i], y[i], z[i], r[i] = P.x, P.y, P.z, points[i].pscale
    end
    local worst = 0
    for i = 1, #x do
      assert.truthy(y[i] > 0.999 * r[i])
      for j = i + 1, #x do
        local reach = r[i] + r[j]
        local d2 = (x[i] - x[j]) ^ 2 + (y[i] - y[j]) ^ 2 + (z[i] - z[j]) ^ 2
        if d2 < reach ^ 2 then worst = math.max(worst, (reach - math.sqrt(d2)) / math.min(r[i], r[j])) end
      end
    end
    assert.truthy(worst < 0.5, worst)
  end)

  it("lets the small fall through the large", function()
    local height, count = {}, {}
    for i = 1, #points do
      local size = points[i].pscale > 0.08 and "large" or points[i].pscale < 0.03 and "small" or "middle"
      height[size] = (height[size] or 0) + points[i].P.y
      count[size] = (count[size] or 0) + 1
    end
    assert.truthy(height.small / count.small < height.middle / count.middle)
    assert.truthy(height.middle / count.middle < height.large / count.large)
  end)

  it("has a grid for each cluster, and says how well they fit", function()
    local folder = command.folder()
    command.rapid("run graphs/debris.lua -f 1-3 --quiet --stats " .. folder:file "stats.json")
    local grids = json.decode(folder:read "stats.json").frames[3].contact_grids
    table.sort(grids.points)
    assert.same({24, 220, 1400}, grids.points)
    assert.truthy(grids.excess > 0 and grids.excess < 2, grids.excess)
    assert.truthy(grids.error > 0)
  end)
end)
