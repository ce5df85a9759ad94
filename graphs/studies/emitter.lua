-- emitter: a point that runs round a circle and leaves others along the way, compared with the circle.
--
-- Shows:  motion, the path of an emitter between frames (the paper's §3): "none" leaves points where the frame ends,
--         "linear" on a chord, "spline" on a curve that bends like the circle. The step is a frame.
-- Proves: the orders are 1, 2 and 3 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/emitter.lua -o /tmp/emitter
local rapid = require "rapid"

local rate, omega = 1000, 2 -- 1/s, rad/s
local size = 1e-7 -- m, of the emitter: below single-precision rounding

local function turning(frame) return rapid.rotate({0, 1, 0}, math.deg(omega * frame.time)) end

-- Point k is born at (k + 1) / rate, and stays there.
local function left_behind(time)
  local P = {}
  for k = 1, math.floor(rate * time + 1e-6) do P[k] = {math.cos(omega * k / rate), 0, -math.sin(omega * k / rate)} end
  return { P = P }
end

return rapid.study {
  name   = "emitter on a circle",
  scene  = function(k)
    return rapid.create { fps = k.fps }
      :emit { source = rapid.mesh.sphere { radius = size, divisions = 4, center = {1, 0, 0} }:transform(turning),
              rate = rate, birth = "even", motion = k.motion, inherit_velocity = 0 }
      :solve {}
  end,
  frames = {1, 25},
  sweep  = { motion = {"none", "linear", "spline"}, fps = {6, 12, 24, 48} },
  lines  = "motion",
  reference = function(frame) return left_behind(frame.time) end,
}
