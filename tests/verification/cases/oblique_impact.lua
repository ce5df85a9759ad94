-- Two frictionless spheres that collide at every angle, with masses 1:1 to 1:1000, compared with the closed form.
--
-- Sphere 1 moves along x with the impact parameter b towards sphere 2, which is at rest. At the hit the line of centres
-- has the angle asin(b / 2r), and an impulse (1 + e) u / (1/m1 + 1/m2) acts along it. Pairs are far from each other,
-- and start at distances for which the hits are spread over all parts of a sub-step.
local scene = require "testing.scene"

local r, speed, pairs_of_angle, apart = 0.05, 2, 8, 3
local ratios, angles = { 1, 10, 1000 }, { 0, 15, 30, 45, 60, 75 }

local function hits()
  local list = {}
  for _, ratio in ipairs(ratios) do
    for _, angle in ipairs(angles) do
      for k = 1, pairs_of_angle do
        list[#list + 1] = { ratio = ratio, angle = math.rad(angle), y = apart * #list,
          gap = 0.2 + 0.083 * k / pairs_of_angle }
      end
    end
  end
  return list
end

local frames = 9  -- a third of a second, in which all pairs collide

-- Returns the relative errors: the largest of momentum and the largest gain of energy; and the mean position error of
-- the spheres that are hit, m.
local function run(bounce, substeps)
  local P, v, mass, list = {}, {}, {}, hits()
  for _, hit in ipairs(list) do
    local b = 2 * r * math.sin(hit.angle)
    P[#P + 1] = ("{%.9g, %.9g, 0}"):format(-2 * r * math.cos(hit.angle) - hit.gap, hit.y + b)
    P[#P + 1] = ("{0, %.9g, 0}"):format(hit.y)
    v[#v + 1], v[#v + 2] = ("{%.9g, 0, 0}"):format(speed), "{0, 0, 0}"
    mass[#mass + 1], mass[#mass + 2] = "1", ("%.9g"):format(hit.ratio)
  end
  local points = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s}, mass = {%s} } }
  :contact { radius = %.9g, bounce = %.9g } :solve { substeps = %d }]]):format(table.concat(P, ", "),
    table.concat(v, ", "), table.concat(mass, ", "), r, bounce, substeps), { frames = {frames, frames} })[frames]
  local momentum, gain, off = 0, 0, 0
  for k, hit in ipairs(list) do
    local a, b, m = points[2 * k - 1], points[2 * k], hit.ratio
    local n = vec3(math.cos(hit.angle), -math.sin(hit.angle), 0)
    local impulse = (1 + bounce) * speed * n.x / (1 + 1 / m)
    local vb = impulse / m * n
    local since = (frames - 1) / 24 - hit.gap / speed
    momentum = math.max(momentum, (a.v + m * b.v - vec3(speed, 0, 0)):length() / speed)
    gain = math.max(gain, (a.v:dot(a.v) + m * b.v:dot(b.v)) / speed ^ 2 - 1)
    off = off + ((b.P - vec3(0, hit.y, 0)) - vb * since):length() / #list
  end
  return momentum, gain, off
end

local function over_bounces(which)
  local worst = 0
  for _, bounce in ipairs { 0, 0.5, 1 } do worst = math.max(worst, (select(which, run(bounce, 16)))) end
  return worst
end

return {
  {
    feature = "contact", law = "oblique impact, masses 1:1 to 1:1000, 0 to 75 degrees: momentum",
    reference = "closed form", at_most = 1e-6,
    measure = function() return over_bounces(1) end,
  },
  {
    feature = "contact", law = "the same: largest gain of energy, of that before", reference = "conservation",
    at_most = 1e-6,
    measure = function() return over_bounces(2) end,
  },
  {
    feature = "contact", law = "the same: mean distance from the path of the one that is hit",
    reference = "closed form", at_most = 1e-4, unit = "m",
    measure = function() return (select(3, run(1, 16))) end,
  },
}
