-- The same bits, whatever the number of threads and whatever else is in the scene.
local scene = require "testing.scene"

-- Kernels that read, write, draw, join, leave and kill; births, deaths, a test of a point, functions of the frame.
local text = [[
local function spin(p, rate) return vec3(0, 1, 0):cross(p.P) * (rate * p.dt) end
local rates = { slow = 0.5, fast = 3 }
return rapid.create { fps = 24, seed = 11 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 2, 0} }, rate = 400000, birth = "random",
          life = {0.1, 0.3}, speed = 1, spread = 30, attributes = { heat = 1 } }
  :attribute { turn = 0 }
  :points("swirl", function(p, frame)
    p.v = p.v + spin(p, p:within "hot" and rates.fast or rates.slow) + vec3(p:rand(1, frame) - 0.5, 0, 0)
    p.heat = p.heat * math.exp(-p.dt / (0.05 + 0.1 * p:rand(2)))
    p.turn = math.sin(p.turn + frame.time) + p.age
    if p.heat > 0.5 then p:join "hot" else p:leave "hot" end
    if p.heat < 0.05 then p:kill() end
  end)
  :delete { where = function(p) return p.P.y > 2.9 and p:rand(3) < 0.5 end }
  :gravity { g = function(frame) return vec3(0, -9.81 * frame.time, 0) end }
  :collide { shape = rapid.shape.plane {}, bounce = 0.4, friction = 0.2 }
  :solve { substeps = 2 }
  :points("paint", function(p) p.Cd = vec3(p.heat, p:within "hot" and 1 or 0, p.index % 2) end)]]
text = text:gsub(":attribute { turn = 0 }", ":attribute { turn = 0, Cd = {1, 1, 1} }")

describe("a scene with kernels", function()
  local one = scene.run(text, { frames = {1, 8}, threads = 1 })

  it("has points enough to be computed in several chunks", function()
    assert.truthy(#one[8] > 30000)
    assert.truthy(#one[8]:group "hot" > 0 and #one[8]:group "hot" < #one[8])
    assert.points(one[8]).finite()
  end)

  it("is the same bits on 1, 2 and 7 threads", function()
    for _, threads in ipairs { 2, 7 } do
      local result = scene.run(text, { frames = {1, 8}, threads = threads })
      for frame, points in one:frames() do assert.same_points(points, result[frame]) end
    end
  end)

  it("is the same bits when it runs again", function()
    assert.same_points(one[8], scene.run(text, { frames = {8, 8}, threads = 2 })[8])
  end)

  it("is the same bits when a node that changes nothing is inserted", function()
    local inserted = text:gsub(":gravity", ':points("idle", function(p) local _ = p:rand(1) end)\n  :gravity')
    assert.same_points(one[8], scene.run(inserted, { frames = {8, 8}, threads = 2 })[8])
  end)

  it("is other bits with another seed", function()
    assert.falsy(pcall(assert.same_points, one[8], scene.run(text, { frames = {8, 8}, seed = 12 })[8]))
  end)
end)

describe("a point of a scene", function()
  it("moves the same whatever other points there are", function()
    local scene_of = function(places)
      return scene.run(([[
return rapid.create { points = rapid.points.from { P = {%s} } } :gravity {}
  :points("k", function(p) p.v = p.v + vec3(p:rand(1), p:rand(2), p.P.y) * p.dt end)
  :collide { shape = rapid.shape.sphere { radius = 1 } } :solve {}]]):format(places), { frames = {24, 24} })[24]
    end
    local alone, among = scene_of "{0.1, 2, 0.2}", scene_of("{0.1, 2, 0.2}" .. (", {0, 3, 0}"):rep(20000))
    for _, name in ipairs { "P", "v" } do
      for _, axis in ipairs { "x", "y", "z" } do assert.equal(alone[1][name][axis], among[1][name][axis]) end
    end
  end)
end)
