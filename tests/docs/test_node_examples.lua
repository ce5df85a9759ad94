-- The example of each node in docs/lua-api.md, which docs/reference/nodes.py reads from here. Each runs for a second of
-- 24 frames, and a closed form, a count or an invariant holds.
local command = require "testing.command"
local json = require "dkjson"

local examples, order = {}, {}

-- Declares the example of a node: its scene, and a check of the frames 1 to 25. The generator finds the scene by the
-- form of this call.
local function example(name)
  return function(declared)
    examples[name] = { scene = declared[1], check = declared[2] }
    order[#order + 1] = name
  end
end

local folder = command.folder()

local function write(name, text)
  return folder:write(name, 'local rapid = require "rapid"\n' .. text)
end

-- Returns the root mean square of an attribute's length.
local function rms(points, name)
  local sum = 0
  for i = 1, #points do sum = sum + points[i][name]:dot(points[i][name]) end
  return math.sqrt(sum / #points)
end

example "action" {
  [[
return rapid.create { points = rapid.points.from { P = {{1, 0, 0}} } }
  :action ("spring", function(p, step) p.force = p.force - p.P * 4 end)
  :solve  { substeps = 8 }]],
  function(result) assert.near(math.cos(2), result[25][1].P.x, 1e-3) end,
}

example "align" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, N = {{1, 0, 0}} } }
  :align { to = "N", axis = {0, 1, 0} }
  :solve {}]],
  function(result) assert.near({1, 0, 0}, result[25][1].orient:rotate(vec3(0, 1, 0)), 1e-6) end,
}

example "align_to_velocity" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{1, 0, 0}} } }
  :align_to_velocity {}
  :solve {}]],
  function(result)
    assert.near({1, 0, 0}, result[25][1].orient:rotate(vec3(0, 0, 1)), 1e-6)
    assert.near({0, 1, 0}, result[25][1].orient:rotate(vec3(0, 1, 0)), 1e-6)
  end,
}

example "arrive" {
  [[
return rapid.create { points = rapid.points.from { P = {{1, 0, 0}} } }
  :arrive { target = {0, 0, 0}, speed = 4, radius = 0.5 }
  :solve  {}]],
  function(result)
    for f = 3, 25 do assert.is_true(result[f][1].P.x < result[f - 1][1].P.x and result[f][1].P.x > 0) end
    assert.is_true(result[25][1].P.x < 0.05)
  end,
}

example "attract" {
  [[
return rapid.create { points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 0, 2}} } }
  :attract { center = {0, 0, 0}, strength = 4 }
  :solve   { substeps = 8 }]],
  -- A circular orbit: v² / r = strength / r².
  function(result)
    assert.near({math.cos(2), 0, math.sin(2)}, result[25][1].P, 1e-3)
    assert.near(2, result[25][1].v:length(), 1e-3)
  end,
}

example "attribute" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :attribute { heat = 0.5, Cd = {1, 0.5, 0} }
  :solve     {}]],
  function(result)
    assert.equal(0.5, result[25]:min "heat")
    assert.near({1, 0.5, 0}, result[25]:max "Cd", 0)
  end,
}

example "avoid" {
  [[
return rapid.create { points = rapid.points.from { P = {{-2, 0, 0}}, v = {{3, 0, 0}} } }
  :avoid { shape = rapid.shape.sphere { radius = 0.5 }, distance = 1, strength = 20 }
  :solve {}]],
  -- The potential at the surface, 10 J/kg, exceeds the kinetic energy of 4.5 J/kg.
  function(result)
    for _, points in result:frames() do assert.is_true(points[1].P.x < -0.5) end
    assert.near(-3, result[25][1].v.x, 0.2)
  end,
}

example "clump" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {0.1, 0, 0}}, pscale = {0.05, 0.05} } }
  :action ("pull", function(p) p.force = vec3(p.id == 0 and -10 or 10, 0, 0) end)
  :clump  { strength = 20 }
  :solve  { substeps = 8 }]],
  function(result) assert.near(0.1, (result[25][2].P - result[25][1].P):length(), 1e-3) end,
}

