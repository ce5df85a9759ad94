-- Points at rest on planes: lifting, and motion under a force that varies in space.
local scene = require "testing.scene"
local lehmer = require "tests.lehmer"

local function vector(x) return ("{%.17g, %.17g, %.17g}"):format(x.x, x.y, x.z) end

-- Returns the heights, after some frames, of points that lay anywhere on a plane through a random position, pulled
-- onto it by gravity and lifted by an action with a net acceleration of `net` m/s². planes: number of identical
-- planes; points near a single one go through their substep in batches.
local function lifted(net, substeps, frames, size, seed, planes)
  local random, P = lehmer.new(seed).random, {}
  local n = vec3(random() - 0.5, random() + 0.2, random() - 0.5):normalized()
  local at = size * vec3(random() - 0.5, random() - 0.5, random() - 0.5)
  for k = 1, 20 do
    local x = at + size * vec3(random() - 0.5, random() - 0.5, random() - 0.5)
    P[k] = vector(x - n:dot(x - at) * n)
  end
  local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s} } } :attribute { n = %s }
  :gravity { g = %s } :action("lift", function(p) p.force = p.force + %.17g * p.n end)
  %s :solve { substeps = %d }]]):format(table.concat(P, ", "), vector(n), vector(-9.81 * n), 9.81 + net,
    (":collide { shape = rapid.shape.plane { normal = %s, offset = %.17g }, bounce = 0.5 } "):format(vector(n),
      n:dot(at)):rep(planes or 1), substeps), { frames = {1, frames} })
  local heights = {}
  for i = 1, #result[1] do heights[i] = (result[frames][i].P - result[1][i].P):dot(result[frames][i].n) end
  return heights
end

describe("a point that rests on a plane", function()
  it("leaves it where an action lifts it by more than its weight, at any number of sub-steps", function()
    local frames = 13
    local t = (frames - 1) / 24
    for k, substeps in ipairs { 1, 4, 64, 256 } do
      for _, size in ipairs { 1, 20, 200 } do
        for planes = 1, 2 do
          local heights = lifted(1, substeps, frames, size, 7 * k, planes)
          assert.equal(20, #heights)
          for i = 1, #heights do
            -- The plane still supports it for half a substep. A frame's rounding moves it by an ulp of its position.
            local half = 0.5 / (24 * substeps)
            local height = 0.5 * t * t + 9.81 * half * (t - half / 2)
            assert.near(height, heights[i], 1e-5 + 1e-6 * size)
          end
        end
      end
    end
  end)

  it("stays if the action lifts less than its weight", function()
    for _, height in ipairs(lifted(-1, 64, 13, 20, 3)) do assert.near(0, height, 2e-5) end
  end)
end)

describe("points that turbulence drives over a plane without bounce", function()
  -- Returns positions at frame 10 of points some of which slide, take off and land.
  local function positions(substeps)
    return scene.run(([[
local P = {}
for i = 0, 99 do P[i + 1] = {i %% 10 * 0.3, i %% 3 * 0.1, math.floor(i / 10) * 0.3} end
return rapid.create { fps = 24, points = rapid.points.from { P = P } }
  :gravity {} :turbulence { amplitude = 50, size = 1 }
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.4 } :solve { substeps = %d }]]):format(substeps),
      { frames = {10, 10} })[10]
  end

  it("reach the same positions when the substeps are doubled", function()
    local differences, last = {}, positions(16)
    for k, substeps in ipairs { 32, 64, 128, 256 } do
      local now, largest = positions(substeps), 0
      for i = 1, #now do largest = math.max(largest, (now[i].P - last[i].P):length()) end
      differences[k], last = largest, now
    end
    local all = table.concat(differences, " ")
    for k = 2, #differences do assert.truthy(differences[k] < 0.4 * differences[k - 1], all) end
  end)
end)
