-- Forces against closed forms, at one substep per frame of 1/24 s unless a test states otherwise.
local scene = require "testing.scene"

-- One point from P with velocity v under the nodes of `chain`, after a second.
local function after_a_second(chain, P, v, substeps)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{%s}}, v = {{%s}} } }
  :attribute { mass = 2 } %s :solve { substeps = %d }]]):format(P or "0, 0, 0", v or "0, 0, 0", chain, substeps or 1),
    { frames = {25, 25} })[25][1]
end

-- Tolerance: rounding of the state to single precision once per frame.
local function within(expected, value, places)
  local size = math.max(math.abs(expected.x), math.abs(expected.y), math.abs(expected.z), places or 0, 1e-6)
  assert.near({expected.x, expected.y, expected.z}, value, 24 * 2 ^ -23 * size)
end

describe("linear drag", function()
  it("is exact with gravity, from hardly any to stiff", function()
    for exponent = -5, 7 do
      local k = 10 ^ exponent
      local p = after_a_second((":gravity {} :drag { linear = %.17g }"):format(k), "0, 0, 0", "3, 0, 0")
      local fading = math.exp(-k)
      local travel = k > 1e-3 and (1 - fading) / k or 1 - k / 2 + k * k / 6
      local fall = k > 1e-2 and (1 - travel) / k or 0.5 - k / 6 + k * k / 24 - k ^ 3 / 120
      within(vec3(3 * fading, -9.81 * travel, 0), p.v)
      within(vec3(3 * travel, -9.81 * fall, 0), p.P)
    end
  end)

  it("of several nodes adds up, and wind draws to its velocity", function()
    local p = after_a_second(":wind { velocity = {2, 0, 0}, drag = 3 } :drag { linear = 1 } :wind { drag = 2 }")
    within(vec3(1 * (1 - math.exp(-6)), 0, 0), p.v) -- 3 * 2 / (3 + 1 + 2)
    within(vec3(1 - (1 - math.exp(-6)) / 6, 0, 0), p.P)
  end)

  it("is the same at any number of sub-steps", function()
    local one = after_a_second(":gravity {} :drag { linear = 5 }", "0, 0, 0", "3, 2, 1", 1)
    local many = after_a_second(":gravity {} :drag { linear = 5 }", "0, 0, 0", "3, 2, 1", 16)
    within(one.P, many.P)
    within(one.v, many.v)
  end)

  it("is by each point's own rate, and on a group alone", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
    v = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, rate = {1, 2, 3} } }
  :group { name = "dragged", where = function(p) return p.id < 2 end }
  :drag { linear = rapid.attr "rate", group = "dragged" } :solve {}]], { frames = {25, 25} })[25]
    assert.near(math.exp(-1), points[1].v.x, 1e-5)
    assert.near(math.exp(-2), points[2].v.x, 1e-5)
    assert.equal(1, points[3].v.x)
  end)
end)

describe("quadratic drag", function()
  it("of a point alone is its closed form", function()
    local p = after_a_second(":drag { quadratic = 0.5 }", "0, 0, 0", "4, 0, 0")
    assert.near({4 / 3, 0, 0}, p.v, 1e-5) -- v0 / (1 + c v0 t)
    assert.near({2 * math.log(3), 0, 0}, p.P, 2e-3)
  end)

  it("falls as the closed form, of second order", function()
    local c = 2
    local terminal = math.sqrt(9.81 / c)
    local expected = -terminal * math.log(math.cosh(9.81 / terminal)) * terminal / 9.81
    local function off(substeps)
      local p = after_a_second((":gravity {} :drag { quadratic = %g }"):format(c), nil, nil, substeps)
      return math.abs(p.P.y - expected)
    end
    assert.truthy(off(1) < 2e-3, off(1))
    assert.truthy(off(4) < off(1) / 8 + 2e-6, off(4))
  end)

  it("keeps its terminal speed within 1 %, and turns no velocity round, at any stiffness", function()
    for exponent = -2, 10 do -- c g dt² from 2e-4 to 2e8
      local c = 10 ^ exponent
      local terminal = math.sqrt(9.81 / c)
      local down = after_a_second((":gravity {} :drag { quadratic = %.17g }"):format(c), nil,
        ("0, %.17g, 0"):format(-terminal)).v
      assert.near(-terminal, down.y, 0.01 * terminal)
      local across = after_a_second((":drag { quadratic = %.17g }"):format(c), nil, "1000, 0, 0").v
      assert.truthy(across.x >= 0 and across.x <= 1000, across.x)
    end
  end)
end)

