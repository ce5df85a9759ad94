-- A double pendulum with masses 1 and 0.3 from 120 and 90 degrees, compared with Lagrange's equations, solved by
-- fourth-order Runge-Kutta with steps of 1e-5 s.
local scene = require "testing.scene"
local matrix = require "tests.verification.matrix"

local g, l1, l2, m1, m2, a0, b0, frames = 9.81, 1, 0.7, 1, 0.3, math.rad(120), math.rad(90), 25

local function accelerations(a, b, wa, wb)
  local d = a - b
  local below = 2 * m1 + m2 - m2 * math.cos(2 * d)
  return (-g * (2 * m1 + m2) * math.sin(a) - m2 * g * math.sin(a - 2 * b)
      - 2 * math.sin(d) * m2 * (wb ^ 2 * l2 + wa ^ 2 * l1 * math.cos(d))) / (l1 * below),
    2 * math.sin(d) * (wa ^ 2 * l1 * (m1 + m2) + g * (m1 + m2) * math.cos(a)
      + wb ^ 2 * l2 * m2 * math.cos(d)) / (l2 * below)
end

local function truth(time)
  local y, h = { a0, b0, 0, 0 }, 1e-5
  local function slope(x)
    local aa, ab = accelerations(x[1], x[2], x[3], x[4])
    return { x[3], x[4], aa, ab }
  end
  local function along(k, s)
    return { y[1] + s * k[1], y[2] + s * k[2], y[3] + s * k[3], y[4] + s * k[4] }
  end
  for _ = 1, math.floor(time / h + 0.5) do
    local k1 = slope(y)
    local k2 = slope(along(k1, h / 2))
    local k3 = slope(along(k2, h / 2))
    local k4 = slope(along(k3, h))
    for i = 1, 4 do y[i] = y[i] + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) end
  end
  return vec3(l1 * math.sin(y[1]) + l2 * math.sin(y[2]), -l1 * math.cos(y[1]) - l2 * math.cos(y[2]), 0)
end

local function bob(substeps)
  local x, y = l1 * math.sin(a0), -l1 * math.cos(a0)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { mass = {1, %.9g, %.9g},
    P = {{0, 0, 0}, {%.9g, %.9g, 0}, {%.9g, %.9g, 0}} } }
  :gravity { g = {0, %.9g, 0} } :distance { pairs = {{1, 2}, {2, 3}} }
  :group { name = "hook", where = function(p) return p.id == 0 end } :pin { group = "hook" }
  :solve { substeps = %d }]]):format(m1, m2, x, y, x + l2 * math.sin(b0), y - l2 * math.cos(b0), -g, substeps),
    { frames = {frames, frames} })[frames][3].P
end

return {
  {
    feature = "distance", law = "double pendulum, 1 s, 64 sub-steps: distance of the lower bob from its truth",
    reference = "Lagrange's equations", at_most = 1e-3, unit = "m", order = 2,
    measure = function()
      local expected, steps, errors = truth((frames - 1) / 24), {}, {}
      for i, substeps in ipairs { 16, 32, 64 } do
        steps[i], errors[i] = 1 / substeps, (bob(substeps) - expected):length()
      end
      return errors[3], matrix.order(steps, errors)
    end,
  },
}
