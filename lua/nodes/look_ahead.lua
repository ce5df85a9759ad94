-- look_ahead: points see a shape that they are about to hit, and turn aside in time.
--
--   v' = 4 m n / t²            at most `strength`; the speed does not change
--
--   t    until the straight path is nearest to the shape, or deepest in it
--   m    the part of `clearance` that is missing there
--   n    out of the shape there, across the path
--
-- The path is searched in steps of the distance, at least a 24th of its length: that should be below the size of the
-- obstacles. A level set knows distances within its band only: make its half_width reach as far as `clearance`.
local rapid = require "rapid"

-- Returns a direction across `along`, for a path that meets the shape head-on: the point's own random side.
local function any_side(along, p)
  local axis = math.abs(along.y) < 0.9 and vec3(0, 1, 0) or vec3(1, 0, 0)
  return along:cross(axis):normalized() * (p:rand(1) < 0.5 and -1 or 1)
end

return rapid.node {
  name = "look_ahead",
  doc  = "Turns points aside before they hit a shape.",
  params = {
    shape     = { "shape", required = true, doc = "shape or level set" },
    time      = { "float", default = 1, min = 1e-6, unit = "s", doc = "time for which points look ahead" },
    clearance = { "float", default = 0.1, min = 0, unit = "m", doc = "distance from the surface at which points pass" },
    strength  = { "float", default = 20, min = 0, unit = "m/s²", doc = "maximum acceleration" },
  },
  points = function(p, _, params)
    local speed = p.v:length()
    if speed == 0 then return end
    local P, along = p.P, p.v / speed
    local far = speed * params.time
    local s, least, at = 0, math.huge, 0
    while s <= far do
      local d = params.shape:distance(P + along * s)
      if d < least then least, at = d, s end
      s = s + math.max(math.abs(d), far / 24)
    end
    local missing = params.clearance - least
    if missing <= 0 or at == 0 then return end
    local n = params.shape:gradient(P + along * at)
    local side = n - along * n:dot(along)
    if side:length() < 1e-3 then side = any_side(along, p) end
    local t = at / speed
    -- Near the shape, no more than the turn that brings the path to the clearance at once.
    local turn = math.min(4 * missing / (t * t), params.strength, missing / (t * p.dt)) * p.dt
    p.v = (p.v + side:normalized() * turn):normalized() * speed
  end,
}
