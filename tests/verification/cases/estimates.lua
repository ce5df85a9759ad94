-- Compares the position error that a run reports with the true one, from a run with 64 times the sub-steps, at the last
-- frame. For more than 20 points this is the 95th percentile, for fewer the worst point. Scenes whose points diverge
-- from any reference in time, such as those with many contacts, end before that: a run with 16 times the sub-steps must
-- differ from the truth by at most a third of the true error.
local scene = require "testing.scene"
local json = require "dkjson"

-- u(i, k) are evenly distributed numbers in [0, 1) for point i.
local head = [[
local function u(i, k) return (i * ({0.8191725134, 0.6710436067, 0.5497004779, 0.4503})[k]) % 1 end
local function centred(i, k) return 2 * u(i, k) - 1 end
local function grid(nx, ny, nz, d, at)
  local P = {}
  for x = 0, nx - 1 do for y = 0, ny - 1 do for z = 0, nz - 1 do
    local i = #P
    P[i + 1] = {at[1] + d * (x - (nx - 1) / 2 + 0.1 * centred(i, 1)), at[2] + d * y,
      at[3] + d * (z - (nz - 1) / 2 + 0.1 * centred(i, 2))}
  end end end
  return P
end
local function shots(n)  -- pairs of grains, one of which hits the other obliquely
  local P, v = {}, {}
  for i = 0, n - 1 do
    P[2 * i + 1], v[2 * i + 1] = {-0.4 * u(i, 1) - 0.2, 0.17 * centred(i, 2), 3 * i}, {1 + 3 * u(i, 3), 0, 0}
    P[2 * i + 2], v[2 * i + 2] = {0, 0, 3 * i}, {0, 0, 0}
  end
  return { P = P, v = v }
end
local function chain(n) local list = {} for i = 1, n do list[i] = {i, i + 1} end return list end
local function from(set) return rapid.create { fps = 24, points = rapid.points.from(set) } end
local function hooked(set, ...)
  local hooks = {...}
  return from(set):group { name = "hook", where = function(p)
    for k = 1, #hooks do if p.id == hooks[k] - 1 then return true end end
    return false
  end }
end
local floor = { shape = rapid.shape.plane {}, bounce = 0, friction = 0.4 }
]]

