-- column: grain collapses into a heap.
local rapid = require "rapid"

local last = 84
local r = 0.02

-- Returns the slope, in degrees, of the cone with the same mean height and mean distance from its axis.
local function slope(points)
  local height, distance = 0, 0
  for i = 1, #points do
    local P = points[i].P
    height = height + P.y / #points
    distance = distance + math.sqrt(P.x ^ 2 + P.z ^ 2) / #points
  end
  return math.deg(math.atan(4 * height / (2 * distance)))
end

local function heap(set)
  return rapid.run("graphs/column.lua", { frames = {last, last}, set = set })[last]
end

describe("column", function()
  local points = heap()

  it("leaves no grain deeper in another than a tenth of its radius, nor in the floor", function()
    local x, y, z = {}, {}, {}
    for i = 1, #points do
      local P = points[i].P
      x[i], y[i], z[i] = P.x, P.y, P.z
    end
    local nearest = math.huge
    for i = 1, #x do
      for j = i + 1, #x do
        nearest = math.min(nearest, (x[i] - x[j]) ^ 2 + (y[i] - y[j]) ^ 2 + (z[i] - z[j]) ^ 2)
      end
    end
    assert.truthy(math.sqrt(nearest) > 1.9 * r, math.sqrt(nearest) / r)
    assert.truthy(points:min("P").y >= r * (1 - 1e-6))
  end)

  it("comes to rest, but for a grain in a thousand that still tumbles off its foot", function()
    local mean, moving = 0, 0
    for i = 1, #points do
      local speed = points[i].v:length()
      mean = mean + speed / #points
      if speed > 0.1 then moving = moving + 1 end -- a grain gains 0.4 m/s in a frame of free fall
    end
    assert.truthy(moving <= #points / 1000, moving)
    assert.truthy(mean < 1e-3, mean)
  end)

  it("makes a heap that friction steepens, and sub-steps do not change by 3 degrees", function()
    local steep, fine = slope(points), slope(heap { substeps = 24 })
    assert.truthy(slope(heap { friction = 0.1 }) < steep - 4)
    assert.near(steep, fine, 3)
  end)
end)
