-- Piles with the substeps that Solve chooses, and the number that it names if the given ones do not hold a pile.
local scene = require "testing.scene"
local amount = require "tests.amount"
local json = require "dkjson"

-- Returns a scene of grains of radius r on a floor. places: Lua code that fills P; solve: arguments of :solve.
local function pile(r, places, solve)
  return ([[
local r, P = %.17g, {}
%s
return rapid.create { fps = 24, points = rapid.points.from { P = P } } :attribute { pscale = r } :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.5 }
  :collide { shape = rapid.shape.plane { normal = {1, 0, 0} }, bounce = 0, friction = 0.5 }
  :contact { friction = 0.5 } :solve { %s }]]):format(r, places, solve or "")
end

-- Spheres on top of each other, next to the wall.
local function stack(r, count, solve)
  return pile(r, ("for i = 1, %d do P[i] = {1.5 * r, r * (2 * i - 1), 0} end"):format(count), solve)
end

-- A column that falls from a loose grid and collapses away from the wall.
local function column(count, solve)
  return pile(0.02, ([[
for k = 0, %d - 1 do
  local n = 7
  local i, j, layer = k %% n, math.floor(k / n) %% n, math.floor(k / n / n)
  local off, across = 0.2 * ((k * 0.754878) %% 1), 0.2 * ((k * 0.569840) %% 1)
  P[k + 1] = {2.6 * r * (i + 0.5 + off), 2.6 * r * (layer + 0.5), 2.6 * r * (j + across)}
end]]):format(count), solve)
end

