-- :action: a kernel inside Solve, at every substep.
local scene = require "testing.scene"

-- A unit mass on the circle a = -P.
local function orbit(substeps, frames)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 0, -1}} } }
  :action("orbit", function(p) p.force = p.force - p.P end)
  :solve { substeps = %d }]]):format(substeps), { frames = {1, frames} })
end

local function off_circle(points, time)
  return (points[1].P - vec3(math.cos(time), 0, -math.sin(time))):length()
end

describe("an action", function()
  it("runs once a sub-step, with the point's own time", function()
    local points = scene.run([[
return rapid.create { fps = 10, start = 3, points = two } :attribute { calls = 0, time = 0, spent = 0, last = 0 }
  :action("count", function(p, step)
    p.calls, p.time, p.spent, p.last = p.calls + 1, p.time + step.time, p.spent + step.dt, step.index
  end) :solve { substeps = 4 }]], { frames = {3, 5} })[5]
    assert.equal(8, points[1].calls)
    assert.near(8 * 0.1, points[1].time, 1e-6) -- the midpoints of the substeps from 0 to 0.2 s
    assert.near(0.2, points[1].spent, 1e-6)
    assert.equal(3, points[1].last)
  end)

  it("acts on the points that were in its group when the step began, whatever leaves it", function()
    local points = scene.run([[
return rapid.create { points = two } :attribute { n = 0, m = 0 }
  :group { name = "g", where = function(p) return p.id > 0 end }
  :action { name = "a", group = "g", kernel = function(p, step)
      p.n = p.n + 1
      if step.index == 1 then p:leave "g" end
    end }
  :action { name = "b", group = "g", kernel = function(p) p.m = p.m + 1 end } :solve { substeps = 4 }]],
      { frames = {2, 2} })[2]
    assert.same({ 0, 4 }, { points[1].n, points[2].n })
    assert.same({ 0, 4 }, { points[1].m, points[2].m })
    assert.equal(0, #points:group "g")
  end)

  it("reads what another writes, in whichever frame", function()
    local text = [[
return rapid.create { points = two } :attribute { heat = 0, seen = 0 }
  :action("reads", function(p) p.seen = p.seen + p.heat end)
  :action("writes", function(p) p.heat = p.heat + 1 end) :solve { substeps = 4 }]]
    local all, last = scene.run(text, { frames = {1, 6} }), scene.run(text, { frames = {6, 6} })[6]
    for frame = 1, 6 do
      local calls = 4 * (frame - 1)
      assert.equal(calls * (calls - 1) / 2, all[frame][1].seen)
    end
    assert.equal(190, last[2].seen)
  end)

  it("that adds to the force is of second order", function()
    local coarse, fine = orbit(1, 49)[49], orbit(4, 49)[49]
    local ratio = off_circle(coarse, 2) / off_circle(fine, 2)
    assert.truthy(ratio > 14 and ratio < 18, ratio)
  end)

  it("that adds to the force gives an orbit whose radius stays", function()
    for _, points in orbit(1, 24 * 60):frames() do
      assert.near(1, points[1].P:length(), 1e-3)
    end
  end)

  it("divides the force by the point's mass, and leaves none behind", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = two } :attribute { mass = 4, seen = {9, 9, 9} }
  :action("push", function(p) p.force = p.force + vec3(8, 0, 0) end)
  :points("look", function(p) p.seen = p.force end)
  :solve { substeps = 3 }]], { frames = {1, 25} })[25]
    assert.near({2, 0, 0}, points[1].v, 1e-5)
    assert.near({0, 0, 0}, points[1].seen, 0)
  end)

  it("that writes the velocity kicks, and sees what the one before it wrote", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = two }
  :action("kick", function(p) p.v = vec3(24, 0, 0) end)
  :action("turn", function(p) p.v = vec3(0, 0, p.v.x) end)
  :solve {}]], { frames = {1, 2} })[2]
    assert.near({0, 0, 24}, points[1].v, 0)
    assert.near({0, 1, 0.5}, points[1].P, 1e-6) -- half the frame at rest, half with the kick
  end)

  it("acts on its group, and on the newborn for their own time", function()
    local points = scene.run([[
return rapid.create { fps = 24 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, from = "points", count = 4, birth = "even" }
  :attribute { time = 0 }
  :group { name = "odd", where = function(p) return p.id % 2 == 1 end }
  :action { name = "clock", group = "odd", kernel = function(p, step) p.time = p.time + step.dt end }
  :solve { substeps = 2 }]], { frames = {1, 2} })[2]
    assert.equal(0, points[1].time)
    assert.near(2 / 4 / 24, points[2].time, 1e-8)
    assert.equal(0, points[3].time)
    assert.equal(0, points[4].time)
  end)

  it("joins, leaves and kills; the dead move no further and are gone when Solve ends", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = two } :gravity {} :attribute { calls = 0 }
  :action("k", function(p, step)
    p.calls = p.calls + 1
    if p.id == 0 and step.time > 0.05 then p:kill() end
    if p.P.y < 0.99 then p:join "low" else p:leave "low" end
  end) :solve { substeps = 2 }]], { frames = {1, 4} })
    assert.equal(2, #result[2])
    assert.equal(1, #result[3])
    assert.equal(1, result[3][1].id)
    assert.equal(0, #result[2]:group "low")
    assert.equal(1, #result[4]:group "low")
  end)

  it("moves points that a collider then stops", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = two }
  :action("down", function(p) p.v = vec3(0, -100, 0) end)
  :collide { shape = rapid.shape.plane {}, bounce = 0 }
  :solve {}]], { frames = {1, 5} })
    for _, points in result:frames() do assert.truthy(points:min("P").y >= 0) end
    assert.near(0, result[5]:max("P").y, 1e-6)
  end)

  it("draws the point's random numbers, the same at each sub-step or other ones", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = two } :attribute { last = 0, sum = 0, last_anew = 0, sum_anew = 0 }
  :action("draw", function(p, step)
    p.last, p.last_anew = p:rand(1), p:rand(1, step)
    p.sum, p.sum_anew = p.sum + p.last, p.sum_anew + p.last_anew
  end) :solve { substeps = 2 }]], { frames = {1, 2} })[2]
    assert.near(2 * points[1].last, points[1].sum, 1e-6)
    assert.truthy(math.abs(2 * points[1].last_anew - points[1].sum_anew) > 1e-3)
    assert.not_equal(points[1].last, points[2].last)
  end)

  it("is a node that Lua defines, with parameters", function()
    scene.folder:write("pull.lua", [[
return require "rapid".node {
  name = "pull", doc = "Pulls points to the origin.",
  params = { strength = { "float", default = 1, min = 0, unit = "N/m", doc = "force a metre" } },
  action = function(p, step, params) p.force = p.force - p.P * params.strength end,
}]])
    local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 0, -2}} } }
  :pull { strength = 4 } :solve { substeps = 8 }]], { frames = {1, 49} })[49]
    assert.near({math.cos(4), 0, -math.sin(4)}, points[1].P, 1e-3)
  end)

  it("is the same bits on 1, 2 and 7 threads", function()
    local text = [[
return rapid.create { fps = 24, seed = 3 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 2, 0} }, rate = 200000, life = {0.1, 0.3} }
  :attribute { heat = 1 }
  :action("stir", function(p, step)
    p.v = p.v + vec3(p:rand(1, step) - 0.5, 0, p.P.x) * step.dt
    p.heat = p.heat * (1 - step.dt)
    if p:rand(2, step) < 0.001 then p:kill() end
  end)
  :gravity {} :collide { shape = rapid.shape.sphere { radius = 1 } } :solve { substeps = 2 }]]
    local one = scene.run(text, { frames = {8, 8}, threads = 1 })[8]
    assert.truthy(#one > 10000)
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(one, scene.run(text, { frames = {8, 8}, threads = threads })[8])
    end
  end)
