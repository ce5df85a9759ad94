-- 343 frictionless spheres in a box with elastic walls: energy, its equipartition, and Haff's law of cooling, compared
-- with the same gas advanced event by event.
local scene = require "testing.scene"
local event_driven = require "tests.verification.event_driven"
local lehmer = require "tests.lehmer"

local side, r, half = 7, 0.05, 0.7  -- spheres along an edge; m

-- Returns spheres on a lattice, with a fixed sequence of velocities of mean speed `speed` and without total momentum.
local function start(speed)
  local P, v, random, mean, sum = {}, {}, lehmer.new(12345).random, { 0, 0, 0 }, 0
  local n = side ^ 3
  for i = 0, n - 1 do
    local cell = { i % side, math.floor(i / side) % side, math.floor(i / side ^ 2) }
    local place, velocity = {}, {}
    for k = 1, 3 do
      place[k] = (2 * half / side) * (cell[k] + 0.5) - half
      -- A normal distribution (Box and Muller).
      velocity[k] = math.sqrt(-2 * math.log(random())) * math.cos(2 * math.pi * random())
      mean[k] = mean[k] + velocity[k] / n
    end
    P[i + 1], v[i + 1] = place, velocity
  end
  for i = 1, n do
    for k = 1, 3 do v[i][k] = v[i][k] - mean[k] end
    sum = sum + math.sqrt(v[i][1] ^ 2 + v[i][2] ^ 2 + v[i][3] ^ 2) / n
  end
  for i = 1, n do
    for k = 1, 3 do v[i][k] = v[i][k] * speed / sum end
  end
  return P, v
end

local function list(values)
  local strings = {}
  for i, x in ipairs(values) do
    strings[i] = type(x) == "table" and ("{%.9g, %.9g, %.9g}"):format(unpack(x)) or ("%.9g"):format(x)
  end
  return "{" .. table.concat(strings, ", ") .. "}"
end

local function run(P, v, mass, bounce, last)
  local text = ("local chain = rapid.create { fps = 24, points = rapid.points.from { P = %s, v = %s, mass = %s } }\n")
    :format(list(P), list(v), list(mass))
  for axis = 1, 3 do
    for _, sign in ipairs { 1, -1 } do
      local normal = { 0, 0, 0 }
      normal[axis] = sign
      text = text .. ([[
chain = chain:collide { shape = rapid.shape.plane { normal = %s, offset = %.9g }, radius = %g, bounce = 1 }
]]):format(list(normal), -half, r)
    end
  end
  return scene.run(text .. ("return chain:contact { radius = %g, bounce = %g } :solve { substeps = 16 }")
    :format(r, bounce), { frames = {1, last} })
end

local function energy(points, mass)
  local sum, parts = 0, {}
  for i = 1, #points do
    local p = points[i]
    local own = mass[p.id + 1] / 2 * p.v:dot(p.v)
    sum, parts[mass[p.id + 1]] = sum + own, (parts[mass[p.id + 1]] or 0) + own
  end
  return sum, parts
end

local function equal_masses()
  local mass = {}
  for i = 1, side ^ 3 do mass[i] = 1 end
  return mass
end

local function cooling(speed)
  local bounce, mass = 0.9, equal_masses()
  local P, v = start(speed)
  local result = run(P, v, mass, bounce, 24 * 8 + 1)
  local truth = event_driven.gas { P = P, v = v, radius = r, half = half, bounce = bounce }
  local worst = 0
  for second = 1, 8 do
    truth:advance(second)
    worst = math.max(worst, math.abs(energy(result[24 * second + 1], mass) / truth:energy() - 1))
  end
  return worst
end

return {
  {
    feature = "contact", law = "343 elastic spheres in a box, 60 s: largest change of their energy",
    reference = "conservation", at_most = 0.01, long = true,
    measure = function()
      local mass = equal_masses()
      local P, v = start(1)
      local result, worst = run(P, v, mass, 1, 24 * 60 + 1), 0
      local first = energy(result[1], mass)
      for _, points in result:frames() do worst = math.max(worst, math.abs(energy(points, mass) / first - 1)) end
      return worst
    end,
  },
  {
    feature = "contact", law = "the same for 8 s, half of them of 4 kg: mean energy of the heavy by that of the light",
    reference = "equipartition", at_least = 0.8, at_most = 1.25,
    measure = function()
      local mass = equal_masses()
      for i = 1, #mass, 2 do mass[i] = 4 end
      local P, v = start(1)
      local result, heavy, light = run(P, v, mass, 1, 24 * 8 + 1), 0, 0
      for frame = 97, 193 do
        local _, parts = energy(result[frame], mass)
        heavy, light = heavy + parts[4] / 172, light + parts[1] / 171
      end
      return heavy / light
    end,
  },
  {
    feature = "contact", law = "cooling with bounce 0.9 at 1 m/s, 8 s: energy at each second",
    reference = "event by event", at_most = 0.1,
    measure = function() return cooling(1) end,
  },
  {
    feature = "contact", law = "the same at 5 m/s", reference = "event by event", at_most = 0.1,
    measure = function() return cooling(5) end,
  },
  {
    feature = "contact", law = "the same: E(t) = E0 / (1 + t/T)², T by its first second, at 8 s",
    reference = "Haff 1983", at_least = 0.9, at_most = 1.1,
    measure = function()
      local mass = equal_masses()
      local P, v = start(1)
      local result = run(P, v, mass, 0.9, 24 * 8 + 1)
      local function root(second) return math.sqrt(energy(result[1], mass) / energy(result[24 * second + 1], mass)) end
      return (root(8) - 1) / (8 * (root(1) - 1))
    end,
  },
}