example "collide" {
  [[
return rapid.create {}
  :emit    { source = rapid.mesh.grid { size = {0.8, 0.8}, center = {0, 1, 0} }, rate = 2000, life = 0.6 }
  :gravity {}
  :collide { shape = rapid.shape.sphere { radius = 0.5 }, bounce = 0.4, friction = 0.2 }
  :solve   {}]],
  function(result)
    assert.points(result[25]).outside(function(P) return P:length() - 0.5 end, 1e-6)
    assert.near(2000 * 0.6, #result[25], 20)
  end,
}

example "color_by_speed" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, v = {{0, 0, 0}, {0, 5, 0}} } }
  :color_by_speed { slow = {0, 0, 1}, fast = {1, 0, 0}, high = 5 }
  :solve {}]],
  function(result)
    assert.near({0, 0, 1}, result[25][1].Cd, 0)
    assert.near({1, 0, 0}, result[25][2].Cd, 0)
  end,
}

example "contact" {
  [[
return rapid.create { points = rapid.points.grid { size = {0.6, 1, 0.6}, spacing = 0.1, center = {0, 0.5, 0} } }
  :attribute { pscale = 0.05 }
  :gravity   { g = {4, -9, 0} }
  :collide   { shape = rapid.shape.plane {}, friction = 0.5 }
  :contact   { friction = 0.3 }
  :solve     { substeps = 10 }]],
  function(result)
    local at = {}
    for i = 1, #result[25] do at[i] = result[25][i].P end
    for i = 1, #at do
      assert.is_true(at[i].y > 0.049)
      for j = 1, i - 1 do assert.is_true((at[i] - at[j]):length() > 0.095) end
    end
  end,
}

example "create" {
  [[
return rapid.create { fps = 24, seed = 7, points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25 } }
  :gravity {}
  :solve   {}]],
  function(result)
    assert.equal(64, #result[25])
    assert.near(-9.81 / 2, result[25]:mean "P".y, 1e-5)
  end,
}

example "curve_force" {
  [[
local path = {{-2, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 0, 0}}
return rapid.create {}
  :emit        { source = rapid.shape.sphere { radius = 0.2, center = {-2, 0, 0} }, rate = 3000 }
  :curve_force { curve = path, speed = 4, pull = 100, drag = 10 }
  :solve       { substeps = 4 }]],
  function(result)
    local farthest = 0
    for i = 1, #result[25], 10 do
      local P = result[25][i].P
      farthest = math.max(farthest, P.x)
      assert.is_true(P.y > -0.5 and P.y < 1.5 and math.abs(P.z) < 0.5)
    end
    assert.is_true(farthest > 1)
  end,
}

example "delete" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :delete { where = function(p) return p.P.y > 0 end }
  :solve  {}]],
  function(result)
    assert.equal(1000, #result[1])
    assert.equal(500, #result[2])
    assert.is_true(result[25]:max "P".y < 0)
  end,
}

example "detail" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :detail ("highest", function(points) points.detail.top = points:max("P").y end)
  :points ("shade", function(p, frame) p.pscale = 0.01 * p.P.y / frame.detail.top end)
  :solve  {}]],
  function(result)
    assert.near(0.01, result[25]:max "pscale", 1e-8)
    assert.near(-0.01, result[25]:min "pscale", 1e-8)
  end,
}

example "distance" {
  [[
return rapid.create { points = rapid.points.grid { size = {1, 0.025, 1}, spacing = 0.025, center = {0, 0.8, 0} } }
  :gravity  {}
  :distance { within = 0.026 }
  :collide  { shape = rapid.shape.sphere { radius = 0.3, center = {0, 0.4, 0} } }
  :solve    { substeps = 16 }]],
  function(result)
    local first, last = result[1], result[25]
    for i = 1, #last - 1 do
      if (first[i + 1].P - first[i].P):length() < 0.026 then
        assert.near(0.025, (last[i + 1].P - last[i].P):length(), 2e-3)
      end
    end
    assert.points(last).outside(function(P) return (P - vec3(0, 0.4, 0)):length() - 0.3 end, 1e-6)
  end,
}

