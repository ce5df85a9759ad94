-- Spinning balls: from sliding to rolling, down slopes, against rolling friction, and impacts that spin them.
local scene = require "testing.scene"

local g, r = 9.81, 0.1

-- Returns the run of one ball on a slope of this angle.
local function ball(degrees, options)
  local angle = math.rad(degrees)
  local text = [[
local n = vec3(%.9g, %.9g, 0)
return rapid.create { fps = 24, points = rapid.points.from { P = { n * 0.1 }, v = { {SPEED, 0, 0} },
    w = { {0, 0, -TURNING} } } }
  :gravity { g = {0, -9.81, 0} } :attribute { pscale = 0.1 }
  :collide { shape = rapid.shape.plane { normal = n }, friction = FRICTION, bounce = 0 }
  :contact { spin = true, rolling = ROLLING } :solve { substeps = 8 }]]
  text = text:format(math.sin(angle), math.cos(angle))
  for name, value in pairs(options) do text = text:gsub(name, ("%.9g"):format(value)) end
  return scene.run(text, { frames = {1, 97} })
end

-- Returns the largest speed error of a ball that starts sliding at 3 m/s, over two seconds.
local function sliding()
  local v, mu, worst = 3, 0.2, 0
  local result = ball(0, { SPEED = v, TURNING = 0, FRICTION = mu, ROLLING = 0 })
  for frame, points in result:frames() do
    worst = math.max(worst, math.abs(points[1].v.x - math.max(v - mu * g * (frame - 1) / 24, 5 / 7 * v)))
  end
  return worst
end

-- Returns the largest relative error of the distance that a ball from rest rolls down a slope in a second.
local function rolling()
  local worst = 0
  for _, degrees in ipairs { 5, 20, 40, 60, 80 } do
    local angle = math.rad(degrees)
    local result = ball(degrees, { SPEED = 0, TURNING = 0, FRICTION = 0.3 * math.tan(angle), ROLLING = 0 })
    local way = 5 / 7 * g * math.sin(angle) / 2
    worst = math.max(worst, math.abs((result[25][1].P - result[1][1].P):length() / way - 1))
  end
  return worst
end

-- Returns the relative error of the distance that a ball at 1 m/s rolls until rolling friction stops it.
local function stopping()
  local result = ball(0, { SPEED = 1, TURNING = 1 / r, FRICTION = 0.5, ROLLING = 0.05 })
  return math.abs(result[97][1].P.x / (7 / (10 * 0.05 * g)) - 1)
end

-- Runs a cloud of 64 spinning grains of many radii and masses that collide. Returns the largest energy gain in a frame,
-- and the largest changes of momentum and angular momentum, relative to the motion.
local measured
local function cloud()
  if measured then return measured end
  local result = scene.run([[
local P, v, w, pscale, mass = {}, {}, {}, {}, {}
local function spread(k, seed) return (k * seed) % 1 - 0.5 end
for k = 1, 64 do
  P[k] = { k % 4 * 0.3, math.floor(k / 16) * 0.3, math.floor(k / 4) % 4 * 0.3 }
  v[k] = { 1 - 2 * P[k][1] + spread(k, 0.618034), 1 - 2 * P[k][2] + spread(k, 0.414214), 1 - 2 * P[k][3] }
  w[k] = { 40 * spread(k, 0.732051), 40 * spread(k, 0.236068), 40 * spread(k, 0.645751) }
  pscale[k], mass[k] = 0.1 + 0.08 * spread(k, 0.316625), 2 ^ (4 * spread(k, 0.605551))
end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v, w = w, pscale = pscale, mass = mass } }
  :contact { spin = true, bounce = 0.5, friction = 0.5 } :solve { substeps = 8 }]], { frames = {1, 49} })
  local first, before
  measured = { energy = 0, momentum = 0, angular = 0 }
  for _, points in result:frames() do
    local now = { energy = 0, momentum = vec3(0, 0, 0), angular = vec3(0, 0, 0), size = 0 }
    for i = 1, #points do
      local p = points[i]
      local inertia = 0.4 * p.mass * p.pscale ^ 2
      now.energy = now.energy + 0.5 * p.mass * p.v:dot(p.v) + 0.5 * inertia * p.w:dot(p.w)
      now.momentum = now.momentum + p.v * p.mass
      now.angular = now.angular + p.P:cross(p.v) * p.mass + p.w * inertia
      now.size = now.size + p.mass * p.v:length()
    end
    first, before = first or now, before or now
    measured.energy = math.max(measured.energy, now.energy / before.energy - 1)
    measured.momentum = math.max(measured.momentum, (now.momentum - first.momentum):length() / first.size)
    measured.angular = math.max(measured.angular, (now.angular - first.angular):length() / first.size)
    before = now
  end
  return measured
end

return {
  {
    feature = "contact, collide", law = "spin: a ball at 3 m/s slides, then rolls at 5/7 of that: error of the speed",
    reference = "closed form", at_most = 1e-5, unit = "m/s", measure = sliding,
  },
  {
    feature = "contact, collide", law = "spin: 5/7 g sin on slopes of 5 to 80 degrees, 1 s: error of the way",
    reference = "closed form", at_most = 1e-5, measure = rolling,
  },
  {
    feature = "contact, collide", law = "spin: way until rolling friction stops a ball, v²·7/(10 μ g): error",
    reference = "Ai et al. 2011", at_most = 0.01, measure = stopping,
  },
  {
    feature = "contact", law = "spin: impacts of 64 turning grains, bounce and friction 0.5: gain of energy in a frame",
    reference = "conservation", at_most = 1e-6, measure = function() return cloud().energy end,
  },
  {
    feature = "contact", law = "the same: change of momentum", reference = "conservation", at_most = 1e-5,
    measure = function() return cloud().momentum end,
  },
  {
    feature = "contact", law = "the same: of angular momentum", reference = "conservation", at_most = 1e-4, unit = "m",
    measure = function() return cloud().angular end,
  },
}
