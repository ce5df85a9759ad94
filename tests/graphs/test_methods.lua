-- graphs/methods.lua: the claims in its header.
describe("graphs/methods.lua", function()
  local methods = { "project", "backtrack", "continuous" }
  local columns, rows, apart, lane = 30, 44, 0.028, 2
  local bounce, speed, start = 0.6, 11, 1.7
  local result = rapid.run("graphs/methods.lua", { frames = {1, 14} })

  -- Returns the exact height of a row, from the parabola between its bounces.
  local function height(row, t)
    local from, g = start + apart * row, 9.81
    local meets = (math.sqrt(speed * speed + 2 * g * from) - speed) / g
    if t < meets then return from - speed * t - g * t * t / 2 end
    local u = bounce * (speed + g * meets)
    return u * (t - meets) - g * (t - meets) ^ 2 / 2
  end

  -- The largest height error of each method over all frames; level sets are flat to within rounding there.
  local off = {0, 0, 0}
  for frame, points in result:frames() do
    for i = 1, #points do
      local p = points[i]
      local row = math.floor(p.id / columns) % rows + 1
      local error = math.abs(p.P.y - height(row, (frame - 1) / 24))
      off[p.of] = math.max(off[p.of], error)
    end
  end

  it("keeps the rows apart: continuous to rounding, backtrack to a step's own fall, project not", function()
    assert.truthy(off[3] < 2e-5, off[3])
    -- The method backs up by a time on a straight line: an error of up to g h²/2, and again when the point leaves.
    assert.truthy(off[2] < (1 + bounce) * 9.81 / 24 ^ 2 / 2, off[2])
    assert.truthy(off[1] > 0.2, off[1])
  end)

  it("has the steps of figure 3 by project: many rows are one", function()
    local function levels(of)
      local seen, count = {}, 0
      for i = 1, #result[9] do
        local p = result[9][i]
        local level = math.floor(p.P.y / 1e-3 + 0.5)
        if p.of == of and not seen[level] then seen[level], count = true, count + 1 end
      end
      return count
    end
    assert.truthy(levels(1) < rows / 2, levels(1))
    assert.truthy(levels(3) > rows * 0.8, levels(3))
  end)

  it("keeps each method to its own lane", function()
    for k = 1, #methods do
      local points = result[14]:group(methods[k])
      assert.equal(columns * rows, #points)
    end
    assert.equal(2 * lane, 4)
  end)
end)