example "drag" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{8, 0, 0}} } }
  :drag  { linear = 2 }
  :solve {}]],
  function(result) assert.near(8 * math.exp(-2), result[25][1].v.x, 1e-5) end,
}

example "emit" {
  [[
return rapid.create {}
  :emit  { source = rapid.mesh.torus { radius = 0.5, tube = 0.1 }, rate = 5000, speed = 0.5, spread = 20,
           attributes = { pscale = 0.01, Cd = {{0.1, 0.3, 1}, {1, 0.9, 0.5}} } }
  :solve {}]],
  function(result)
    assert.equal(5000, #result[25])
    assert.near(0.5, rms(result[25], "v"), 1e-6)
  end,
}

example "fade_by_age" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, life = {2} } }
  :fade_by_age { attribute = "pscale", first = 0.1, last = 0 }
  :solve {}]],
  function(result) assert.near(0.05, result[25][1].pscale, 1e-7) end,
}

example "field" {
  [[
local flow = rapid.grid.from { at = function(P) return vec3(1, 0, 0) end, size = {4, 1, 1} }
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
  :field { grid = flow, mode = "velocity", drag = 2 }
  :solve {}]],
  function(result) assert.near(1 - math.exp(-2), result[25][1].v.x, 1e-4) end,
}

example "follow_curve" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :follow_curve { points = {{0, 0, 0}, {1, 1, 0}, {2, 0, 0}}, duration = 1 }
  :solve {}]],
  function(result)
    assert.near({1, 2, 0}, result[13][1].P, 1e-5)
    assert.near({2, 1, 0}, result[25][1].P, 1e-5)
  end,
}

example "follow_leader" {
  [[
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25 } }
  :group         { name = "first", where = function(p) return p.id == 0 end }
  :points        ("lead", function(p) if p:within "first" then p.v = vec3(2, 0, 0) end end)
  :follow_leader { leader = "first" }
  :solve         {}]],
  function(result)
    local leader = result[25]:by_id(0)
    assert.near(2, leader.v.x, 0)
    assert.is_true(result[25]:mean "v".x > 1)
    for i = 1, #result[25] do assert.is_true(result[25][i].P.x <= leader.P.x + 1e-3) end
  end,
}

example "goal" {
  [[
return rapid.create { points = rapid.points.grid { spacing = 0.05 } }
  :goal  { to = rapid.mesh.sphere { radius = 0.5 }, by = "random", time = 1 }
  :solve {}]],
  function(result)
    for i = 1, #result[25], 100 do
      assert.near(0.5, result[25][i].P:length(), 0.01)
      assert.near({0, 0, 0}, result[25][i].v, 1e-4)
    end
  end,
}

example "gravity" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :gravity { g = {0, -1.62, 0} }
  :solve   {}]],
  function(result) assert.near(1 - 0.81, result[25][1].P.y, 1e-6) end,
}

example "group" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :group   { name = "high", where = function(p) return p.P.y > 0 end }
  :gravity { group = "high" }
  :solve   {}]],
  function(result)
    assert.equal(500, #result[2]:group "high")
    assert.near(-9.81 / 24 / 2, result[2]:mean "v".y, 1e-6)
  end,
}

example "group_by_bounds" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :group_by_bounds { into = "corner", min = {0, 0, 0}, max = {1, 1, 1} }
  :solve {}]],
  function(result)
    assert.equal(125, #result[25]:group "corner")
    assert.is_true(result[25]:group "corner":min "P".x > 0)
  end,
}

