-- Parameters that are functions of the frame act as functions of time within it. Compared with closed forms or an
-- independent integration, including the reported error.
local scene = require "testing.scene"
local json = require "dkjson"

local last = 25 -- one second

-- Returns the error of the last frame, and its points.
local function run(nodes, frames, points_text)
  frames = frames or last
  local text = ("return rapid.create { fps = 24, points = %s } "):format(points_text or "two") .. nodes
  local ran = scene.command("run", text, ("-f 1-%d --quiet --stats stats.json"):format(frames))
  assert.equal(0, ran.status, ran.stderr)
  local reported = json.decode(scene.folder:read "stats.json").frames[frames]
  return reported.error, scene.run(text, { frames = {frames, frames} })[frames], reported
end

-- Returns the solution of x'' = f(x, v, t) for one point after a second, by Runge-Kutta.
local function integrated(f, x, v)
  local n = 4000
  local dt = 1 / n
  for i = 0, n - 1 do
    local t = i * dt
    local a1 = f(x, v, t)
    local a2 = f(x + dt / 2 * v, v + dt / 2 * a1, t + dt / 2)
    local a3 = f(x + dt / 2 * v + dt * dt / 4 * a1, v + dt / 2 * a2, t + dt / 2)
    local a4 = f(x + dt * v + dt * dt / 2 * a2, v + dt * a3, t + dt)
    x = x + dt * v + dt * dt / 6 * (a1 + a2 + a3)
    v = v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
  end
  return x
end

local function within(reported, off, what)
  assert.truthy(reported < 4 * off and reported > off / 4, ("%s: told %g m, it is %g m"):format(what, reported, off))
end