describe("a spring", function()
  it("is the exact damped oscillator, at any stiffness and damping", function()
    for _, case in ipairs { {8, 0}, {8, 2}, {8, 40}, {2e4, 3}, {2e9, 10}, {1e-6, 0}, {8, 1e9} } do
      local k, d = case[1] / 2, case[2] / 2 -- a mass of 2
      local p = after_a_second((":spring { target = {1, 0, 0}, stiffness = %.17g, damping = %.17g }")
        :format(case[1], case[2]), "3, 0, 0", "0, 1, 0")
      local half = d / 2
      local x, y
      local square = k - half * half
      if square > 0 then
        local w = math.sqrt(square)
        local fading = math.exp(-half)
        x = 1 + 2 * fading * (math.cos(w) + half / w * math.sin(w))
        y = fading * math.sin(w) / w
      else
        local root = math.sqrt(-square)
        local fast, slow = -(half + root), -k / (half + root)
        x = 1 + 2 * (fast * math.exp(slow) - slow * math.exp(fast)) / (fast - slow)
        y = (math.exp(slow) - math.exp(fast)) / (slow - fast)
      end
      -- Rounding the state once per frame shifts a stiff oscillator's phase: by ulp(v)/w each time.
      assert.near({x, y, 0}, p.P, 1e-4)
    end
  end)

  it("with drag and gravity rests where they balance", function()
    local p = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}} } }
  :gravity {} :wind { velocity = {1, 0, 0}, drag = 2 } :spring { stiffness = 50, target = {0, 1, 0} }
  :solve {}]], { frames = {480, 480} })[480][1]
    assert.near({2 / 50, 1 - 9.81 / 50, 0}, p.P, 1e-5)
    assert.near({0, 0, 0}, p.v, 1e-5)
  end)

  it("pulls points to positions of their own, and to a shape", function()
    local p = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, home = {{5, 6, 7}} } }
  :spring { target = rapid.attr "home", stiffness = 30, damping = 8 } :solve {}]], { frames = {240, 240} })[240][1]
    assert.near({5, 6, 7}, p.P, 1e-5)
    p = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{3, 4, 0}} } }
  :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = 30, damping = 8 } :solve {}]],
      { frames = {240, 240} })[240][1]
    assert.near({0.6, 0.8, 0}, p.P, 1e-5)
  end)
end)

describe("attraction", function()
  it("by the inverse square is Kepler's ellipse, of second order", function()
    -- One revolution from the far end of an ellipse.
    local speed = math.sqrt(0.5)
    local a = 1 / (2 / 2 - speed ^ 2)
    local function off(substeps)
      local points = scene.run(([[
return rapid.create { fps = 24 / (2 * math.pi * %.17g),
    points = rapid.points.from { P = {{2, 0, 0}}, v = {{0, 0, %.17g}} } }
  :attract { strength = 1 } :solve { substeps = %d }]]):format(a ^ 1.5, speed, substeps), { frames = {25, 25} })[25]
      return (points[1].P - vec3(2, 0, 0)):length()
    end
    local coarse, fine = off(8), off(32)
    assert.truthy(fine < coarse / 10, ("%g %g"):format(coarse, fine))
    assert.truthy(fine < 0.01, fine)
  end)

  it("falls off with its exponent, is softened by a core, and is zero at the centre", function()
    local function first(options, place)
      return scene.run(([[
return rapid.create { fps = 1000, points = rapid.points.from { P = {{%s}} } } :attract { %s } :solve {}]])
        :format(place, options), { frames = {2, 2} })[2][1].v * 1000
    end
    assert.near({-3 / 4, 0, 0}, first("strength = 3", "2, 0, 0"), 1e-5)
    assert.near({-3, 0, 0}, first("strength = 3, falloff = 0", "2, 0, 0"), 1e-5)
    assert.near({-3 * 2 / (4 + 1) ^ 1.5, 0, 0}, first("strength = 3, core = 1", "2, 0, 0"), 1e-5)
    assert.near({0, 0, 0}, first("strength = 3", "0, 0, 0"), 0)
    assert.near({3, 0, 0}, first("strength = -3, falloff = 0, center = {1, 0, 0}", "2, 0, 0"), 1e-5)
    assert.near({0, -1, 0}, first("falloff = 0, shape = rapid.shape.plane {}", "2, 3, 4"), 1e-5)
  end)
end)