example "group_by_shape" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :group_by_shape { into = "core", shape = rapid.shape.sphere { radius = 0.3 } }
  :solve {}]],
  function(result)
    local inside = 0
    for i = 1, 1000 do if result[25][i].P:length() <= 0.3 then inside = inside + 1 end end
    assert.is_true(inside > 0)
    assert.equal(inside, #result[25]:group "core")
  end,
}

example "impact_spin" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0.5, 0}}, v = {{2, -1, 0}}, pscale = {0.1} } }
  :impact_spin {}
  :collide     { shape = rapid.shape.plane {}, record = 0 }
  :solve       {}]],
  function(result) assert.near({0, 0, -20}, result[25][1].w, 1e-4) end,
}

example "interact" {
  [[
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25 } }
  :interact { radius = 0.5, separation = 2 }
  :solve    {}]],
  function(result)
    assert.near({0, 0, 0}, result[25]:mean "v", 1e-6)
    assert.is_true(result[25]:max "P".x > 0.5)
  end,
}

example "jitter" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :jitter { strength = 1 }
  :solve  {}]],
  function(result) assert.near(1, rms(result[25], "v"), 0.1) end,
}

example "kill_slow" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, v = {{0, 0, 0}, {1, 0, 0}} } }
  :kill_slow { speed = 0.1 }
  :solve     {}]],
  function(result)
    assert.equal(1, #result[25])
    assert.equal(1, result[25][1].id)
  end,
}

example "lift" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, heat = {1} } }
  :lift  { strength = 2, cooling = 0.5 }
  :solve {}]],
  function(result)
    assert.near(math.exp(-2), result[25][1].heat, 1e-6)
    assert.near(2 * 0.5 * (1 - math.exp(-2)), result[25][1].v.y, 0.05)
  end,
}

example "limit_speed" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{0, 3, 4}} } }
  :limit_speed { max = 2 }
  :solve {}]],
  function(result) assert.near({0, 1.2, 1.6}, result[25][1].v, 1e-6) end,
}

example "look_ahead" {
  [[
return rapid.create { points = rapid.points.from { P = {{-2, 0.1, 0}}, v = {{4, 0, 0}} } }
  :look_ahead { shape = rapid.shape.sphere { radius = 0.5 }, clearance = 0.2 }
  :solve {}]],
  function(result)
    for _, points in result:frames() do
      assert.is_true(points[1].P:length() > 0.5)
      assert.near(4, points[1].v:length(), 1e-5)
    end
    assert.is_true(result[25][1].P.x > 1)
  end,
}

example "merge" {
  [[
local still = rapid.create { points = rapid.points.grid {} } :solve {}
local falling = rapid.create { points = rapid.points.grid { center = {2, 0, 0} } } :gravity {} :solve {}
return still:merge(falling)]],
  function(result)
    assert.equal(2000, #result[25])
    assert.near(-9.81 / 4, result[25]:mean "P".y, 1e-4)
  end,
}

example "picture" {
  [[
return rapid.create {}
  :emit    { source = rapid.shape.sphere { radius = 0.1 }, rate = 3000, velocity = {0, 5, 0}, spread = 25,
             attributes = { Cd = {0.5, 0.2, 0.05} } }
  :gravity {} :solve {}
  :picture { blend = "add", shutter = 0.5, emitters = false }]],
  function(result, scene)
    local plain = rapid.run(write("plain.lua", (scene:gsub(":picture.*", ""))), { frames = {25, 25} })
    for i = 1, 3000, 300 do assert.near(plain[25][i].P, result[25][i].P, 0) end
  end,
}

example "pin" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :gravity {}
  :pin     { transform = function(frame) return rapid.translate(frame.time, 0, 0) end }
  :solve   {}]],
  function(result) assert.near({1, 1, 0}, result[25][1].P, 1e-5) end,
}

