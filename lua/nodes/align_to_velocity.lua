-- align_to_velocity: turns the `orient` of points to their motion: the z axis along v, the y axis towards `up`.
--
-- First comes the shortest turn of z into the direction of v, then the turn about that direction that brings y nearest
-- to `up`. A point slower than `least` keeps its orientation.
local rapid = require "rapid"

local y, z = vec3(0, 1, 0), vec3(0, 0, 1)

return rapid.node {
  name = "align_to_velocity",
  doc  = "Turns orient so that the z axis of each point follows its velocity.",
  params = {
    up    = { "vec3", default = {0, 1, 0}, doc = "direction towards which the y axis turns as far as possible" },
    least = { "float", default = 1e-6, min = 0, unit = "m/s", doc = "speed below which a point keeps its orientation" },
  },
  makes = { orient = {0, 0, 0, 1} },
  points = function(p, _, params)
    local speed = p.v:length()
    if speed < params.least or speed == 0 then return end
    local forward = p.v / speed
    local turn = rapid.math.rotation_between(z, forward)
    local side = turn:rotate(y)
    local angle = math.atan2(side:cross(params.up):dot(forward), side:dot(params.up))
    p.orient = rapid.math.rotation(forward, math.deg(angle)) * turn
  end,
}