-- Features, scene, sub-steps, number of solved frames, text; %d is the number of sub-steps.
local scenes = {
  { "distance, pin", "pendulum from 60 degrees", 4, 24, [[
return hooked({ P = {{0, 0, 0}, {0.866, -0.5, 0}} }, 1) :gravity {} :distance { pairs = {{1, 2}} }
  :pin { group = "hook" } :solve { substeps = %d }]] },
  { "distance, pin", "double pendulum from 90 degrees", 8, 18, [[
return hooked({ P = {{0, 0, 0}, {1, 0, 0}, {1.7, 0, 0}}, mass = {1, 1, 0.3} }, 1) :gravity {}
  :distance { pairs = chain(2) } :pin { group = "hook" } :solve { substeps = %d }]] },
  { "distance, pin", "rope of 20 links from the horizontal", 8, 12, [[
local P = {}
for i = 0, 20 do P[i + 1] = {i / 20, 0, 0} end
return hooked({ P = P }, 1) :gravity {} :distance { pairs = chain(20) } :pin { group = "hook" }
  :solve { substeps = %d }]] },
  { "distance, pin", "net of 81 points on two hooks", 8, 10, [[
local P = {}
for i = 0, 8 do for k = 0, 8 do P[#P + 1] = {0.1 * i, 0, 0.1 * k} end end
return hooked({ P = P }, 1, 73) :gravity {} :distance { within = 0.11 } :pin { group = "hook" }
  :solve { substeps = %d, iterations = 4 }]] },
  { "distance", "dumbbells that turn", 4, 24, [[
local P, v, pairs = {}, {}, {}
for i = 0, 49 do
  P[2 * i + 1], P[2 * i + 2] = {3 * i, 0.5, 0}, {3 * i, -0.5, 0}
  v[2 * i + 1], v[2 * i + 2] = {2 + u(i, 1), 0, u(i, 2)}, {-2, 1, 0}
  pairs[i + 1] = {2 * i + 1, 2 * i + 2}
end
return from { P = P, v = v } :distance { pairs = pairs } :solve { substeps = %d }]] },
  { "distance, pin", "springs and rods by turns", 8, 24, [[
local P, rods, springs = {}, {}, {}
for i = 0, 8 do P[i + 1] = {0.2 * i, 0, 0} end
for i = 1, 8 do local list = i %% 2 == 0 and rods or springs list[#list + 1] = {i, i + 1} end
return hooked({ P = P }, 1) :gravity {} :distance { pairs = rods }
  :distance { pairs = springs, compliance = 0.002 } :pin { group = "hook" } :solve { substeps = %d }]] },
  { "distance", "compliant link of 1 and 3 kg", 4, 24, [[
return from { P = {{0, 0, 0}, {1, 0, 0}}, v = {{0, 1, 0}, {1, 0, 0}}, mass = {1, 3} }
  :distance { pairs = {{1, 2}}, compliance = 0.01 } :solve { substeps = %d }]] },
  { "pin", "points on compliant pins that are let go", 4, 24, [[
local P, target = {}, {}
for i = 1, 40 do P[i], target[i] = {i, 0, 0}, {i + centred(i, 1), centred(i, 2), 0} end
return from { P = P, target = target } :gravity {} :pin { target = rapid.attr "target", compliance = 0.01 }
  :solve { substeps = %d }]] },
  { "pin, distance", "rope on a hook that goes in a circle", 8, 18, [[
local P = {}
for i = 0, 10 do P[i + 1] = {0.5, -0.1 * i, 0} end
return hooked({ P = P }, 1) :gravity {} :distance { pairs = chain(10) }
  :pin { group = "hook", transform = function(f) return rapid.rotate({0, 1, 0}, 360 * f.time) end }
  :solve { substeps = %d }]] },
  { "drag, distance", "rope in wind with quadratic drag", 4, 18, [[
local P = {}
for i = 0, 20 do P[i + 1] = {0, -0.05 * i, 0} end
return hooked({ P = P }, 1) :gravity {} :wind { velocity = {6, 0, 1}, drag = 2 } :drag { quadratic = 0.5 }
  :distance { pairs = chain(20) } :pin { group = "hook" } :solve { substeps = %d }]] },
  { "turbulence, distance", "rods in turbulence", 2, 24, [[
local P, pairs = {}, {}
for i = 0, 99 do
  local x, y, z = 2 * u(i, 1), 2 * u(i, 2), 2 * u(i, 3)
  P[2 * i + 1], P[2 * i + 2], pairs[i + 1] = {x, y, z}, {x + 0.2, y, z}, {2 * i + 1, 2 * i + 2}
end
return from { P = P } :turbulence { amplitude = 8, size = 1, octaves = 1 } :distance { pairs = pairs }
  :solve { substeps = %d }]] },
  { "collide, distance", "rope that falls over a ball", 8, 9, [[
local P = {}
for i = 0, 40 do P[i + 1] = {-0.8 + 0.045 * i, 0.75, 0.02} end
return from { P = P } :gravity {} :distance { pairs = chain(40) }
  :collide { shape = rapid.shape.sphere { radius = 0.5 }, bounce = 0, friction = 0.2 } :solve { substeps = %d }]] },
  { "contact", "two grains, oblique, with friction", 4, 12, [[
return from { P = {{-0.5, 0.05, 0}, {0.3, 0, 0.02}}, v = {{2, 0, 0}, {0, 0.1, 0}}, mass = {1, 2} } :gravity {}
  :contact { radius = 0.1, friction = 0.3 } :solve { substeps = %d }]] },
  { "contact", "200 pairs of grains, oblique, with friction", 4, 12, [[
return from(shots(200)) :gravity {} :contact { radius = 0.1, friction = 0.4 }
  :solve { substeps = %d }]] },
  { "contact, collide", "heap of 64 grains", 8, 10, [[
return from { P = grid(4, 4, 4, 0.12, {0, 0.2, 0}) } :gravity {}
  :collide(floor) :contact { radius = 0.05, friction = 0.4 } :solve { substeps = %d, iterations = 4 }]] },
  { "contact, collide", "column of 500 grains that collapses", 12, 8, [[
return from { P = grid(5, 20, 5, 0.105, {0, 0.06, 0}) } :gravity {}
  :collide(floor) :contact { radius = 0.05, friction = 0.3 } :solve { substeps = %d, iterations = 4 }]] },
  { "contact, collide", "stack of ten under five times its weight", 8, 12, [[
local P, mass = {}, {}
for i = 1, 11 do P[i], mass[i] = {0, 0.1 * i - 0.05, 0}, i == 11 and 50 or 1 end
return from { P = P, mass = mass } :gravity {} :collide(floor) :contact { radius = 0.05 }
  :solve { substeps = %d, iterations = 2, sleep = math.huge }]] },
  { "contact, collide", "grains that are pushed over a floor", 8, 12, [[
local P, v = {}, {}
for i = 1, 30 do P[i], v[i] = {0.11 * i, 0.05, 0.02 * centred(i, 1)}, {i == 1 and 8 or 0, 0, 0} end
return from { P = P, v = v } :gravity {} :collide(floor) :contact { radius = 0.05, bounce = 0.3, friction = 0.3 }
  :solve { substeps = %d, iterations = 2 }]] },
  { "contact", "gas of 64 elastic spheres", 2, 14, [[
local v = {}
for i = 1, 64 do v[i] = {centred(i, 1), centred(i, 2), centred(i, 3)} end
return from { P = grid(4, 4, 4, 0.3, {0, 0, 0}), v = v } :contact { radius = 0.12, bounce = 1 }
  :solve { substeps = %d }]] },
  { "contact, collide", "27 grains that turn, on a floor", 8, 10, [[
local v = {}
for i = 1, 27 do v[i] = {centred(i, 1), 0, centred(i, 2)} end
return from { P = grid(3, 3, 3, 0.12, {0, 0.1, 0}), v = v } :gravity {} :collide(floor)
  :contact { radius = 0.05, friction = 0.4, spin = true } :solve { substeps = %d, iterations = 4 }]] },
  { "action, distance", "rods that a state in an attribute drives", 2, 24, [[
local P, pairs = {}, {}
for i = 0, 29 do
  local x, y, z = centred(i, 1), centred(i, 2), centred(i, 3)
  P[2 * i + 1], P[2 * i + 2], pairs[i + 1] = {x, y, z}, {x + 0.2, y, z}, {2 * i + 1, 2 * i + 2}
end
return from { P = P } :attribute { heat = 0 } :action("wind up", function(p, step)
    p.heat = p.heat + step.dt * p.P.x
    p.force = p.force - vec3(60 * p.heat, 20 * p.P.y, 0)
  end) :distance { pairs = pairs } :solve { substeps = %d }]] },
  { "clump, contact", "clumped ball that hits the floor", 8, 10, [[
return from { P = grid(3, 3, 3, 0.1, {0, 0.25, 0}) } :gravity {} :collide(floor)
  :contact { radius = 0.055, friction = 0.3 } :clump { radius = 0.055, strength = 1e6 }
  :solve { substeps = %d, iterations = 4 }]] },
  { "interact", "points that drive each other apart, 1 sub-step", 1, 12, [[
local P = {}
for i = 1, 200 do P[i] = {centred(i, 1), centred(i, 2), centred(i, 3)} end
return from { P = P } :interact { radius = 0.5, separation = 10 } :solve { substeps = %d }]] },
  { "interact", "flock in turbulence", 2, 24, [[
local P, v = {}, {}
for i = 1, 300 do P[i], v[i] = {centred(i, 1), centred(i, 2), centred(i, 3)}, {centred(i, 3), 1, centred(i, 1)} end
return from { P = P, v = v } :turbulence { amplitude = 4, octaves = 1 }
  :interact { radius = 0.6, separation = 4, cohesion = 2, alignment = 2, drag = 1 } :solve { substeps = %d }]] },
  { "interact, contact", "crowd that is drawn together", 4, 12, [[
local P = {}
for i = 1, 100 do P[i] = {3 * centred(i, 1), 0, 3 * centred(i, 2)} end
return from { P = P } :attract { strength = 3, core = 1, falloff = 1 } :interact { radius = 0.8, separation = 6 }
  :contact { radius = 0.1, friction = 0.2 } :solve { substeps = %d }]] },

  { "attract", "orbits", 2, 24, [[
local P, v = {}, {}
for i = 1, 100 do P[i], v[i] = {1 + i / 100, 0, 0}, {0, 0, 2 / math.sqrt(1 + i / 100)} end
return from { P = P, v = v } :attract { strength = 4 } :solve { substeps = %d }]] },
  { "turbulence, drag", "smoke", 2, 24, [[
return from { P = grid(6, 6, 6, 0.2, {0, 1, 0}) } :turbulence { amplitude = 5, size = 1, octaves = 2 }
  :drag { linear = 1 } :solve { substeps = %d }]] },
  { "vortex, attract", "a whirl", 4, 24, [[
return from { P = grid(6, 6, 6, 0.2, {0, 0, 0}) } :vortex { strength = 3 } :attract { strength = 2, core = 0.3 }
  :solve { substeps = %d }]] },
  { "drag, gravity", "shots with quadratic drag", 1, 24, [[
local P, v = {}, {}
for i = 1, 100 do P[i], v[i] = {0, 0, 0}, {20 * u(i, 1), 10 * u(i, 2), 0} end
return from { P = P, v = v } :gravity {} :drag { quadratic = 0.1 } :solve { substeps = %d }]] },
  { "spring", "springs to a ball", 4, 24, [[
return from { P = grid(5, 5, 5, 0.4, {0, 0, 0.1}) } :gravity {} :spring { stiffness = 60,
  target = rapid.shape.sphere { radius = 0.8, center = {0, 1, 0} } } :solve { substeps = %d }]] },
  { "action", "an action of first order", 4, 24, [[
return from { P = grid(5, 5, 5, 0.2, {0, 1, 0}) } :gravity {}
  :action("slow", function(p, step) p.v = p.v * (1 - 3 * step.dt) end) :solve { substeps = %d }]] },
  -- In scenes with functions of the frame, %d is the number of sub-frames.
  { "wind, gravity", "wind and gravity that are functions of the frame, 1 sub-frame", 1, 24, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 4, 4, 0.2, {0, 0, 0}) } }
  :wind { drag = 2, velocity = function(f) return {8 * math.sin(5 * f.time), 0, 4 * math.cos(5 * f.time)} end }
  :gravity { g = function(f) return {0, -9.81 * f.time, 0} end } :solve {}]] },
  { "attract, distance", "rods drawn to a center that moves, 1 sub-frame", 1, 18, [[
local P, pairs = {}, {}
for i = 0, 29 do
  local x, y, z = centred(i, 1), centred(i, 2), centred(i, 3)
  P[2 * i + 1], P[2 * i + 2], pairs[i + 1] = {x, y, z}, {x + 0.2, y, z}, {2 * i + 1, 2 * i + 2}
end
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = P } }
  :attract { strength = 3, core = 0.5, center = function(f) return {2 * f.time, math.sin(4 * f.time), 0} end }
  :distance { pairs = pairs } :solve { substeps = 2 }]] },
  { "spring", "springs to a target on a sine of 1 Hz, 4 sub-steps", 1, 24, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 4, 4, 0.2, {0, 0, 0}) } }
  :spring { stiffness = 60, damping = 1, target = function(f) return {2 * math.sin(2 * math.pi * f.time), 0, 0} end }
  :solve { substeps = 4 }]] },
  { "spring", "the same on a sine of 3 Hz, 64 sub-steps: 8 frames a period", 1, 24, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 4, 4, 0.2, {0, 0, 0}) } }
  :spring { stiffness = 60, damping = 1, target = function(f) return {2 * math.sin(6 * math.pi * f.time), 0, 0} end }
  :solve { substeps = 64 }]] },
  { "pin, distance", "rope on a hook whose place is a function of the frame, 8 sub-steps", 1, 18, [[
local P = {}
for i = 0, 10 do P[i + 1] = {i / 10, 0, 0} end
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = P } } :gravity {}
  :group { name = "hook", where = function(p) return p.id == 0 end } :distance { pairs = chain(10) }
  :pin { group = "hook", target = function(f) return {0.2 * math.sin(6 * f.time), 0, 0} end }
  :solve { substeps = 8 }]] },
  { "pin", "points on compliant pins whose place is a function of the frame, 4 sub-steps", 1, 24, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 1, 4, 0.2, {0, 0, 0}) } }
  :pin { compliance = 0.02, target = function(f) return {math.sin(5 * f.time), 0, f.time} end }
  :solve { substeps = 4 }]] },
  { "pin, contact", "a grain of ten times the weight on one on a compliant pin, 1 sub-step", 1, 24, [[
return from { P = {{0, 0, 0}, {0, 0.2, 0}}, mass = {1, 10} } :gravity {} :drag { linear = 5 }
  :group { name = "held", where = function(p) return p.id == 0 end } :pin { group = "held", compliance = 1e-4 }
  :contact { radius = 0.1 } :solve { substeps = %d, sleep = math.huge }]] },
  { "vortex, drag", "a vortex that comes and goes, with drag that does", 1, 24, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 4, 4, 0.2, {1, 0, 0}) } }
  :vortex { strength = function(f) return 6 * math.sin(5 * f.time) end }
  :drag { linear = function(f) return 1 + math.cos(7 * f.time) end, quadratic = 0.2 } :solve { substeps = 2 }]] },
  { "wind", "wind that rises at once after a frame, 16 sub-steps", 1, 24, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 4, 4, 0.2, {0, 0, 0}) } }
  :wind { drag = 4, velocity = function(f) return {f.number > 10 and 5 or 0, 0, 0} end } :solve { substeps = 16 }]] },
  { "interact", "neighbours that part by a function of the frame, 2 sub-steps", 1, 18, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = grid(4, 4, 4, 0.3, {0, 0, 0}) } }
  :interact { radius = 0.8, separation = function(f) return 8 * math.sin(6 * f.time) ^ 2 end }
  :solve { substeps = 2 }]] },
  { "collide", "friction of a floor that is a function of the frame", 1, 18, [[
local v = {}
for i = 1, 64 do v[i] = {4 + centred(i, 1), 0, centred(i, 2)} end
local P = grid(8, 1, 8, 0.2, {0, 0, 0})
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = P, v = v } }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0, friction = function(f) return f.time / 2 end }
  :solve { substeps = 4 }]] },
  { "contact", "friction of grains that is a function of the frame", 1, 12, [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from(shots(50)) }
  :contact { radius = 0.1, friction = function(f) return 3 * f.time end } :solve { substeps = 16 }]] },
  { "collide", "contacts found after the step", 2, 24, [[
return from { P = grid(6, 6, 6, 0.2, {0, 0.5, 0}) } :gravity {} :turbulence { amplitude = 2, octaves = 1 }
  :collide { shape = rapid.shape.plane {}, method = "project", bounce = 0.4 } :solve { substeps = %d }]] },
}