example "points" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :points ("shear", function(p, frame) p.v = vec3(p.P.y, 0, 0) end)
  :solve  {}]],
  function(result)
    for i = 1, 1000, 100 do assert.near(result[1][i].P.x + result[1][i].P.y, result[25][i].P.x, 1e-5) end
  end,
}

example "ramp" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, heat = {0, 0.5} } }
  :attribute { Cd = {1, 1, 1} }
  :ramp      { from = "heat", to = "Cd", keys = {{0, {0, 0, 1}}, {1, {1, 0, 0}}} }
  :solve     {}]],
  function(result)
    assert.near({0, 0, 1}, result[25][1].Cd, 0)
    assert.near({0.5, 0, 0.5}, result[25][2].Cd, 1e-7)
  end,
}

example "randomize" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :randomize { attribute = "pscale", min = 0.01, max = 0.03 }
  :solve     {}]],
  function(result)
    assert.is_true(result[25]:min "pscale" >= 0.01 and result[25]:max "pscale" <= 0.03)
    assert.near(0.02, result[25]:mean "pscale", 0.001)
  end,
}

example "rasterize" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :gravity   {}
  :solve     {}
  :rasterize { file = "smoke.####.vdb", voxel = 0.2 }]],
  function(_, scene)
    local ran = command.rapid("run " .. write("smoke.lua", scene) .. " -f 25 --quiet", { cwd = folder.path })
    assert.equal(0, ran.status, ran.stderr)
    local read = write("fog.lua", [[
local smoke = rapid.fog.read "smoke.0025.vdb"
return rapid.create {} :emit { source = smoke, count = 1000 } :solve {}]])
    assert.near(-9.81 / 2, rapid.run(read, { frames = {2, 2} })[2]:mean "P".y, 0.05)
  end,
}

example "solve" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{1, 5, 0}} } }
  :gravity {}
  :solve   { substeps = 4 }]],
  function(result) assert.near({1, 5 - 9.81 / 2, 0}, result[25][1].P, 1e-6) end,
}

example "spawn" {
  [[
local rocket = rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{0, 6, 0}}, life = {0.5} } }
  :gravity {} :solve {}
return rapid.create {}
  :spawn   { from = rocket, on = "death", count = 500, velocity = {0, 2, 0}, spread = 180, inherit_velocity = 0 }
  :gravity {} :solve {}]],
  -- A sphere about the end of the rocket's path, which falls for half a second.
  function(result)
    assert.equal(500, #result[25])
    local t = 0.5
    local center = vec3(0, 6 * t - 9.81 * t * t / 2 - 9.81 * t * t / 2, 0)
    for i = 1, 500, 50 do assert.near(2 * t, (result[25][i].P - center):length(), 1e-4) end
  end,
}

example "spin" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
  :spin  { axis = {0, 1, 0}, rate = 90 }
  :solve {}]],
  function(result) assert.near({0, 0, -1}, result[25][1].orient:rotate(vec3(1, 0, 0)), 1e-5) end,
}

example "spring" {
  [[
return rapid.create { points = rapid.points.from { P = {{1, 0, 0}} } }
  :spring { target = {0, 0, 0}, stiffness = 4 }
  :solve  {}]],
  function(result) assert.near(math.cos(2), result[25][1].P.x, 1e-5) end,
}

example "swirl" {
  [[
return rapid.create { points = rapid.points.from { P = {{2, 0, 0}} } }
  :swirl { axis = {0, 1, 0}, strength = 3 }
  :solve {}]],
  function(result) assert.near({0, 0, -6 / 24}, result[2][1].v, 1e-6) end,
}

example "torque" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, pscale = {0.1} } }
  :torque { torque = {0, 0.01, 0} }
  :solve  {}]],
  -- The moment of inertia of a solid sphere of 1 kg and 0.1 m is 0.004 kg m².
  function(result) assert.near({0, 2.5, 0}, result[25][1].w, 1e-5) end,
}

