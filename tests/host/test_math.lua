-- rapid.math in kernels: closed forms, noises bit-identical to the C++ runtime, refused arguments.
local scene = require "testing.scene"

-- Returns x as a kernel computes it: the bits of a double are stored in three floats.
local function value(expression)
  local points = scene.kernel(("local x = %s p.a = x p.b = x - p.a p.c = x - p.a - p.b"):format(expression),
    "a = {0, 0}, b = {0, 0}, c = {0, 0}")
  local p = points[1]
  return p.c + p.b + p.a
end

local function fault(expression)
  local message = scene.kernel_error("p.v = p.v * " .. expression)
  return assert(message:match '^scene%.lua:2: node "kernel": (.*) %(point id 0, frame 2%)$', message)
end

describe("rapid.math", function()
  it("clamps", function()
    assert.equal(0.25, value "rapid.math.clamp(0.25, 0, 1)")
    assert.equal(0, value "rapid.math.clamp(-3, 0, 1)")
    assert.equal(1, value "rapid.math.clamp(3, 0, 1)")
    assert.equal(2, value "rapid.math.clamp(5, 2, 2)")
  end)

  it("fits a number from one range to another, either way round, and holds it at the ends", function()
    assert.equal(15, value "rapid.math.fit(0.5, 0, 1, 10, 20)")
    assert.equal(17.5, value "rapid.math.fit(0.5, 0, 2, 20, 10)")
    assert.equal(12.5, value "rapid.math.fit(1.5, 2, 0, 10, 20)")
    assert.equal(10, value "rapid.math.fit(-1, 0, 1, 10, 20)")
    assert.equal(20, value "rapid.math.fit(9, 0, 1, 10, 20)")
  end)

  it("steps smoothly", function()
    for t, expected in pairs { [-1] = 0, [0] = 0, [0.25] = 0.15625, [0.5] = 0.5, [1] = 1, [7] = 1 } do
      assert.equal(expected, value(("rapid.math.smoothstep(2, 4, %g)"):format(2 + 2 * t)))
    end
  end)

  it("has the noises of the runtime, bit-identical", function()
    -- The same values as in tests/points/test_noise.cpp.
    assert.equal(-0.4088346060220297, value "rapid.math.noise(vec3(0.25, 1.5, -2.75))")
    assert.equal(-0.13869028957850577, value "rapid.math.noise(vec3(100.1, -200.2, 300.3), 0.7, 3, 42)")
    for axis, expected in pairs { x = 0.81774388108413443, y = 1.0055254942500953, z = -0.2152752971438139 } do
      assert.equal(expected, value("rapid.math.curl_noise(vec3(0.25, 1.5, -2.75), 0.7, 3, 42)." .. axis))
    end
  end)

  it("is there in the graph's body too", function()
    local text = "local h = rapid.math.fit(5, 0, 10, 0, 4) + rapid.math.noise(vec3(1, 2, 3)) " ..
      "return rapid.create { points = rapid.points.from { P = {{0, h, 0}} } }"
    assert.equal(2, scene.run(text, { frames = {1, 1} })[1][1].P.y)
  end)

  it("is compiled with the kernel", function()
    local result = scene.run([[
return rapid.create { points = rapid.points.grid { size = {10, 10, 10}, spacing = 0.5 } }
  :points("k", function(p, frame)
    local m = rapid.math
    p.v = m.curl_noise(p.P * 0.3, frame.time, 2) * m.smoothstep(0, 5, p.P:length())
    p.P = p.P * (1 + 0.01 * m.noise(p.P) * m.clamp(p.v.x, 0, 1) * m.fit(p.v.y, -1, 1, 0, 1))
  end) :solve {}]], { frames = {1, 4}, threads = 1, watch_traces = true })
    assert.same({}, result.trace_aborts)
    assert.points(result[4]).finite()
  end)

  it("refuses an argument that is no number, and shows it", function()
    for expression, expected in pairs {
      ["rapid.math.clamp(nil, 0, 1)"] = "clamp(x, lo, hi) needs numbers, not nil",
      ["rapid.math.clamp(1, 3, 2)"] = "clamp(x, lo, hi): lo = 3 is above hi = 2",
      ["rapid.math.fit(1, 2, 2, 0, 1)"] = "fit(x, lo, hi, from, to): lo and hi are both 2; they must differ",
      ["rapid.math.fit(1, 2)"] = "fit(x, lo, hi, from, to) needs numbers, not nil",
      ["rapid.math.smoothstep(1, 0, 1)"] = "smoothstep(lo, hi, x): lo = 1 must be below hi = 0",
      ["rapid.math.noise(1)"] = "noise(P, time, octaves, seed) needs a vec3 P, not 1",
      ["rapid.math.noise(p.P, 0, 0)"] =
        "noise(P, time, octaves, seed): octaves = 0; it must be a whole number from 1 to 16",
      ["rapid.math.curl_noise(p.P, 0, 1.5)"] =
        "curl_noise(P, time, octaves, seed): octaves = 1.5; it must be a whole number from 1 to 16",
      ["rapid.math.noise(p.P, 0, 1, -1)"] =
        "noise(P, time, octaves, seed): seed = -1; it must be a whole number from 0 to 4294967295",
      ["rapid.math.noise(p.P, 'now')"] = "noise(P, time, octaves, seed) needs numbers, not a string",
      ["rapid.math.clmap(1, 2, 3)"] = 'rapid.math has no "clmap"; did you mean "clamp"?',
    } do
      assert.equal(expected, fault(expression))
    end
  end)
end)

describe("a run of a test", function()
  it("reports the traces that LuaJIT gave up", function()
    local result = scene.run([[
return rapid.create { points = rapid.points.grid { size = {10, 10, 10}, spacing = 0.5 } }
  :points("k", function(p) local f = function() return 1 end p.P = p.P * f() end) :solve {}]],
      { frames = {1, 3}, threads = 1, watch_traces = true })
    assert.truthy(result.trace_aborts[1]:find("scene.lua:2: NYI: bytecode FNEW", 1, true), result.trace_aborts[1])
  end)
end)