-- Returns the error of a list in the form in which it is reported, m.
local function reported_as(errors)
  table.sort(errors)
  return errors[#errors > 20 and math.floor(0.95 * (#errors - 1)) + 1 or #errors]
end

local function distances(a, b)
  local list = {}
  for i = 1, #b do
    local p = a:by_id(b[i].id)
    if p then list[#list + 1] = (p.P - b[i].P):length() end
  end
  return list
end

-- doubt: distance between two references, m; the finer one is the truth.
local function ratio(reported, real, doubt)
  assert(3 * doubt <= real, ("no truth: two references are %g m apart, the error is %g m")
    :format(doubt, real))
  return reported / real
end

local function told_by_true(substeps, last, text)
  local function run(factor)
    return scene.run(head .. text:format(factor * substeps), { frames = {last, last} })[last]
  end
  local found, near, truth = run(1), run(16), run(64)
  local ran = scene.command("run", head .. text:format(substeps), ("-f %d --quiet --stats stats.json"):format(last))
  assert(ran.status == 0, ran.stderr)
  local frames = json.decode(scene.folder:read "stats.json").frames
  local error = assert(frames[#frames].error, "no error is told")
  return ratio(#truth > 20 and error.position_p95 or error.position_max,
    reported_as(distances(found, truth)), reported_as(distances(near, truth)))
end

-- Does the same for the 40th frame of a column, which has too many points for more frames. The reference starts with
-- that frame.
local function told_of_frame()
  local function text(set, substeps)
    return head .. ([[
return from %s :gravity {} :collide(floor) :contact { radius = 0.05, friction = 0.3 }
  :solve { substeps = %d, iterations = 4, sleep = math.huge }]]):format(set, substeps)
  end
  local column = "{ P = grid(7, 30, 7, 0.105, {0, 0.06, 0}) }"
  local ran = scene.command("run", text(column, 12), "-f 1-41 --quiet --stats stats.json")
  assert(ran.status == 0, ran.stderr)
  local reported = json.decode(scene.folder:read "stats.json").frames[41].frame_error.position_p95

  local run, set = scene.run(text(column, 12), { frames = {40, 41} }), {}
  for _, name in ipairs { "P", "v" } do
    local values = {}
    for i = 1, #run[40] do
      local x = run[40][i][name]
      values[i] = ("{%.9g, %.9g, %.9g}"):format(x.x, x.y, x.z)
    end
    set[#set + 1] = name .. " = {" .. table.concat(values, ", ") .. "}"
  end
  local begun = "{ " .. table.concat(set, ", ") .. " }"
  local near = scene.run(text(begun, 32 * 12), { frames = {2, 2} })[2]
  local truth = scene.run(text(begun, 128 * 12), { frames = {2, 2} })[2]
  return ratio(reported, reported_as(distances(run[41], truth)), reported_as(distances(near, truth)))
end

local rows = {}
for _, one in ipairs(scenes) do
  local feature, name, substeps, frames, text = unpack(one)
  rows[#rows + 1] = {
    feature = feature, law = ("error told by the true one: %s, %d frames"):format(name, frames),
    reference = "64 times the sub-steps", at_least = 0.25, at_most = 4,
    measure = function() return told_by_true(substeps, frames + 1, text) end,
  }
end
rows[#rows + 1] = {
  feature = "contact, collide", law = "error told by the true one: one frame of a column of 1,470 grains",
  reference = "128 times the sub-steps", at_least = 0.25, at_most = 4, measure = told_of_frame,
}
return rows
