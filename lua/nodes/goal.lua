-- goal: each point travels to a place of its own, and is there, at rest, when its time is over.
--
--   P(u) = P + d (3u² - 2u³) + v T (u - 2u² + u³)            d = to - P;  T: the time that is left;  u = t / T
--
-- The cubic from where the point is, at its velocity, to rest at its place, is made anew at each frame: with no other
-- force it is the same each time, and what another force did in a frame before the last is made good. A kick and a
-- constant acceleration take Solve to the cubic's place and velocity at the frame's end. A force that acts in the last
-- frame, or while the point is held, moves it by a dt²/2.
local rapid = require "rapid"

return rapid.node {
  name = "goal",
  doc  = "Takes points to places of their own in a given time.",
  params = {
    to      = { "read", default = "goal", doc = "a vec3: each point's place; :assign_goals gives them out" },
    start   = { "float", default = 0, unit = "s", doc = "when the way begins" },
    time    = { "float", default = 1, min = 1e-6, unit = "s", doc = "that each point takes" },
    stagger = { "float", default = 0, min = 0, unit = "s", doc = "each begins by up to this later, at random" },
    clock   = { "string", default = "scene", choices = { "scene", "age" }, doc = "what start is counted by" },
    hold    = { "bool", default = true, doc = "points stay at their places afterwards" },
  },
  points = function(p, frame, params)
    local dt = p.dt
    local now = params.clock == "age" and p.age or frame.time - dt
    local since = now - params.start - params.stagger * p:rand(1)
    if since + dt <= 1e-4 * dt then return end -- dt is a float: a way that begins with the next frame is not begun
    local left = params.time - math.max(since, 0)
    if left <= 1e-6 * params.time and not params.hold then return end
    -- A way that begins within the frame is begun with the frame: it ends in time.
    local u = left > dt and dt / left or 1
    local P, v = p.P, p.v
    local way = (p[params.to] - P) * (u * u * (3 - 2 * u))
    local after = vec3(0, 0, 0)
    if u < 1 then
      way = way + v * (dt * (1 - u) * (1 - u))
      after = (p[params.to] - P) * (6 * u * (1 - u) / left) + v * ((1 - u) * (1 - 3 * u))
    end
    p.v = way * (2 / dt) - after
    p.force = p.force + (after - p.v) * (p.mass / dt)
  end,
}
