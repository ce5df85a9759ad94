-- Compliant rows as springs: two stretched masses, compared with the cosine for their reduced mass, and a weight
-- released on a compliant pin.
local scene = require "testing.scene"
local matrix = require "tests.verification.matrix"

local m1, m2, compliance, rest, stretch = 1, 3, 1e-2, 1, 0.1
local omega = math.sqrt((1 / m1 + 1 / m2) / compliance)
local frames = 25

local function lengths(substeps, first, last)
  local result, list = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {%.9g, 0, 0}}, mass = {%g, %g} } }
  :distance { pairs = {{1, 2}}, rest = %g, compliance = %g } :solve { substeps = %d, sleep = math.huge }]])
    :format(rest + stretch, m1, m2, rest, compliance, substeps), { frames = {first, last} }), {}
  for frame = first, last do list[frame] = (result[frame][1].P - result[frame][2].P):length() - rest end
  return list
end

-- Returns the largest error of the stretch in a second, relative to the initial stretch.
local function error_of(substeps)
  local list, worst = lengths(substeps, 1, frames), 0
  for frame = 1, frames do
    worst = math.max(worst, math.abs(list[frame] / stretch - math.cos(omega * (frame - 1) / 24)))
  end
  return worst
end

return {
  {
    feature = "distance",
    law = "compliant link of 1 and 3 kg, 11.5 rad/s, 1 s, 16 sub-steps: error of the stretch, of the first",
    reference = "cosine", at_most = 0.05, order = 2,
    measure = function()
      local steps, errors = {}, {}
      for i, substeps in ipairs { 8, 16, 32, 64 } do steps[i], errors[i] = 1 / substeps, error_of(substeps) end
      return errors[2], matrix.order(steps, errors)
    end,
  },
  {
    feature = "distance", law = "the same: rate at which it decays, undamped", reference = "cosine", unit = "1/s",
    at_least = -1e-3, at_most = 1e-3,
    measure = function()
      local list, early, late = lengths(16, 1, 241), 0, 0
      for frame = 1, 24 do early, late = math.max(early, list[frame]), math.max(late, list[frame + 216]) end
      return math.log(early / late) / 9
    end,
  },
  {
    feature = "pin", law = "2 kg let go on a compliant pin, 10 rad/s, 1 s, 16 sub-steps: error, of the way down",
    reference = "cosine", at_most = 0.05, order = 2,
    measure = function()
      local mass, give, g, steps, errors = 2, 5e-3, 9.81, {}, {}
      for i, substeps in ipairs { 8, 16, 32, 64 } do
        local result, worst = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.3, -0.2, 0.5}}, mass = {%g} } }
  :gravity { g = {0, -%g, 0} } :pin { compliance = %g } :solve { substeps = %d, sleep = math.huge }]]):format(mass, g,
          give, substeps), { frames = {1, frames} }), 0
        for frame = 1, frames do
          local expected = mass * g * give * (math.cos((frame - 1) / 24 / math.sqrt(mass * give)) - 1)
          local off = result[frame][1].P - vec3(0.3, -0.2 + expected, 0.5)
          worst = math.max(worst, off:length() / (2 * mass * g * give))
        end
        steps[i], errors[i] = 1 / substeps, worst
      end
      return errors[2], matrix.order(steps, errors)
    end,
  },
}
