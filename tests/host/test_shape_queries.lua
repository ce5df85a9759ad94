-- shape:distance and shape:gradient in kernels and in the graph's body, against closed forms.
local scene = require "testing.scene"

local shapes = [[
local ball = rapid.shape.sphere { radius = 0.5, center = {0, 1, 0} }
local floor = rapid.shape.plane { normal = {0, 2, 0}, offset = 0.25 }
local block = rapid.levelset.box { size = {1, 1, 1}, voxel = 0.05 }]]

local function kernel(body, columns) return scene.kernel(body, columns, (shapes:gsub("\n", " "))) end

describe("a shape", function()
  it("gives a kernel the distance and the gradient", function()
    local points = kernel("p.d = ball:distance(p.P) p.P = ball:gradient(p.P + vec3(0, 1, 0))", "d = {0, 0}")
    assert.near(-0.5, points[1].d, 1e-6)
    assert.near(0.5, points[2].d, 1e-6)
    assert.near({0, 1, 0}, points[1].P, 1e-6)
    assert.near({math.sqrt(0.5), math.sqrt(0.5), 0}, points[2].P, 1e-6)
  end)

  it("is one of several, and may be a level set", function()
    local points = kernel("p.a = floor:distance(p.P) p.b = block:distance(vec3(0.55, 0.1 * p.id, 0))",
      "a = {0, 0}, b = {0, 0}")
    assert.near(0.875, points[1].a, 1e-6)
    assert.near(0.05, points[2].b, 1e-3)
  end)

  it("answers in the graph's body", function()
    local text = shapes .. " local d = ball:distance(vec3(0, 3, 0)) + ball:gradient(vec3(0, 3, 0)).y " ..
      "return rapid.create { points = rapid.points.from { P = {{d, 0, 0}} } }"
    assert.near(2.5, scene.run(text, { frames = {1, 1} })[1][1].P.x, 1e-6)
  end)

  it("is evaluated in compiled traces, bit-identical on any number of threads", function()
    local text = shapes .. [[
return rapid.create { points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.1 } } :attribute { d = 0 }
  :points("k", function(p)
    p.d = math.min(ball:distance(p.P), block:distance(p.P)) + floor:distance(p.P)
    p.P = p.P + ball:gradient(p.P) * 0.01
  end) :solve {}]]
    local one = scene.run(text, { frames = {1, 5}, threads = 1, watch_traces = true })
    assert.same({}, one.trace_aborts)
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one[5], scene.run(text, { frames = {1, 5}, threads = threads })[5])
    end
  end)

  it("refuses arguments that are no positions, and points, which have no distance", function()
    local function fault(body)
      return (scene.kernel_error(body, nil, (shapes .. " local set = rapid.points.grid {}"):gsub("\n", " "))
        :gsub('^scene%.lua:2: node "kernel": ', ""):gsub(" %(point id 0, frame 2%)$", ""))
    end
    assert.equal("shape:distance(P) needs a vec3, not 3", fault "p.P = p.P * ball:distance(3)")
    assert.equal("shape:gradient(P) needs a vec3, not nil", fault "p.P = ball:gradient()")
    assert.equal("shape:distance(P) must be called with a colon, not a dot",
      fault "p.P = p.P * ball.distance(p.P)")
    assert.equal('points have no "distance"', fault "p.P = p.P * set:distance(p.P)")
    assert.equal('a sphere has no "distanse"; did you mean "distance"?', fault "p.P = p.P * ball:distanse(p.P)")
  end)
end)