-- Returns the overlaps of all touching pairs in radii, in ascending order.
local function overlaps(points, r)
  local cells, found = {}, {}
  local function key(x, y, z) return (x * 4096 + y) * 4096 + z end
  local at = {}
  for i = 1, #points do
    local P = points[i].P
    at[i] = { x = P.x, y = P.y, z = P.z }
    local x, y, z = math.floor(P.x / 2 / r), math.floor(P.y / 2 / r), math.floor(P.z / 2 / r)
    for dx = -1, 1 do for dy = -1, 1 do for dz = -1, 1 do
      for _, other in ipairs(cells[key(x + dx, y + dy, z + dz)] or {}) do
        local dist = math.sqrt((other.x - P.x) ^ 2 + (other.y - P.y) ^ 2 + (other.z - P.z) ^ 2)
        if dist < 2 * r then found[#found + 1] = (2 * r - dist) / r end
      end
    end end end
    local k = key(x, y, z)
    cells[k] = cells[k] or {}
    table.insert(cells[k], at[i])
  end
  table.sort(found)
  return found
end

local function run(text, arguments)
  local result = scene.command("run", text, "--quiet " .. arguments)
  assert.equal(0, result.status, result.stderr)
end

-- Returns the substeps of each frame after the first, which is the initial state.
local function substeps(text, last)
  run(text, ("-f 1-%d --stats stats.json"):format(last))
  local found = {}
  for _, frame in ipairs(json.decode(scene.folder:read("stats.json")).frames) do
    found[#found + 1] = frame.substeps
  end
  table.remove(found, 1)
  return found
end

-- Returns the substeps that hold a stack: h sqrt(12 N g/r).
local function needed(r, count) return math.ceil(math.sqrt(12 * count * 9.81 / r) / 24) end

local function assert_stands(r, points)
  for i = 1, #points do assert.near(2 * i - 1, points[i].P.y / r, 0.02) end
end

describe("a solve without substeps", function()
  it("takes one without contacts, or if nothing presses or moves", function()
    assert.same({ 1, 1 }, substeps(stack(0.02, 10):gsub(":contact {.-}", ""), 3))
    assert.same({ 1, 1 }, substeps(stack(0.02, 10):gsub(":gravity {}", ""), 3))
    assert.same({ 1, 1 }, substeps(stack(0.02, 10):gsub(":contact {.-}", ":distance { within = 0.05 }"), 3))
  end)

  it("takes h sqrt(12 N g/r) for a stack, and fewer with more iterations", function()
    for _, case in ipairs { { 0.02, 10 }, { 0.02, 40 }, { 0.005, 10 } } do
      assert.same({ needed(unpack(case)) }, substeps(stack(unpack(case)), 2))
    end
    local with_four = math.ceil(math.sqrt(12 * 40 * 9.81 / 0.02 / 4) / 24)
    assert.same({ with_four }, substeps(stack(0.02, 40, "iterations = 4"), 2))
    assert.same({ 7 }, substeps(stack(0.02, 40, "substeps = 7"), 2))
  end)

  it("takes at most max_substeps", function()
    assert.same({ 64 }, substeps(stack(1e-5, 10), 2))
    assert.same({ 100 }, substeps(stack(1e-5, 10, "max_substeps = 100"), 2))
  end)

  it("counts gravity that is a function of the frame", function()
    local text = stack(0.02, 10):gsub(":gravity {}", ":gravity { g = function() return {0, -9.81, 0} end }")
    assert.same({ needed(0.02, 10) }, substeps(text, 2))
  end)

  it("is bit-identical on any number of threads and in a run that is resumed", function()
    local text = column(500)
    run(text, "-f 1-16 -o one.####.csv --threads 1")
    run(text, "-f 1-16 -o three.####.csv --threads 3")
    run(text, "-f 1-10 -o resumed.####.csv --cache cache --cache-every 5")
    run(text, "-f 1-16 -o resumed.####.csv --cache cache --cache-every 5")
    local one = scene.folder:read "one.0016.csv"
    assert.equal(one, scene.folder:read "three.0016.csv")
    assert.equal(one, scene.folder:read "resumed.0016.csv")
  end)

  for _, r in ipairs { 1e-4, 0.02, 1 } do
    it(("holds a stack of five grains of %g m"):format(r), function()
      assert_stands(r, scene.run(stack(r, 5), { frames = {24, 24} })[24])
    end)
  end

  -- Four substeps leave overlaps of up to 0.97 r in the collapse, and 99 % below 0.03 r at rest.
  it("keeps overlaps below 0.25 r in a collapse, and 99 % below 0.01 r and all below 0.03 r at rest", function()
    local result = scene.run(column(amount.thorough and 4000 or 1000), { frames = {2, 48} })
    for _, points in result:frames() do
      local found = overlaps(points, 0.02)
      assert.truthy((found[#found] or 0) < 0.25, found[#found])
    end
    local found = overlaps(result[48], 0.02)
    assert.truthy(#found > 100)
    assert.truthy(found[math.ceil(0.99 * #found)] < 0.01, found[math.ceil(0.99 * #found)])
    assert.truthy(found[#found] < 0.03, found[#found])
  end)
end)

describe("too few substeps", function()
  it("are reported if grains fall through each other, with a number that holds them", function()
    local result = scene.run(stack(1e-4, 5, "substeps = 10"), { frames = {2, 4} })
    assert.truthy(result[4]:max("P").y < 3e-4) -- not 9e-4
    local said = table.concat(result.warnings, "\n")
    local number = said:match "pass through each other in 10 substeps; give (%d+) substeps"
    assert.equal(needed(1e-4, 5), tonumber(number), said)
    assert_stands(1e-4, scene.run(stack(1e-4, 5, "substeps = " .. number), { frames = {24, 24} })[24])
  end)

  local function said(solve)
    return table.concat(scene.run(column(1000, solve), { frames = {2, 48} }).warnings, "\n")
  end

  it("are reported if grains overlap, with the number that Solve would choose", function()
    local chosen = substeps(column(1000), 4)
    for _, few in ipairs { "substeps = 4", "max_substeps = 4" } do
      local text = said(few)
      assert.equal(chosen[1], tonumber(text:match "pass through each other in 4 substeps; give (%d+) substeps"), text)
      assert.near(chosen[3], tonumber(text:match "a tenth of their size; .-, otherwise (%d+) substeps"), 1)
    end
  end)

  -- Grains that fall on each other overlap by more than a tenth for a few frames, whatever the pile needs.
  it("are not named if Solve chooses them", function()
    assert.is_nil(said(""):find "%d substeps")
  end)
end)
