-- :curve_force against closed forms, and curves as sources and in files.
local scene = require "testing.scene"

local function after(frame, chain, options)
  options = options or {}
  return scene.run(([[
%s
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s} } } %s :solve { substeps = %d }]])
    :format(options.head or "", options.P or "{0, 0, 0}", options.v or "{0, 0, 0}", chain, options.substeps or 1),
    { frames = {frame, frame} })[frame][1]
end

describe("curve_force", function()
  it("along a straight curve is a drag to the speed, and across it a damped spring", function()
    local fallen, last = math.exp(-6), nil
    -- y'' = -6 y' - 25 y, from rest: e^(-3t) (cos 4t + 3/4 sin 4t)
    local y = math.exp(-3) * (math.cos(4) + 0.75 * math.sin(4))
    for _, substeps in ipairs { 4, 8, 16, 32 } do
      local p = after(25, [[
:curve_force { curve = {{-9, 0, 0}, {0, 0, 0}, {20, 0, 0}}, speed = 2, pull = 25, drag = 6 }]],
        { P = "{0, 0.5, -1}", substeps = substeps })
      -- Exact at any step across the curve. Along it, the attracting position is held for a substep: second order.
      assert.near(0.5 * y, p.P.y, 2e-6)
      assert.near(-y, p.P.z, 2e-6)
      local error = math.abs(p.P.x - 2 * (1 - (1 - fallen) / 6))
      assert.is_true(error < 0.002)
      if last then assert.near(4, last / error, 0.3) end
      last = error
    end
    local p = after(25, ":curve_force { curve = {{0, 0, 0}, {20, 0, 0}}, speed = 2, pull = 0, drag = 6 }",
      { P = "{0.1, 0, 0}" })
    assert.near({0.1 + 2 * (1 - (1 - fallen) / 6), 0, 0}, p.P, 2e-6)
    assert.near(2 * (1 - fallen), p.v.x, 2e-6)
  end)

  it("holds points on a closed curve, at its speed", function()
    local points = {}
    for k = 0, 119 do
      local a = 2 * math.pi * k / 120
      points[#points + 1] = ("{%.9f, 0, %.9f}"):format(math.cos(a), math.sin(a))
    end
    local chain = (":curve_force { curve = {%s}, closed = true, speed = 1.5, pull = 4000, drag = 60 }")
      :format(table.concat(points, ", "))
    local p = after(97, chain, { P = "{1, 0, 0}", v = "{0, 0, 1.5}", substeps = 16 })
    -- At rest in the turning frame: the pull balances v²/r = 2.25 m/s², 0.56 mm outside.
    assert.near(1 + 2.25 / 4000, p.P:length(), 6e-4)
    assert.near(1.5, p.v:length(), 0.006)
    assert.near(1.5 * 4 % (2 * math.pi), math.atan2(p.P.z, p.P.x) % (2 * math.pi), 0.05)
  end)

  it("falls to 0 at its radius, and is nothing beyond the ends of an open curve", function()
    local chain = ":curve_force { curve = {{0, 0, 0}, {1, 0, 0}}, radius = 0.5, speed = 3, pull = 0, drag = 8 }"
    assert.near({0, 0, 0}, after(2, chain, { P = "{0.5, 0.5, 0}" }).v, 0)
    assert.near({0, 0, 0}, after(2, chain, { P = "{-0.01, 0.1, 0}" }).v, 0)
    assert.near({0, 0, 0}, after(2, chain, { P = "{1.01, 0.1, 0}" }).v, 0)
    -- The weight at a fifth of a metre is (1 - 0.16)²; a step of 1/24 s from rest.
    local k = 8 * 0.84 ^ 2
    assert.near(3 * (1 - math.exp(-k / 24)), after(2, chain, { P = "{0.5, 0.2, 0}" }).v.x, 1e-6)
  end)

  it("of a curve that is a function of the frame acts as that at the time of each sub-step", function()
    local moving = [[function(frame)
      local y = math.sin(6 * frame.time)
      return {{-5, y, 0}, {5, y, 0}} end]]
    local spring = ":spring { target = function(frame) return {0, math.sin(6 * frame.time), 0} end, stiffness = 30 }"
    local force = (":curve_force { curve = %s, pull = 30, drag = 0 }"):format(moving)
    for _, substeps in ipairs { 4, 16 } do
      local a, b = after(25, spring, { substeps = substeps }), after(25, force, { substeps = substeps })
      assert.near(a.P, b.P, 1e-6)
      assert.near(a.v, b.v, 1e-5)
    end
    -- y'' = 30 (sin 6t - y), from rest at 0: with w² = 30 the forced oscillation is 30/(30 - 36) (sin 6t - 6/w sin
    -- wt).
    local w = math.sqrt(30)
    local exact = 30 / (30 - 36) * (math.sin(6) - 6 / w * math.sin(w))
    assert.near(exact, after(25, force, { substeps = 32 }).P.y, 1e-3)
  end)

  it("takes the lines of an .obj file, and those of a trail that was written", function()
    scene.folder:write("path.obj", "# a path\nv 0 0 0\nv 9 9 9\nv 2 0 0\nvt 0 0\nl 1/1 -1/1\n")
    local p = after(25, ":curve_force { curve = rapid.points.read 'path.obj', speed = 1, pull = 0, drag = 40 }",
      { P = "{0.1, 0, 0.2}" })
    assert.near(1.1 - (1 - math.exp(-40)) / 40, p.P.x, 1e-5)

    local result = scene.command("run", [[
return rapid.create { fps = 24,
    points = rapid.points.from { P = {{0, 0, 0}, {0, 3, 0}}, v = {{24, 0, 0}, {0, 24, 0}} } }
  :trail { places = 3 } :solve {}]], "-f 1-6 -o trail.####.obj")
    assert.equal(0, result.status, result.stderr)
    local read = scene.run([[return rapid.create { points = rapid.points.read "trail.0006.obj" } :solve {}]],
      { frames = {1, 1} })[1]
    local want = { {5, 0, 0}, {4, 0, 0}, {3, 0, 0}, {2, 0, 0}, {0, 8, 0}, {0, 7, 0}, {0, 6, 0}, {0, 5, 0} }
    assert.equal(8, #read)
    for i = 1, 8 do
      assert.near(want[i], read[i].P, 1e-5)
      assert.equal(i <= 4 and 0 or 1, read[i].curve)
    end
  end)

  it("takes the lines of trails and curves in .bgeo files", function()
    local result = scene.command("run", [[
return rapid.create { fps = 24,
    points = rapid.points.from { P = {{0, 0, 0}, {0, 3, 0}}, v = {{24, 0, 0}, {0, 24, 0}} } }
  :trail { places = 3 } :solve {}]], "-f 1-6 -o trail.####.bgeo")
    assert.equal(0, result.status, result.stderr)
    -- Born along the first trail, from (5, 0, 0) to (2, 0, 0), or the second, from (0, 8, 0) to (0, 5, 0).
    local born = scene.run([[
return rapid.create { fps = 24 }
  :emit { source = rapid.curve.read "trail.0006.bgeo", count = 400, birth = "end" } :solve {}]],
      { frames = {2, 2} })[2]
    local on_first = 0
    for i = 1, #born do
      local P = born[i].P
      local first = P.y == 0 and P.x >= 2 and P.x <= 5
      assert.is_true(first or (P.x == 0 and P.y >= 5 and P.y <= 8))
      if first then on_first = on_first + 1 end
    end
    assert.is_true(on_first > 150 and on_first < 250) -- both are equally long

    -- Lines of an .obj are written as lines of a .bgeo.
    scene.folder:write("path.obj", "v 0 0 0\nv 2 0 0\nv 0 5 0\nv 0 9 0\nl 1 2\nl 3 4\n")
    assert.equal(0, scene.command("run", [[
return rapid.create { fps = 24, points = rapid.points.read "path.obj" } :solve {}]], "-f 1-1 -o path.bgeo").status)
    born = scene.run([[
return rapid.create { fps = 24 }
  :emit { source = rapid.curve.read "path.bgeo", count = 100, birth = "end" } :solve {}]], { frames = {2, 2} })[2]
    for i = 1, #born do
      local P = born[i].P
      assert.is_true((P.y == 0 and P.x <= 2) or (P.x == 0 and P.y >= 5 and P.y <= 9))
    end
  end)

  it("reports wrong arguments", function()
    local function fault(arguments)
      return scene.error("return rapid.create {} :curve_force { " .. arguments .. " } :solve {}")
    end
    assert.truthy(fault(""):find("curve is missing", 1, true))
    assert.truthy(fault("curve = {{0, 0, 0}}"):find("curve has 1 points; a curve needs at least two", 1, true))
    assert.truthy(fault("curve = {{0, 0, 0}, {0, 0, 0}}"):find("points 1 and 2 have the same position", 1, true))
    assert.truthy(fault("curve = 3"):find("curve = 3", 1, true))
    local function of_file(text)
      scene.folder:write("bad.obj", text)
      return scene.error("rapid.points.read 'bad.obj'")
    end
    assert.truthy(of_file("v 0 0\n"):find('line 1: "" is not a number', 1, true))
    assert.truthy(of_file("v 0 0 0\nl 1 2\n"):find("line 2: there is no vertex 2 of 1", 1, true))
    assert.truthy(of_file("v 0 0 0\nl 1 0\n"):find("there is no vertex 0 of 1", 1, true))
    assert.truthy(of_file("v 0 nan 0\n"):find("must be finite", 1, true))
    assert.truthy(of_file("hello\n"):find("is not an .obj file with vertices", 1, true))
  end)

  it("is the same on any number of threads", function()
    local text = [[return rapid.create { points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.1 } }
  :curve_force { curve = {{-1, 0, 0}, {0, 1, 0.5}, {1, 0, 0}}, radius = 1 } :solve { substeps = 2 }]]
    local one = scene.run(text, { frames = {1, 5}, threads = 1 })
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one[5], scene.run(text, { frames = {1, 5}, threads = threads })[5])
    end
  end)
end)

