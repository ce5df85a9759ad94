-- follow_leader: points of a group follow one of their members, each at its own place in the train.
--
--   v' = (w - v) / response            w = u + (place - P) / time, at most speed
--   place = L - (distance + r1 length) û + r2 width            L, u: place and velocity of the leader
--
-- Solved over the frame with w held. r1 and r2 are the point's own numbers; its place is across û by up to width. The
-- leader is the member of `leader` with the least id, and is moved by other nodes. Without a leader nothing happens.
local rapid = require "rapid"

local function across(along, p)
  local axis = math.abs(along.y) < 0.9 and vec3(0, 1, 0) or vec3(1, 0, 0)
  local side = along:cross(axis):normalized()
  local angle, r = 2 * math.pi * p:rand(2), math.sqrt(p:rand(3))
  return (side * math.cos(angle) + along:cross(side) * math.sin(angle)) * r
end

return rapid.node {
  name = "follow_leader",
  doc  = "Makes points follow a leader.",
  params = {
    leader   = { "string", required = true, doc = "group of the leader" },
    distance = { "float", default = 0.5, min = 0, unit = "m", doc = "distance between the leader and the train" },
    length   = { "float", default = 2, min = 0, unit = "m", doc = "length of the train" },
    width    = { "float", default = 0.5, min = 0, unit = "m", doc = "radius of the train" },
    speed    = { "float", default = 5, min = 1e-6, unit = "m/s", doc = "maximum speed" },
    time     = { "float", default = 0.5, min = 1e-6, unit = "s", doc = "time in which points close up to the train" },
    response = { "float", default = 0.2, min = 1e-6, unit = "s",
                 doc = "time in which the difference of the velocity falls to 1/e" },
  },
  expand = function(input, params)
    return input
      :detail { kernel = function(points)
        local first
        for i = 1, #points do
          local p = points[i]
          if p:within(params.leader) and (not first or p.id < first.id) then first = p end
        end
        points.detail.leads = first and 1 or 0
        points.detail.leader_P = first and first.P or vec3(0, 0, 0)
        points.detail.leader_v = first and first.v or vec3(0, 0, 0)
      end }
      :points { kernel = function(p, frame)
        local detail = frame.detail
        if detail.leads == 0 or p:within(params.leader) then return end
        local u = detail.leader_v
        local speed = u:length()
        local along = speed > 1e-9 and u / speed or vec3(0, 0, 1)
        local place = detail.leader_P - along * (params.distance + params.length * p:rand(1))
          + across(along, p) * params.width
        local target = u + (place - p.P) / params.time
        local most = target:length()
        if most > params.speed then target = target * (params.speed / most) end
        p.v = target:lerp(p.v, math.exp(-p.dt / params.response))
      end }
  end,
}
