-- arrive: moves points to a target, more slowly as they come near, and never past it.
--
--   d' = -speed            d: from the target, beyond the radius
--   d' = -speed d / radius            within it
--
-- Solved over the frame, so that a point that heads for the target follows these equations at any frame rate. Other
-- velocity falls to 1/e in the response time. A point that is faster is slowed down at the radius.
local rapid = require "rapid"

return rapid.node {
  name = "arrive",
  doc  = "Moves points to a target and slows them down before it.",
  params = {
    target   = { "vec3", default = {0, 0, 0}, unit = "m", doc = "target position" },
    speed    = { "float", default = 1, min = 1e-6, unit = "m/s", doc = "speed outside the radius" },
    radius   = { "float", default = 1, min = 1e-6, unit = "m",
                 doc = "distance from the target at which points begin to slow down" },
    response = { "float", default = 0.2, min = 1e-6, unit = "s",
                 doc = "time in which any other velocity falls to 1/e" },
  },
  points = function(p, _, params)
    local dt = p.dt
    local offset = params.target - p.P
    local d = offset:length()
    if dt <= 0 or d == 0 then return end
    local n = offset / d
    local v = (n * params.speed):lerp(p.v, math.exp(-dt / params.response))
    -- The longest way it may go: at the greater of both speeds up to the radius, then slowing down in the time left.
    local closing = v:dot(n)
    local speed, free = math.max(closing, params.speed), math.max(d - params.radius, 0)
    local inside = math.max(dt - free / speed, 0)
    local most = math.min(speed * dt, free) + (d - free) * (1 - math.exp(-params.speed / params.radius * inside))
    p.v = v + n * math.min(most / dt - closing, 0)
  end,
}