describe("a force's function of the frame is one of time:", function()
  local sine = "math.sin(2 * math.pi * f.time)"
  local function omega(t) return math.sin(2 * math.pi * t) end
  -- Nodes, and the acceleration along x of the point that starts at rest at 0.
  local scenes = {
    ["a spring's target"] = { (":spring { stiffness = 60, target = function(f) return {2 * %s, 1, 0} end }")
      :format(sine), function(x, _, t) return 60 * (2 * omega(t) - x) end },
    ["a spring's stiffness"] = { (":spring { stiffness = function(f) return 50 + 40 * %s end, target = {1, 1, 0} }")
      :format(sine), function(x, _, t) return (50 + 40 * omega(t)) * (1 - x) end },
    ["the velocity of wind"] = { (":wind { drag = 3, velocity = function(f) return {5 * %s, 0, 0} end }"):format(sine),
      function(_, v, t) return 3 * (5 * omega(t) - v) end },
    ["the rate of wind"] = { (":wind { drag = function(f) return 3 + 2 * %s end, velocity = {5, 0, 0} }"):format(sine),
      function(_, v, t) return (3 + 2 * omega(t)) * (5 - v) end },
    ["an acceleration"] = { (":gravity { g = function(f) return {30 * %s, 0, 0} end }"):format(sine),
      function(_, _, t) return 30 * omega(t) end },
    ["a center"] = { (":attract { falloff = -1, strength = 9, center = function(f) return {3 * %s, 1, 0} end }")
      :format(sine), function(x, _, t) return 9 * (3 * omega(t) - x) end },
  }
  for name, entry in pairs(scenes) do
    local nodes, f = unpack(entry)
    local truth = integrated(f, 0, 0)

    it(name .. ", within a millimetre at 16 sub-steps and by a tolerance", function()
      for _, solve in ipairs { "substeps = 16", "tolerance = 1e-5" } do
        local _, points = run(nodes .. (" :solve { %s }"):format(solve))
        assert.near(truth, points[1].P.x, 5e-4)
      end
    end)

    it(name .. ", with its error told", function()
      for _, substeps in ipairs { 1, 2, 16 } do
        local reported, points = run(nodes .. (" :solve { substeps = %d }"):format(substeps))
        local off = math.abs(truth - points[1].P.x)
        assert.truthy(reported.position_max > off / 4,
          ("%d sub-steps: told %g m, it is %g m"):format(substeps, reported.position_max, off))
        if substeps == 1 then within(reported.position_max, off, name) end
      end
    end)
  end

  it("of second order in sub-steps", function()
    local nodes, f = unpack(scenes["a spring's target"])
    local truth, off = integrated(f, 0, 0), {}
    for _, substeps in ipairs { 1, 2, 4 } do
      local _, points = run(nodes .. (" :solve { substeps = %d }"):format(substeps))
      off[#off + 1] = math.abs(truth - points[1].P.x)
    end
    assert.truthy(off[1] / off[2] > 3.3 and off[2] / off[3] > 3.3, table.concat(off, ", "))
  end)

  it("an impulse in one frame is given as a whole", function()
    local _, points = run(":gravity { g = function(f) return {f.number == 8 and 24 or 0, 0, 0} end } :solve {}")
    assert.near(1, points[1].v.x, 1e-5)
  end)

  it("the same bits, at all sub-steps in one, where it gives the same in each frame", function()
    for _, force in ipairs { { ":gravity { g = {0, -9, 0} }", ":gravity { g = function() return {0, -9, 0} end }" },
      { ":wind { velocity = {3, 0, 0} }", ":wind { velocity = function() return {3, 0, 0} end }" } } do
      local reported, points = run(force[2] .. " :solve { substeps = 4 }")
      local _, constant = run(force[1] .. " :solve {}")
      assert.equal(0, reported.position_max)
      assert.equal(constant[1].P, points[1].P)
    end
  end)

  it("of points that are born within a frame, at their own times", function()
    local text = [[return rapid.create { fps = 24, seed = 2 }
      :emit { source = two, from = "points", rate = 60, birth = "even" }
      :wind { drag = 3, velocity = function(f) return {5 * math.sin(2 * math.pi * f.time), 0, 0} end }
      :solve { substeps = %d }]]
    local found = scene.run(text:format(16), { frames = {last, last} })[last]
    local truth = scene.run(text:format(512), { frames = {last, last} })[last]
    assert.truthy(#found == 60, #found)
    for i = 1, #found do assert.near(truth[i].P, found[i].P, 2e-4) end
  end)
end)

describe("a pin's place that is a function of the frame is one of time:", function()
  local place = "function(f) return {2 * math.sin(2 * math.pi * f.time), 1, 0} end"

  it("a compliant one draws as a spring to it does, of second order, with its error told", function()
    local truth, off = {}, {}
    for i = 1, 2 do
      truth[i] = integrated(function(x, _, t) return 60 * (2 * math.sin(2 * math.pi * t) - x) end, i - 1, 0)
    end
    for i, substeps in ipairs { 2, 4, 8 } do
      local reported, points = run((":pin { target = %s, compliance = 1 / 60 } :solve { substeps = %d }"):format(place,
        substeps))
      off[i] = math.max(math.abs(truth[1] - points[1].P.x), math.abs(truth[2] - points[2].P.x))
      within(reported.position_max, off[i], "a pin")
    end
    assert.truthy(off[1] / off[2] > 3.3 and off[2] / off[3] > 3.3, table.concat(off, ", "))
    assert.truthy(off[3] < 2e-3, off[3])
  end)

  it("a rigid one is there at the ends of frames, at the speed of the function", function()
    for _, substeps in ipairs { 1, 3 } do
      local nodes = (":pin { target = %s } :solve { substeps = %d }"):format(place, substeps)
      for frame = 2, last, 5 do
        local _, points = run(nodes, frame)
        local t = (frame - 1) / 24
        assert.near({2 * math.sin(2 * math.pi * t), 1, 0}, points[1].P, 1e-6)
        -- The cubic through four frames, for a sine of 24 frames: order 3 in the velocity.
        assert.near(4 * math.pi * math.cos(2 * math.pi * t), points[1].v.x, 0.06)
      end
    end
  end)

  it("points on a rod follow it, and their error is estimated", function()
    local nodes = [[:group { name = "hook", where = function(p) return p.id == 0 end } :gravity {}
      :pin { group = "hook", target = function(f) return {0.3 * math.sin(9 * f.time), 1, 0} end }
      :distance { pairs = {{1, 2}} } :solve { substeps = 4 }]]
    local reported, points = run(nodes, 18)
    local truth = scene.run("return rapid.create { fps = 24, points = two, subframes = 64 } " .. nodes,
      { frames = {18, 18} })[18]
    within(reported.position_max, (truth[2].P - points[2].P):length(), "a rod on a hook")
  end)

  it("a jump is gone through within the frame at whose end it is there", function()
    local nodes = ":pin { target = function(f) return {f.number >= 8 and 24 or 0, 0, 0} end } :solve { substeps = 4 }"
    for frame, x in pairs { [7] = 0, [8] = 24, [9] = 24 } do
      local _, points = run(nodes, frame)
      assert.near({x, 0, 0}, points[1].P, 1e-6)
      assert.near({frame == 8 and 24 * 24 or 0, 0, 0}, points[1].v, 1e-3)
    end
  end)
end)

describe("the error of what is a function of the frame is told", function()
  it("of a force's group alone", function()
    local reported = run [[:group { name = "right", where = function(p) return p.P.x > 0.5 end }
      :attract { group = "right", core = 1, strength = 5, center = function(f) return {0, 4 * f.time, 0} end }
      :solve { substeps = 2 }]]
    assert.equal(0, reported.position_p50) -- the lower of two
    assert.truthy(reported.position_max > 1e-5)
  end)

  it("of coupled points", function()
    local nodes = [[:gravity { g = function(f) return {0, -6 * math.sin(9 * f.time), 0} end }
      :distance { pairs = {{1, 2}} } :solve { substeps = 1 }]]
    local reported, points = run(nodes)
    local truth = integrated(function(_, _, t) return -6 * math.sin(9 * t) end, 1, 0)
    within(reported.position_max, math.abs(points[1].P.y - truth), "a rod")
  end)

  local kinds = {
    ["of neighbours"] = { 24, [[:interact { radius = 3,
      separation = function(f) return 20 * math.sin(7 * f.time) ^ 2 end } :solve { substeps = 2 }]] },
    ["of a shape's friction"] = { 12, [[:gravity { g = {9, -9, 0} } :collide { shape = rapid.shape.plane { offset = 1 },
      bounce = 0, friction = function(f) return 0.8 * f.time end } :solve { substeps = 4 }]] },
    ["of a contact's friction"] = { 7, [[:gravity { g = {0, -9, 0} }
      :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 1 } :contact { radius = 0.5,
        friction = function(f) return f.time end } :solve { substeps = 8, sleep = math.huge }]],
      "rapid.points.from { P = {{0, 0.5, 0}, {0.6, 1.3, 0}}, v = {{0, 0, 0}, {0, 0, 1}}, mass = {100, 1} }" },
  }
  for name, entry in pairs(kinds) do
    it(name, function()
      local frames, nodes, set = unpack(entry)
      local reported, points, all = run(nodes, frames, set)
      assert.falsy(all.left_out_of_errors)
      local text = ("return rapid.create { fps = 24, points = %s, subframes = 64 } "):format(set or "two") .. nodes
      local truth, off = scene.run(text, { frames = {frames, frames} })[frames], 0
      for i = 1, #truth do off = math.max(off, (truth[i].P - points[i].P):length()) end
      within(reported.position_max, off, name)
    end)
  end

  it("and what is not in it is named", function()
    local _, _, reported = run([[:turbulence { octaves = function(f) return 1 + f.number % 2 end } :solve {}]], 4)
    assert.same({ "turbulence1.octaves, a function of the frame that is called once in each" },
      reported.left_out_of_errors)
  end)
end)