end)

describe("an error in an action", function()
  local function message(body)
    return scene.error([[
return rapid.create { points = two } :action("push", function(p, step)
  ]] .. body .. [[

end) :solve {}]], { frames = {1, 2} })
  end

  it("names the node, the line, the point and the frame", function()
    for body, expected in pairs {
      ["p.v = 1"] = 'attribute "v" takes a vec3, not 1',
      ["p.v = p.v / 0"] = "v became vec3(nan, nan, nan); a float must be between -3.4e38 and 3.4e38",
      ["error 'no'"] = "no",
      ["local x = step.number"] = 'the step has no "number"; it has time, dt, index and detail',
      ["local t = step.nothing.x"] = 'the step has no "nothing"; it has time, dt, index and detail',
    } do
      assert.equal('scene.lua:2: node "push": ' .. expected .. " (point id 0, frame 2)",
        (message(body):gsub("; P = .*%)$", ")")), body)
    end
  end)

  it("that can be found early is reported before the first frame", function()
    assert.match('scene.lua:%d: node "push": .*no attribute "heat"', message "p.heat = 1")
    assert.match('scene.lua:2: node "push": the kernel assigns p.id, which is read%-only', message "p.id = 3")
    assert.match('scene.lua:2: node "push": the kernel assigns the global "n"; kernels run in parallel',
      message "n = 1")
  end)
end)
