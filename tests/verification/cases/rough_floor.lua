-- Points driven by turbulence of 50 m/s² over a rough plane without bounce, compared with a separate integration: free
-- flight, landing, Coulomb friction as a differential inclusion (Filippov), lift-off.
local scene = require "testing.scene"
local matrix = require "tests.verification.matrix"

local frames, friction, grid = 13, 0.4, "rapid.points.grid { size = {2, 0, 2}, spacing = 0.28 }"

local function run(substeps)
  return scene.run(([[
return rapid.create { fps = 24, points = %s }
  :turbulence { amplitude = 50, size = 0.8 } :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = %g } :solve { substeps = %d }]]):format(grid,
    friction, substeps), { frames = {frames, frames} })[frames]
end

-- Steps of 40 µs, each with the acceleration of its midpoint. A step is split when the point lands and when friction
-- stops it. The noise comes from kernels; the solver is inactive, as v stays 0.
local function reference()
  return scene.run(([[
local steps, mu = 1024, %g
local dt = 1 / 24 / steps

local function acceleration(P)
  return rapid.math.curl_noise(P / 0.8, 0, 3, 0) * 50 - vec3(0, 9.81, 0)
end

-- Returns position and velocity after the rest of a step on the floor.
local function slide(P, u, a, t)
  local along, most = vec3(a.x, 0, a.z), -mu * a.y
  local speed = u:length()
  if speed == 0 then
    local pull = along:length()
    if pull <= most then return P, u end
    along = along * (1 - most / pull)
  else
    along = along - u * (most / speed)
    -- The time of the least speed: u·(u + along s) = 0.
    local stop = -speed * speed / along:dot(u)
    if stop > 0 and stop < t then
      local P1, u1 = P + u * stop + along * (stop * stop / 2), u + along * stop
      if u1:length() < 0.1 * speed then return slide(P1, vec3(0, 0, 0), a, t - stop) end
    end
  end
  return P + u * t + along * (t * t / 2), u + along * t
end

return rapid.create { fps = 24, points = %s }
  :attribute { u = vec3(0, 0, 0) }
  :points("reference", function(p, frame)
    if frame.number == 1 then return end
    local P, u = p.P, p.u
    for _ = 1, steps do
      local a = acceleration(P + u * (dt / 2))
      if P.y <= 0 and u.y <= 0 and a.y <= 0 then
        P, u = slide(P, u, a, dt)
      else
        local t, Q = dt, P + u * dt + a * (dt * dt / 2)
        if Q.y < 0 then -- lands
          local root = math.sqrt(math.max(0, u.y * u.y - 2 * a.y * P.y))
          t = u.y < 0 and 2 * P.y / (root - u.y) or -(u.y + root) / a.y
          Q = P + u * t + a * (t * t / 2)
        end
        local w = u + a * t
        if t < dt then
          local across = vec3(w.x, 0, w.z)
          local speed = across:length()
          across = across * (speed > 0 and math.max(0, 1 + mu * w.y / speed) or 0)
          Q, w = slide(vec3(Q.x, 0, Q.z), across, a, dt - t)
        end
        P, u = Q, w
      end
    end
    p.P, p.u = P, u
  end) :solve {}]]):format(friction, grid), { frames = {frames, frames} })[frames]
end

local function mean_distance(a, b)
  local sum = 0
  for i = 1, #a do sum = sum + (a[i].P - b:by_id(a[i].id).P):length() / #a end
  return sum
end

return {
  {
    feature = "collide",
    law = "turbulence of 50 m/s² over a plane, bounce 0, friction 0.4, 0.5 s, 64 sub-steps: mean error",
    reference = "steps of 40 µs of its own", at_most = 1e-3, unit = "m", order = 1,
    measure = function()
      local truth, steps, errors = reference(), {}, {}
      for i, substeps in ipairs { 16, 32, 64 } do
        steps[i], errors[i] = 1 / substeps, mean_distance(run(substeps), truth)
      end
      return errors[3], matrix.order(steps, errors)
    end,
  },
}
