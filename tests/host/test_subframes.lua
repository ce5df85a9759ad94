-- create{ subframes = n }: the whole graph runs n times per frame.
local scene = require "testing.scene"
local json = require "dkjson"

local one = "points = rapid.points.from { P = {{0, 0, 0}}, v = {{1, 0, 0}} }"

describe("with sub-frames", function()
  it("a script runs once per subframe, each time for its part of the frame", function()
    for _, n in ipairs { 1, 3, 8 } do
      local points = scene.run(([[
return rapid.create { fps = 24, subframes = %d, %s } :attribute { runs = 0 }
  :points("slow", function(p) p.v = p.v * (1 - 3 * p.dt) p.runs = p.runs + 1 end) :solve {}]]):format(n, one),
        { frames = {5, 5} })[5]
      assert.equal(4 * n, points[1].runs)
      assert.near((1 - 3 / (24 * n)) ^ (4 * n), points[1].v.x, 2e-6)
    end
  end)

  it("a frame's number, time and dt are the sub-frame's", function()
    local text = [[
return rapid.create { fps = 10, start = 5, subframes = 4, points = rapid.points.from { P = {{0, 0, 0}} } }
  :attribute { number = 0, time = 0, length = 0, sum = 0 }
  :points("look", function(p, frame)
    p.number, p.time, p.length, p.sum = frame.number, frame.time, frame.dt, p.sum + frame.number
  end) :solve {}]]
    local p = scene.run(text, { frames = {6, 6} })[6][1]
    assert.near(6, p.number, 0)
    assert.near(0.1, p.time, 1e-7)
    assert.near(0.025, p.length, 1e-8)
    assert.near(5.25 + 5.5 + 5.75 + 6, p.sum, 1e-6)
  end)

  it("births stay seamless: the k-th of a constant rate is born at (k + 1) / rate, on the emitter's path", function()
    local text = [[
local function going(frame) return rapid.translate(2 * frame.time, 3 * frame.time ^ 2, 0) end
return rapid.create { fps = 24, subframes = %d }
  :emit { source = rapid.mesh.sphere { radius = 1e-7, divisions = 4 }:transform(going), rate = 1000,
          birth = "even", inherit_velocity = 0 } :solve {}]]
    for _, n in ipairs { 1, 4, 5 } do
      local points = scene.run(text:format(n), { frames = {13, 13} })[13]
      assert.equal(500, #points)
      for k = 0, 499, 7 do
        local t = (k + 1) / 1000
        assert.near({2 * t, 3 * t ^ 2, 0}, points:by_id(k).P, 3e-6)
      end
    end
  end)

  it("points fall for the time since their birth, however the frame is divided", function()
    local text = [[
return rapid.create { fps = 24, seed = 1, subframes = %d }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, rate = 240, birth = "even", velocity = {1, 0, 0} }
  :gravity {} :solve {}]]
    for _, n in ipairs { 1, 3, 16 } do
      local points = scene.run(text:format(n), { frames = {25, 25} })[25]
      assert.equal(240, #points)
      for k = 0, 239, 11 do
        local t = 1 - (k + 1) / 240
        assert.near({t, -9.81 * t ^ 2 / 2, 0}, points:by_id(k).P, 1e-5)
      end
    end
  end)

  it("count and impulse are still those of a frame", function()
    local points = scene.run([[
return rapid.create { subframes = 4 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, count = 7 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, impulse = {[1] = 3, [2] = 5} } :solve {}]],
      { frames = {1, 3} })
    assert.equal(3, #points[1])
    assert.equal(3 + 7 + 5, #points[2])
    assert.equal(3 + 14 + 5, #points[3])
  end)

  it("count and impulse emit at the same times as in a whole frame", function()
    local text = [[
return rapid.create { fps = 10, seed = 3, subframes = %d }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, %s, birth = "%s" } :solve {}
  :attribute { born = 0 } :points("look", function(p) p.born = p.birthtime end)]]
    for _, birth in ipairs { "begin", "end", "even" } do
      for _, amount in ipairs { "count = 7", "impulse = {[1] = 2, [2] = 5}" } do
        local whole = scene.run(text:format(1, amount, birth), { frames = {3, 3} })[3]
        local parts = scene.run(text:format(4, amount, birth), { frames = {3, 3} })[3]
        assert.equal(#whole, #parts)
        for i = 1, #whole do assert.near(whole:by_id(i - 1).born, parts:by_id(i - 1).born, 1e-7) end
      end
    end
    -- Random birth times fall into all parts of the frame.
    local born = scene.run(text:format(4, "count = 400", "random"), { frames = {2, 2} })[2]
    local of_part = {0, 0, 0, 0}
    for i = 1, #born do
      local part = math.floor(born[i].born * 40) + 1
      of_part[part] = of_part[part] + 1
    end
    assert.same({100, 100, 100, 100}, of_part)
  end)

  it("a deforming mesh emits along the same paths as in whole frames", function()
    local files = scene.folder
    for f = 1, 6 do -- a triangle that rises with growing speed, and turns
      files:write(("leaf.%04d.obj"):format(f), ("v 0 %g 0\nv 1 %g %g\nv 0 %g 1\nf 1 2 3\n"):format(f ^ 2 / 10, f / 5,
        f / 9, f ^ 3 / 100))
    end
    local text = [[
return rapid.create { fps = 10, seed = 3, subframes = %d }
  :emit { source = rapid.mesh.read "leaf.####.obj", rate = 100, birth = "even", from = "points" } :solve {}]]
    local whole = scene.run(text:format(1), { frames = {4, 4} })[4]
    local parts = scene.run(text:format(3), { frames = {4, 4} })[4]
    assert.equal(30, #parts)
    for i = 0, 29 do
      assert.near(whole:by_id(i).P, parts:by_id(i).P, 2e-6)
      assert.near(whole:by_id(i).v, parts:by_id(i).v, 1e-5)
    end
  end)

  it("the counts of a frame are those of all its sub-frames", function()
    local text = [[
return rapid.create { fps = 2, subframes = %d, points = rapid.points.from { P = {{0, 0.5, 0}}, v = {{0, -8, 0}} } }
  :collide { shape = rapid.shape.plane {}, bounce = 1, record = 0 }
  :collide { shape = rapid.shape.plane { normal = {0, -1, 0}, offset = -1 }, bounce = 1, record = 0 } :solve {}]]
    local whole = scene.run(text:format(1), { frames = {3, 3} })[3][1]
    local parts = scene.run(text:format(5), { frames = {3, 3} })[3][1]
    assert.equal(8, whole.hittotal)
    assert.equal(4, whole.hitnum)
    assert.equal(8, parts.hittotal)
    assert.equal(4, parts.hitnum)
    local stats = {}
    for _, n in ipairs { 1, 5 } do
      assert.equal(0, scene.command("run", text:format(n), "-f 1-3 --stats stats.json").status)
      local file = assert(io.open(scene.folder.path .. "/stats.json"))
      stats[n] = json.decode(file:read "*a").frames
      file:close()
    end
    assert.equal(3, #stats[5])
    for f = 1, 3 do
      for _, what in ipairs { "frame", "points", "born", "died", "collisions", "substeps" } do
        assert.equal(stats[1][f][what], stats[5][f][what], what)
      end
    end
  end)

  it("a tolerance is that of the whole frame", function()
    local text = [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 0, 3}} } }
  :attract { strength = 9 } :solve { tolerance = 1e-4 }]]
    local function off(n)
      local p = scene.run(text:format(n), { frames = {2, 2} })[2][1]
      return (p.P - vec3(math.cos(3 / 24), 0, math.sin(3 / 24))):length()
    end
    for _, n in ipairs { 1, 2, 8 } do assert.is_true(off(n) <= 1e-4, off(n)) end
  end)

  it("a pin takes its points along its motion", function()
    local text = [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = {{0, 0, 0}} } }
  :pin { transform = function(f) return rapid.translate(3 * f.time, 0, f.time ^ 2) end } :solve {}]]
    for _, n in ipairs { 1, 4 } do
      assert.near({3, 0, 1}, scene.run(text:format(n), { frames = {25, 25} })[25][1].P, 1e-5)
    end
  end)

  it("explain says how often a node is evaluated, and nothing is lost with all that is left out kept", function()
    local text = "return rapid.create { subframes = 4, points = two } :points('a', function(p) p.v = p.v * 0.5 end) "
      .. ":gravity {} :solve {} :points('after', function(p) p.P = p.P * 2 end)"
    local plan = json.decode(scene.command("explain", text, "--json").stdout)
    local evaluated = {}
    for _, node in ipairs(plan.nodes) do evaluated[node.name] = node.evaluated end
    assert.same({ create1 = "4 times per frame", a = "4 times per frame", gravity1 = "4 times per frame",
      solve1 = "4 times per frame", after = "every frame" }, evaluated)
    local files = {}
    for _, option in ipairs { "", "--keep-all" } do
      assert.equal(0, scene.command("run", text, "-f 1-4 -o a.####.csv " .. option).status)
      local file = assert(io.open(scene.folder.path .. "/a.0004.csv"))
      files[#files + 1] = file:read "*a"
      file:close()
    end
    assert.equal(files[1], files[2])
  end)

  it("a moving collider is met where it is", function()
    local text = [[
return rapid.create { fps = 24, subframes = %d, points = rapid.points.from { P = {{0, 1, 0}} } }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.6,
    transform = function(frame) return rapid.translate(0, 0.8 * frame.time, 0) end } :solve {}]]
    local function at(n) return scene.run(text:format(n), { frames = {25, 25} })[25][1] end
    assert.near(at(1).P, at(6).P, 3e-6)
    assert.near(at(1).v, at(6).v, 3e-5)
  end)

  it("what comes after Solve is done once a frame", function()
    local points = scene.run(([[
return rapid.create { subframes = 4, %s } :solve {} :attribute { n = 0 }
  :points("after", function(p) p.n = p.n + 1 end)]])
      :format(one), { frames = {3, 3} })[3]
    assert.equal(1, points[1].n)
  end)

  it("the bits are the same on 1, 2 and 7 threads", function()
    local text = [[
return rapid.create { seed = 4, subframes = 3 }
  :emit { source = rapid.mesh.torus { radius = 0.5, tube = 0.1 }, rate = 20000, life = {0.1, 0.4}, speed = 1 }
  :points("turn", function(p) p.v = p.v + vec3(0, 1, 0):cross(p.P) * p.dt end)
  :turbulence { amplitude = 5 } :solve { substeps = 2 }]]
    local first = scene.run(text, { frames = {8, 8}, threads = 1 })[8]
    for _, threads in ipairs { 2, 7 } do
      assert.same_points(first, scene.run(text, { frames = {8, 8}, threads = threads })[8])
    end
  end)

  it("all simulations of a graph must have the same number", function()
    assert.truthy(scene.error(
      "return { a = rapid.create { subframes = 4 } :solve {}, b = rapid.create {} :solve {} }")
      :find("all simulations of a graph must have the same", 1, true))
    assert.truthy(scene.error("return rapid.create { subframes = 0 } :solve {}"):find("subframes = 0", 1, true))
  end)
end)