example "trail" {
  [[
return rapid.create { points = rapid.points.grid { size = {2, 2, 2}, spacing = 0.4 } }
  :vortex { strength = 8 }
  :solve  {}
  :trail  { places = 12 }]],
  function(result)
    assert.equal(12, result[25]:min "trailnum")
    assert.near(result[24][1].P, result[25][1].trail1, 0)
    assert.near(result[13][1].P, result[25][1].trail12, 0)
  end,
}

example "transfer" {
  [[
local sheet = rapid.mesh.from { points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, faces = {{1, 2, 3}},
                                values = { heat = {0, 1, 0} } }
return rapid.create { points = rapid.points.from { P = {{0.5, 0.1, 0.25}} } }
  :transfer { source = sheet }
  :solve    {}]],
  function(result) assert.near(0.5, result[25][1].heat, 1e-6) end,
}

example "tumble" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, w = {{0, math.pi / 2, 0}} } }
  :tumble {}
  :solve  {}]],
  function(result) assert.near({0, 0, -1}, result[25][1].orient:rotate(vec3(1, 0, 0)), 1e-5) end,
}

example "turbulence" {
  [[
return rapid.create { points = rapid.points.grid { size = {4, 0.02, 4}, spacing = 0.02 } }
  :turbulence { amplitude = 1, size = 1 }
  :solve      {}]],
  function(result) assert.near(1, rms(result[2], "v") * 24, 0.3) end,
}

example "vortex" {
  [[
return rapid.create { points = rapid.points.grid { size = {3, 0.03, 3}, spacing = 0.03 } }
  :vortex { axis = {0, 1, 0}, strength = 3 }
  :solve  {}]],
  function(result)
    local P, v = result[1][1].P, result[2][1].v
    assert.near(vec3(0, 1, 0):cross(P):normalized() * (3 / 24), v, 1e-3)
  end,
}

example "wander" {
  [[
return rapid.create { points = rapid.points.grid { size = {4, 4, 4}, spacing = 0.4 } }
  :wander { speed = 2, size = 1 }
  :solve  {}]],
  function(result) assert.near(2, rms(result[25], "v"), 0.6) end,
}

example "wind" {
  [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
  :wind  { velocity = {3, 0, 0}, drag = 2 }
  :solve {}]],
  function(result) assert.near(3 * (1 - math.exp(-2)), result[25][1].v.x, 1e-5) end,
}

example "wrap" {
  [[
return rapid.create { points = rapid.points.from { P = {{0.5, 0, 0}}, v = {{1, 0, 0}} } }
  :wrap  { min = {-1, -1, -1}, max = {1, 1, 1} }
  :solve {}]],
  function(result) assert.near(0.5 + 1 - 2, result[25][1].P.x, 1e-5) end,
}

example "write" {
  [[
return rapid.create { points = rapid.points.grid {} }
  :attribute { heat = 1 }
  :solve     {}
  :write     { file = "hot.####.csv", attributes = { "heat" } }]],
  function(_, scene)
    local ran = command.rapid("run " .. write("hot.lua", scene) .. " -f 2 --quiet", { cwd = folder.path })
    assert.equal(0, ran.status, ran.stderr)
    local rows = {}
    for row in folder:read "hot.0002.csv":gmatch "[^\n]+" do rows[#rows + 1] = row end
    assert.truthy(rows[1]:find("heat", 1, true))
    assert.equal(1001, #rows)
  end,
}

describe("the example of", function()
  for _, name in ipairs(order) do
    it(name .. " runs, and does what the reference says", function()
      local scene = examples[name].scene
      assert.truthy(scene:find("[:.]" .. name .. "%f[%W]"))
      examples[name].check(rapid.run(write(name .. ".lua", scene), { frames = {1, 25} }), scene)
    end)
  end

  it("a node exists for each node", function()
    for _, node in ipairs(json.decode(command.rapid "nodes --json".stdout)) do
      assert.truthy(examples[node.name], node.name)
    end
  end)
end)
