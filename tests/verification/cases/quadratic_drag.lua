-- Quadratic drag: a logarithm by itself, a hyperbolic tangent with gravity, an exponential with linear drag.
local scene = require "testing.scene"
local matrix = require "tests.verification.matrix"

local rounding = 3e-6  -- m, at about 10 m over 50 frames

local function run(nodes, v, substeps, frames)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, v = {{%.9g, 0, 0}} } }
  %s :solve { substeps = %d }]]):format(v, nodes, substeps), { frames = {frames, frames} })[frames][1].P
end

return {
  {
    feature = "drag", law = "quadratic alone, 300 m/s and 0.5/m to 5e5 m/s and 1e9/m, a frame: error of the way",
    reference = "ln(1 + c v t)/c", at_most = 1e-6,
    measure = function()
      local worst = 0
      for _, case in ipairs { { 1, 0.1 }, { 300, 0.5 }, { 1e4, 30 }, { 5e5, 1e9 } } do
        local v, c = case[1], case[2]
        local expected = math.log(1 + c * v / 24) / c
        local way = run((":drag { quadratic = %g }"):format(c), v, 1, 2).x
        worst = math.max(worst, math.abs(way / expected - 1))
      end
      return worst
    end,
  },
  {
    feature = "drag", law = "quadratic 0.3/m and linear 0.5/s, 40 m/s, 1 s, 16 sub-steps: error of the way",
    reference = "closed form", at_most = 1e-3, unit = "m", order = 2,
    measure = function()
      -- v' = -k v - c v² gives x = ln(1 + c v0 (1 - e^(-kt))/k)/c.
      local v, c, k = 40, 0.3, 0.5
      local expected, steps, errors = math.log(1 + c * v * (1 - math.exp(-k)) / k) / c, {}, {}
      for i, substeps in ipairs { 1, 2, 4, 8, 16 } do
        steps[i] = 1 / substeps
        errors[i] = math.abs(run(":drag { quadratic = 0.3, linear = 0.5 }", v, substeps, 25).x - expected)
      end
      return errors[5], matrix.order(steps, errors, rounding)
    end,
  },
  {
    feature = "drag, gravity", law = "quadratic 0.2/m, falling from rest, 2 s, 16 sub-steps: error of the depth",
    reference = "ln cosh(t sqrt(g c))/c", at_most = 1e-3, unit = "m", order = 2,
    measure = function()
      local c, g = 0.2, 9.81
      local expected, steps, errors = math.log(math.cosh(2 * math.sqrt(g * c))) / c, {}, {}
      for i, substeps in ipairs { 1, 2, 4, 8, 16 } do
        steps[i] = 1 / substeps
        errors[i] = math.abs(run(":gravity {} :drag { quadratic = 0.2 }", 0, substeps, 49).y + expected)
      end
      return errors[5], matrix.order(steps, errors, rounding)
    end,
  },
}
