-- Scenes that repeat something small or legal so often, or make it so large, that memory, stack or time runs out: each
-- is refused with its requirement and its position.
local command = require "testing.command"

local two = "rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} } }"
local ball = "rapid.levelset.sphere { voxel = 0.2 }"

local further = "^scene%.lua:%d: a further 64 MiB of nodes, level sets, meshes and points would need about 64 MiB, " ..
  "but only %d+ MiB of 300 MiB are free; make fewer of them, or set %-%-memory\n$"

-- Scenes, in which TWO and BALL stand for the definitions above, and the error of each.
local refused = {
  -- Stack: a motion evaluates its factors, and a shape the shape that it moves.
  { [[
local s = rapid.shape.sphere {}
for i = 1, 1e5 do s = s:transform(function(f) return rapid.translate(0, f.time, 0) end) end
return TWO :collide { shape = s } :solve {}]],
    "^scene%.lua:3: :transform: a product has 1001 motions, some of which vary; at most 1000 are possible: compute " ..
      "them in one function of the frame\n$" },
  { [[
local s = rapid.shape.sphere {}
for i = 1, 1e5 do s = s:transform(rapid.translate(0, 1e-9, 0)) end
return TWO :collide { shape = s } :solve {}]],
    "^scene%.lua:3: :transform: a sphere is moved more than 1000 times; move it once, with a product of the " ..
      "motions\n$" },
  -- Chains of nodes are released one after the other, while nothing computes them.
  { [[
local c = TWO
for i = 1, 150000 do c = c:gravity {} end
error "no more"]], "^scene%.lua:4: no more\n$" },
  -- Time: each factor doubles the number of evaluations.
  { [[
local m = rapid.translate(0, 0, 0) * function(f) return rapid.translate(0, f.time, 0) end
for i = 1, 60 do m = m * m end
return TWO :collide { shape = rapid.shape.sphere {}, transform = m } :solve {}]],
    "^scene%.lua:3: rapid%.product: a product has 1024 motions" },
  -- Memory: many small allocations.
  { [[
rapid.node { name = "n0", doc = "one", expand = function(i) return i:gravity {} end }
for k = 1, 40 do
  local before = "n" .. k - 1
  rapid.node { name = "n" .. k, doc = "two", expand = function(i) return i[before](i[before](i, {}), {}) end }
end
return TWO :n40 {} :solve {}]], further },
  { "local s = BALL for i = 1, 3000 do s = s:union(BALL) end return TWO :collide { shape = s } :solve {}", further },
  { "local s = BALL for i = 1, 3000 do s = s:transform(rapid.translate(0, 1e-9, 0)) end return TWO", further },
  -- Memory: one allocation larger than the limit.
  { "return TWO :collide { shape = rapid.levelset.sphere { voxel = 0.05 } :offset(20) } :solve {}",
    "^scene%.lua:2: :offset: a level set sphere of radius 1 m with voxel = 0%.05 m would need about %d%.%d GiB" },
  { [[
local grid = rapid.grid.from { at = function(P) return P end, voxel = 0.001 }
return TWO :field { grid = grid } :solve {}]],
    "^scene%.lua:2: rapid%.grid%.from: 1e%+09 nodes would need about %d+ MiB of Lua's memory, which has 1024; give " ..
    "a larger voxel, or set %-%-script%-memory\n$" },
  { [[
local names, chain = {}, rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.01 } }
for i = 1, 300 do names[i] = "a" .. i chain = chain:attribute { ["a" .. i] = {1, 2, 3} } end
return chain:points { name = "k", writes = names, kernel = function(p) for i = 1, 300 do p["a" .. i] = p.P end end }
  :solve {}]],
    '^scene%.lua:4: node "k": 300 attributes and groups of 1000000 points would need about 3%.4 GiB, .* write ' ..
    "fewer in the kernel, or set %-%-memory" },
  { "return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.008 } } " ..
    ":contact { radius = 0.004 } :solve {}",
    '^scene%.lua:2: node "solve1": a step of 1953125 points that act on one another would need about 373 MiB' },
  -- Libraries refuse these without a helpful message.
  { [[
local names, values = {}, {}
for i = 1, 66000 do values["a" .. i], names[i] = 1, "a" .. i end
return TWO :attribute { attributes = values } :points { name = "k", kernel = function(p) end, reads = names }
  :solve {}]],
    '^scene%.lua:4: node "k": reads and writes 66001 attributes and groups; a kernel can use at most about 65000\n$' },
  { "return TWO :solve {} :rasterize { file = 'r.####.vdb', voxel = 1e-6 }",
    '^scene%.lua:2: node "rasterize1": voxel = 1e%-06 is out of range; it must be at least 2e%-05\n$' },
  { "return TWO :collide { shape = BALL :transform(rapid.scale(1e-9)) } :solve {}",
    "^scene%.lua:2: :transform: the scaled level set would have voxels of 2e%-10 m; they must be at least " ..
    "2e%-05 m\n$" },
}

local function run(folder, text, arguments)
  folder:write("scene.lua", 'local rapid = require "rapid"\n' .. text)
  return command.shell('ulimit -t 20; exec "$RAPID" run scene.lua -f 1-3 --quiet --threads 2 --memory 300M ' ..
    (arguments or ""), { cwd = folder.path })
end

describe("a scene without end", function()
  it("is refused with the memory it would take, and the line", function()
    local folder = command.folder()
    for _, case in ipairs(refused) do
      local result = run(folder, (case[1]:gsub("TWO", two):gsub("BALL", ball)))
      assert.truthy(result.status == 1 or result.status == 2, case[1] .. ": " .. result.status)
      assert.match(case[2], result.stderr)
      assert.same({ "scene.lua" }, folder:list())
    end
  end)

  it("is not refused if it frees what it allocates", function()
    local folder = command.folder()
    local shape = ("function() for i = 1, 500 do local _ = %s end return %s end"):format(ball, ball)
    local result = run(folder, ("return %s :collide { shape = %s } :solve {}"):format(two, shape))
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
  end)
end)

describe("pictures", function()
  it("that memory has no room for are refused before the first frame", function()
    local folder = command.folder()
    local scene = "return " .. two .. " :collide { shape = rapid.shape.plane {} } :solve {}"
    local result = run(folder, scene, "-o a.####.png --size 4000x4000")
    assert.equal(2, result.status)
    assert.match("^%-o a%.####%.png: pictures of 4000x4000 would need about 1%.0 GiB, but only %d+ MiB of " ..
      "300 MiB are free; give a smaller %-%-size, or set %-%-memory\n$", result.stderr)
    -- Two pictures, of which only one would fit.
    result = run(folder, scene, "-o a.####.png -o b.####.png --size 1600x1600")
    assert.match("^%-o b%.####%.png: pictures of 1600x1600 would need about 332 MiB", result.stderr)
    assert.equal(0, run(folder, scene, "-o a.####.png --size 1600x1600").status)
    -- Points alone.
    result = run(folder, "return " .. two .. " :gravity {} :solve {}", "-o a.####.png --size 4000x4000")
    assert.match("pictures of 4000x4000 would need about 366 MiB", result.stderr)
  end)
end)
