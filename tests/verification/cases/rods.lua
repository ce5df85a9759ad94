-- Free rods without forces: a spinning dumbbell, two rods with a light hub, chains with masses over three decades.
-- Energy and angular momentum are conserved.
local scene = require "testing.scene"
local lehmer = require "tests.lehmer"

-- Returns, over all frames, the largest gain and loss of energy relative to the first frame, and the largest relative
-- change of angular momentum.
local function changes(result)
  local first_energy, first_spin, gain, loss, turn = nil, nil, 0, 0, 0
  for _, points in result:frames() do
    local energy, spin = 0, vec3(0, 0, 0)
    for i = 1, #points do
      local p = points[i]
      energy, spin = energy + p.mass / 2 * p.v:dot(p.v), spin + p.mass * p.P:cross(p.v)
    end
    first_energy, first_spin = first_energy or energy, first_spin or spin
    gain, loss = math.max(gain, energy / first_energy - 1), math.max(loss, 1 - energy / first_energy)
    turn = math.max(turn, (spin - first_spin):length() / first_spin:length())
  end
  return { gain = gain, loss = loss, turn = turn }
end

local substeps = 4
local omega = 0.2 * 24 * substeps  -- 1/s: a fifth of a radian per sub-step

local function dumbbell()
  return changes(scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{-0.5, 0, 0}, {0.5, 0, 0}},
    v = {{0, %g, 0}, {0, %g, 0}}, mass = {1, 1} } }
  :distance { pairs = {{1, 2}} } :solve { substeps = %d }]]):format(-omega / 2, omega / 2, substeps),
    { frames = {1, 241} }))
end

-- Two masses of 1 kg separate until the rods are straight, and the hub between them is flung to the other side. The
-- hub's initial velocity is the one that both rods allow. Returns the worst of several speeds for each measure.
local function light_hub(count)
  local worst = { gain = 0, loss = 0, turn = 0 }
  for _, speed in ipairs { 1, 3, 10 } do
    local ends, v = { vec3(-0.5, 0, 0), vec3(0.7, 0, 0) }, { speed * vec3(-1, 0.3, 0), speed * vec3(0.6, -0.2, 0) }
    local a, b = ends[1] - vec3(0, 0.6, 0), ends[2] - vec3(0, 0.6, 0)
    local x, y, cross = a:dot(v[1]), b:dot(v[2]), a.x * b.y - a.y * b.x
    local hub = vec3((x * b.y - y * a.y) / cross, (y * a.x - x * b.x) / cross, 0)
    local one = changes(scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{-0.5, 0, 0}, {0, 0.6, 0}, {0.7, 0, 0}},
    v = {{%.9g, %.9g, 0}, {%.9g, %.9g, 0}, {%.9g, %.9g, 0}}, mass = {1, 0.001, 1} } }
  :distance { pairs = {{1, 2}, {2, 3}} } :solve { substeps = %d }]]):format(v[1].x, v[1].y, hub.x, hub.y, v[2].x,
      v[2].y, count), { frames = {1, 241} }))
    for name in pairs(worst) do worst[name] = math.max(worst[name], one[name]) end
  end
  return worst
end

-- Twenty chains of five rods each, far apart. Returns the worst for each measure. Initial velocities are consistent
-- with the rods: each chain rotates and translates as a whole.
local function chains()
  local worst, random = { gain = 0, loss = 0, turn = 0 }, lehmer.new(99).random
  for _ = 1, 20 do
    local P, v, mass, links, at = {}, {}, {}, {}, vec3(0, 0, 0)
    local spin = vec3(random() - 0.5, random() - 0.5, random() - 0.5) * 6
    for i = 1, 6 do
      local speed = spin:cross(at)
      P[i] = ("{%.9g, %.9g, %.9g}"):format(at.x, at.y, at.z)
      v[i] = ("{%.9g, %.9g, %.9g}"):format(speed.x, speed.y, speed.z)
      mass[i] = ("%.9g"):format(10 ^ (3 * random() - 1.5))
      if i > 1 then links[i - 1] = ("{%d, %d}"):format(i - 1, i) end
      at = at + vec3(random() - 0.5, random() - 0.5, random() - 0.5):normalized() * 0.5
    end
    local one = changes(scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s}, mass = {%s} } }
  :distance { pairs = {%s} } :solve { substeps = 16 }]]):format(table.concat(P, ", "), table.concat(v, ", "),
      table.concat(mass, ", "), table.concat(links, ", ")), { frames = {1, 121} }))
    for name in pairs(worst) do worst[name] = math.max(worst[name], one[name]) end
  end
  return worst
end

return {
  {
    feature = "distance", law = "free dumbbell, 0.2 rad a sub-step, 10 s: largest change of energy",
    reference = "conservation", at_most = 1e-3,
    measure = function() local c = dumbbell() return math.max(c.gain, c.loss) end,
  },
  {
    feature = "distance", law = "the same: of angular momentum", reference = "conservation", at_most = 1e-3,
    measure = function() return dumbbell().turn end,
  },
  {
    feature = "distance", law = "two rods, hub of 0.001 of the ends, 10 s: largest gain of energy, 4 and 16 sub-steps",
    reference = "conservation", at_most = 1e-5,
    measure = function() return math.max(light_hub(4).gain, light_hub(16).gain) end,
  },
  {
    feature = "distance", law = "the same, 16 sub-steps: loss in 10 s", reference = "conservation", at_most = 0.1,
    measure = function() return light_hub(16).loss end,
  },
  {
    feature = "distance", law = "chains of five rods, masses over three decades, 5 s: largest gain of energy",
    reference = "conservation", at_most = 1e-5,
    measure = function() return chains().gain end,
  },
  {
    feature = "distance", law = "the same: loss in 5 s", reference = "conservation", at_most = 0.05,
    measure = function() return chains().loss end,
  },
}