describe("rapid.points.along", function()
  local function points(arguments)
    return scene.run(("return rapid.create { points = rapid.points.along(%s) } :solve {}"):format(arguments),
      { frames = {1, 1} })[1]
  end

  it("has points at even distances, with the direction and the part of the length", function()
    local open = points "{{0, 0, 0}, {3, 0, 0}, vec3(3, 1, 0)}, { count = 9 }"
    for i = 1, 9 do
      local s = (i - 1) * 0.5
      assert.near(s <= 3 and {s, 0, 0} or {3, s - 3, 0}, open[i].P, 1e-6)
      assert.near(s < 3 and {1, 0, 0} or {0, 1, 0}, open[i].N, 1e-6)
      assert.near(s / 4, open[i].u, 1e-6)
    end
    local closed = points "{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, { count = 8, closed = true }"
    assert.near({0, 0, 0.5}, closed[8].P, 1e-6)
  end)

  it("of a moving curve emits along its path, between the frames too", function()
    local text = [[
local function path(frame) return rapid.points.along({{0, frame.time, 0}, {1, frame.time, 0}}, { count = 50 }) end
return rapid.create { fps = 24, seed = 2 } :points("r", function(p) local _ = p.birthtime end)
  :emit { source = path, rate = 4000, speed = 0, inherit_velocity = 0 } :solve {}]]
    local result = scene.run(text, { frames = {1, 12} })[12]
    assert.is_true(#result > 1500)
    for i = 1, #result do assert.near(result[i].birthtime, result[i].P.y, 2e-3) end
  end)

  it("reports wrong arguments", function()
    local function fault(arguments) return scene.error("rapid.points.along(" .. arguments .. ")") end
    assert.truthy(fault("{{0, 0, 0}}"):find("a curve is a list of at least two points", 1, true))
    assert.truthy(fault("{{0, 0, 0}, 3}"):find("point 2 is 3", 1, true))
    assert.truthy(fault("{{0, 0, 0}, {1, 0, 0}}, { count = 1 }"):find("count = 1", 1, true))
    assert.truthy(fault("{{0, 0, 0}, {1, 0, 0}}, { cout = 1 }"):find('did you mean "count"?', 1, true))
    assert.truthy(fault("{{0, 0, 0}, {0, 0, 0}}"):find("the curve has no length", 1, true))
  end)
end)