describe("a vortex", function()
  it("drives around its axis, as strongly at any distance", function()
    local points = scene.run([[
return rapid.create { fps = 1000, points = rapid.points.from { P = {{1, 5, 0}, {0, 0, 7}, {0, 9, 0}} } }
  :vortex { strength = 2, axis = {0, 3, 0} } :solve {}]], { frames = {2, 2} })[2]
    assert.near({0, 0, -0.002}, points[1].v, 1e-8)
    assert.near({0.002, 0, 0}, points[2].v, 1e-8)
    assert.near({0, 0, 0}, points[3].v, 0)
  end)
end)

describe("turbulence", function()
  it("is the curl noise that kernels ask for, at the middle of the step", function()
    local points = scene.run([[
return rapid.create { fps = 1000, points = rapid.points.grid { size = {4, 4, 4}, spacing = 1 } }
  :attribute { expected = {0, 0, 0} }
  :points("ask", function(p) p.expected = rapid.math.curl_noise(p.P / 2, 3 * 0.0005, 2, 7) * 5 end)
  :turbulence { amplitude = 5, size = 2, speed = 3, octaves = 2, seed = 7 } :solve {}]], { frames = {2, 2} })[2]
    local largest = 0
    for i = 1, #points do
      local expected = points[i].expected
      assert.near({expected.x, expected.y, expected.z}, points[i].v * 1000, 1e-3)
      largest = math.max(largest, expected:length())
    end
    assert.truthy(largest > 2)
  end)
end)

describe("forces with linear parts", function()
  local text = [[
return rapid.create { fps = 24, seed = 1 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 3, 0} }, rate = 100000, speed = 2, spread = 40,
          life = 0.4 }
  :gravity {} :drag { linear = %s, quadratic = %s } :turbulence { amplitude = 20 }
  :spring { target = {0, 1, 0}, stiffness = %s }
  :collide { shape = rapid.levelset.sphere { radius = 1, voxel = 0.05 }, bounce = 0.5, friction = 0.2 }
  :collide { shape = rapid.shape.plane {}, bounce = 0.4, friction = 0.3 }
  :solve { substeps = %s }]]

  it("keep points out of shapes, however stiff they are, and are the same bits on 1, 2 and 7 threads", function()
    for _, case in ipairs { {0.5, 0, 0, 1}, {300, 0, 0, 1}, {0, 50, 0, 2}, {1, 1, 5000, 1}, {1e6, 1e6, 1e6, 3} } do
      local scene_text = text:format(unpack(case))
      local one = scene.run(scene_text, { frames = {12, 12}, threads = 1 })[12]
      assert.points(one).finite()
      assert.truthy(one:min("P").y >= 0)
      for i = 1, #one, 7 do assert.truthy(one[i].P:length() > 1 - 2e-3, case[1]) end
      for _, threads in ipairs { 2, 7 } do
        assert.same_points(one, scene.run(scene_text, { frames = {12, 12}, threads = threads })[12])
      end
    end
  end)

  it("let points slide to rest on a floor, and stay there", function()
    local points = scene.run([[
return rapid.create { fps = 24,
    points = rapid.points.from { P = {{0, 0, 0}, {0, 1, 0}}, v = {{3, 0, 0}, {0, 0, 0}} } }
  :gravity {} :drag { linear = 4 } :collide { shape = rapid.shape.plane {}, bounce = 0.3 } :solve {}]],
      { frames = {240, 240} })[240]
    assert.near({3 / 4, 0, 0}, points[1].P, 0.01) -- the drag's distance, without friction
    assert.equal(0, points[2].P.y)
    assert.equal(0, points[2].v.y)
  end)
end)
