-- Points that turbulence of 50 m/s² drives over a rough plane without bounce: more sub-steps come nearer to one answer.
local scene = require "testing.scene"
local matrix = require "tests.verification.matrix"

local frames = 13

local function run(substeps)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.grid { size = {2, 0, 2}, spacing = 0.14 } }
  :turbulence { amplitude = 50, size = 0.8 } :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.4 } :solve { substeps = %d }]]):format(substeps),
    { frames = {frames, frames} })[frames]
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
    reference = "4,096 sub-steps", at_most = 1e-3, unit = "m", order = 1,
    measure = function()
      local truth, steps, errors = run(4096), {}, {}
      for i, substeps in ipairs { 16, 32, 64 } do
        steps[i], errors[i] = 1 / substeps, mean_distance(run(substeps), truth)
      end
      return errors[3], matrix.order(steps, errors)
    end,
  },
}
