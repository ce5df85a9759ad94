-- The promise of `tolerance`: after a frame no point is further than this from its exact path, except points that are
-- reported to need more than `max_substeps`. The scenes are hard for step doubling: near singular axes and centres, at
-- jumps, with forces that runs of n, 2n, 4n sub-steps sample at the same phase, at contacts. The reference is a run of
-- 8,192 sub-steps.
local scene = require "testing.scene"
local json = require "dkjson"

local head = [[
local P, v = {}, {}
for i = 1, 400 do
  local a, b = (i * 0.754878) % 1, (i * 0.569840) % 1
  P[i], v[i] = {2 * a - 1, 0.5 + b, 2 * ((7 * a + 3 * b) % 1) - 1}, {3 * b - 1.5, 2 * a - 1, 4 * (b - a)}
end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } } ]]

local function pushed(force)
  return (":action('push', function(p, step) p.force = p.force + %s end)"):format(force)
end

local function hum(size, wave, frequency)
  return pushed(("vec3(%d * math.%s(2 * math.pi * %d * step.time), 0, 0)"):format(size, wave, frequency))
end

local drags = ":gravity {} :drag { linear = %g, quadratic = %g } :wind { velocity = {30, 0, 0}, drag = %g }"

local rough_floor = ":turbulence { amplitude = 50, size = 0.3 } :gravity {} " ..
  ":collide { shape = rapid.shape.plane { offset = 0.7 }, bounce = 0, friction = 0.4 }"

local function box(transform)
  return ":collide { shape = rapid.shape.box { size = {1, 0.4, 1}, center = {0, 1, 0} }, " ..
    "transform = function(f) return " .. transform .. " end, bounce = 0.5, friction = 0.3 }"
end

local turns, moves = box "rapid.rotate({0, 0, 1}, 400 * f.time)", box "rapid.translate(6 * f.time, 0, 0)"

-- Each has a name, nodes, the tolerance (m), and whether step doubling sees the whole error, so that almost no point
-- needs to be reported.
local scenes = {
  { "a vortex", ":vortex { strength = 20 }", 1e-3, true },
  { "a vortex", ":vortex { strength = 20 }", 1e-5 },
  { "a vortex of ten times the strength", ":vortex { strength = 200 }", 1e-3, true },
  { "a vortex and wind", ":vortex { strength = 50 } :gravity {} :wind { drag = 3 }", 1e-4 },
  { "a centre of 1/r²", ":attract { center = {0.1, 0.9, 0}, strength = 5, core = 0.01 }", 1e-3, true },
  { "a centre of 1/r", ":attract { center = {0.1, 0.9, 0}, strength = 50, falloff = 1 }", 1e-3 },
  { "a centre of equal pull", ":attract { center = {0.1, 0.9, 0}, strength = 50, falloff = 0 }", 1e-4, true },
  { "drags together", drags:format(3, 2, 2), 1e-3 },
  { "strong drags together", drags:format(30, 20, 20), 1e-4 },
  { "drags in turbulence", ":turbulence { amplitude = 100, size = 0.3 } :drag { linear = 3, quadratic = 2 }", 1e-4 },
  { "a spring to a sphere",
    ":spring { target = rapid.shape.sphere { radius = 0.8, center = {0, 1, 0} }, stiffness = 900 }", 1e-3, true },
  { "a force that jumps at a plane", pushed "vec3(p.P.x > 0 and 400 or -400, 0, 0)", 1e-3 },
  { "a force that jumps in time", pushed "vec3(step.time > 0.0123 and 400 or 0, 0, 0)", 1e-3 },
  { "a force that jumps at a speed", pushed "vec3(0, p.v.y > 0.3 and -300 or 30, 0)", 1e-3 },
  { "a force of 96 Hz, a sine", hum(1000, "sin", 96), 1e-3 },
  { "a force of 96 Hz, a cosine", hum(1000, "cos", 96), 1e-3 },
  { "a force of 192 Hz", hum(2000, "sin", 192), 1e-4 },
  { "fast turbulence", ":turbulence { amplitude = 200, size = 0.5, speed = 100 }", 1e-3 },
  { "turbulence over a plane, bounce 0, friction 0.4", rough_floor, 1e-3 },
  { "turbulence over a plane, bounce 0, friction 0.4", rough_floor, 1e-4 },
  { "turbulence about a box that turns", ":turbulence { amplitude = 10 } " .. turns, 1e-3 },
  { "drag about a box that turns", ":gravity {} :drag { linear = 1 } " .. turns, 1e-3 },
  { "drag about a box that moves", ":gravity {} :drag { linear = 1 } " .. moves, 1e-4 },
}

-- Returns the fraction of points beyond the tolerance that are not reported, and the fraction that is reported.
local function parts(nodes, tolerance)
  local function text(solve) return head .. nodes .. " :solve { " .. solve .. " }" end
  local given = ("tolerance = %g, max_substeps = 1024"):format(tolerance)
  local truth = scene.run(text "substeps = 8192", { frames = {2, 2} })[2]
  local found = scene.run(text(given), { frames = {2, 2} })[2]
  local beyond = 0
  for i = 1, #truth do
    if (found:by_id(truth[i].id).P - truth[i].P):length() > tolerance then beyond = beyond + 1 end
  end
  local run = scene.command("run", text(given), "-f 1-2 --quiet --stats stats.json")
  assert(run.status == 0, run.stderr)
  local reported = json.decode(scene.folder:read "stats.json").frames[2].beyond_tolerance
  return math.max(0, beyond - reported) / #truth, reported / #truth
end

local rows = {}
for i, one in ipairs(scenes) do
  local name, nodes, tolerance, is_seen = unpack(one)
  rows[i] = {
    feature = "solve", reference = "8,192 sub-steps", at_most = 0.01,
    law = ("tolerance %g mm, %s: part of the points beyond it, %s"):format(1000 * tolerance, name,
      is_seen and "told or not" or "and not told"),
    measure = function()
      local unreported, reported = parts(nodes, tolerance)
      return is_seen and unreported + reported or unreported
    end,
  }
end
return rows
