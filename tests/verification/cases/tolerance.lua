-- What `tolerance` promises: no point is further than it from its path after a frame, but those that are told to need
-- more than `max_substeps`. The truth is a run of 4,096 sub-steps.
local scene = require "testing.scene"
local json = require "dkjson"

local tolerance = 1e-3
local head = [[
local P, v = {}, {}
for i = 1, 300 do
  local a, b = (i * 0.754878) % 1, (i * 0.569840) % 1
  P[i], v[i] = {2 * a - 1, 0.5 + b, 2 * ((7 * a + 3 * b) % 1) - 1}, {3 * b - 1.5, 2 * a - 1, 4 * (b - a)}
end
local start = rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } }
]]

local scenes = {
  { "near a vortex' axis", "start:vortex { strength = 20 }" },
  { "close to a centre", "start:attract { center = {0.1, 0.9, 0}, strength = 5, core = 0.01 }" },
  { "drags together",
    "start:gravity {} :drag { linear = 3, quadratic = 2 } :wind { velocity = {30, 0, 0}, drag = 2 }" },
  { "a spring to a sphere",
    "start:spring { target = rapid.shape.sphere { radius = 0.8, center = {0, 1, 0} }, stiffness = 900 }" },
  { "a force that jumps",
    'start:action("jump", function(p) p.force = p.force + vec3(p.P.x > 0 and 400 or -400, 0, 0) end)' },
  { "turbulence over a plane, bounce 0, friction 0.4",
    "start:turbulence { amplitude = 50, size = 0.3 } :gravity {} " ..
    ":collide { shape = rapid.shape.plane { offset = 0.7 }, bounce = 0, friction = 0.4 }" },
  { "a box that turns",
    "start:turbulence { amplitude = 10 } " ..
    ":collide { shape = rapid.shape.box { size = {1, 0.4, 1}, center = {0, 1, 0} }, " ..
    "transform = function(f) return rapid.rotate({0, 0, 1}, 400 * f.time) end, bounce = 0.5, friction = 0.3 }" },
}

-- The part of the points that are beyond the tolerance, less those that are told.
local function untold(nodes)
  local function text(solve) return head .. "return " .. nodes .. " :solve { " .. solve .. " }" end
  local given = ("tolerance = %g, max_substeps = 1024"):format(tolerance)
  local truth = scene.run(text "substeps = 4096", { frames = {2, 2} })[2]
  local found = scene.run(text(given), { frames = {2, 2} })[2]
  local beyond = 0
  for i = 1, #truth do
    local p = found:by_id(truth[i].id)
    if not p or (p.P - truth[i].P):length() > tolerance then beyond = beyond + 1 end
  end
  local run = scene.command("run", text(given), "-f 1-2 --quiet --stats stats.json")
  assert(run.status == 0, run.stderr)
  local told = json.decode(scene.folder:read "stats.json").frames[2].beyond_tolerance
  return math.max(0, beyond - told) / #truth
end

local rows = {}
for _, one in ipairs(scenes) do
  rows[#rows + 1] = {
    feature = "solve", law = "tolerance 1 mm, " .. one[1] .. ": part of the points beyond it and untold",
    reference = "4,096 sub-steps", at_most = 0.01,
    measure = function() return untold(one[2]) end,
  }
end
return rows
