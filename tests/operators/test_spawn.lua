-- spawn: births from the points of another chain, at positions and times with closed forms.
local scene = require "testing.scene"

local g = 9.81

-- Parents that fall freely, and their children, which stay in place unless `after` moves them.
local function family(parents, emit, options)
  options = options or {}
  return scene.run(([[
local fps = 24
local parents = rapid.create { fps = fps, subframes = %d, points = rapid.points.from { %s } }
  %s :solve { substeps = %d }
local children = rapid.create { fps = fps, subframes = %d, name = "nursery" }
  :attribute { heat = 0 } :points("read", function(p) local _ = p.parent + p.age + p.birthtime end)
  :spawn { from = parents, %s } %s :solve {}
return { main = children, parents = parents }]]):format(options.subframes or 1, parents,
    options.before or ":gravity {}", options.substeps or 1, options.subframes or 1, emit, options.after or ""),
    { frames = {1, options.frames or 13}, threads = options.threads })
end

local function parabola(P, v, t) return P + v * t + vec3(0, -0.5 * g * t * t, 0) end

describe("births from points of another chain", function()
  local P, v = vec3(0, 2, 0), vec3(3, 4, 1)
  local one = "P = {{0, 2, 0}}, v = {{3, 4, 1}}"

  it("are on the parabola of the parent at even times, without a seam between frames", function()
    for _, subframes in ipairs { 1, 3 } do
      local points = family(one, 'rate = 250, birth = "even", inherit_velocity = 0', { subframes = subframes })[13]
      assert.equal(125, #points)
      for i = 1, #points do
        local p, t = points[i], i / 250
        assert.near(t, p.birthtime, 1e-6)
        assert.near(parabola(P, v, t), p.P, 3e-6)
        assert.equal(i - 1, p.id)
        assert.equal(0, p.parent)
      end
    end
  end)

  it("are at random times uniform over the frame, each on the parabola", function()
    local points = family(one, "rate = 20000, inherit_velocity = 0")[13]
    assert.near(10000, #points, 1)
    local counts = {}
    for i = 1, #points do
      local p = points[i]
      assert.near(parabola(P, v, p.birthtime), p.P, 1e-5)
      local part = math.floor((p.birthtime * 24) % 1 * 20) + 1
      counts[part] = (counts[part] or 0) + 1
    end
    local chi2 = 0
    for part = 1, 20 do chi2 = chi2 + (counts[part] - 500) ^ 2 / 500 end
    assert.is_true(chi2 < 43.8) -- 19 degrees of freedom, exceeded once in a thousand
  end)

  it("have no beads at any speed: gaps of a stream are equal", function()
    local points = family("P = {{0, 0, 0}}, v = {{900, 0, 0}}", 'count = 64, birth = "even", inherit_velocity = 0',
      { before = "" })[13]
    assert.equal(64 * 12, #points)
    local gap = 900 / 24 / 64
    for i = 2, #points do assert.near(gap, points[i].P.x - points[i - 1].P.x, 1e-4) end
  end)

  it("move on for the time that is left, with the parent's velocity", function()
    local result = family(one, 'rate = 37, birth = "even"', { after = ":gravity {}" })
    for i = 1, #result[13] do -- each of them is at the position of its parent
      assert.near(result:output "parents"[13][1].P, result[13][i].P, 6e-6)
      assert.near(result:output "parents"[13][1].v, result[13][i].v, 6e-6)
      assert.near(0.5 - i / 37, result[13][i].age, 1e-6)
    end
  end)

  it("follow a parent through its bounces", function()
    local ground = ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 1 }"
    local points = family("P = {{0, 1, 0}}, v = {{1, 0, 0}}", 'rate = 500, birth = "even", inherit_velocity = 0',
      { before = ground, frames = 25 })[25]
    local fall = math.sqrt(2 / g)
    for i = 1, #points do
      local t = i / 500
      local since = (t + fall) % (2 * fall) - fall -- since the last apex
      assert.near(vec3(t, 1 - 0.5 * g * since * since, 0), points[i].P, 1e-5)
    end
  end)

  it("are of the number that each parent has as an attribute, by its id", function()
    local points = family("P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, v = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, n = {2, 0, 5}",
      'count = rapid.attr "n"', { frames = 3, before = "" })[3]
    local of = { [0] = 0, 0, 0 }
    for i = 1, #points do of[points[i].parent] = of[points[i].parent] + 1 end
    assert.equal(4, of[0])
    assert.equal(0, of[1])
    assert.equal(10, of[2])
  end)

  it("are as many a frame, whatever its sub-frames", function()
    for _, subframes in ipairs { 1, 2, 3 } do
      for _, birth in ipairs { "random", "even" } do
        local result = family(one, ('count = 5, birth = "%s"'):format(birth), { subframes = subframes, frames = 4 })
        for frame = 1, 4 do assert.equal(5 * (frame - 1), #result[frame]) end
      end
    end
  end)

  it("end at their limit", function()
    assert.equal(7, #family(one, "count = 3, limit = 7")[13])
    assert.equal(7, #family(one, "rate = 100, limit = 7")[13])
  end)

  it("come from the points of a group alone", function()
    local points = family("P = {{0, 0, 0}, {1, 0, 0}}, v = {{0, 0, 0}, {0, 0, 0}}",
      'count = 1, source_group = "right"', { frames = 2,
        before = ':group { name = "right", where = function(p) return p.P.x > 0.5 end }' })[2]
    assert.equal(1, #points)
    assert.equal(1, points[1].parent)
  end)

  it("begin with a newborn parent's birth, and end with its death", function()
    local points = scene.run([[
local parents = rapid.create { fps = 24 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, rate = 10, birth = "even", life = 0.26, velocity = {2, 0, 0} }
  :solve {}
return rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = parents, rate = 300, birth = "even", inherit_velocity = 0 } :solve {}]], { frames = {1, 25} })[25]
    local first, last, count = {}, {}, {}
    for i = 1, #points do
      local p = points[i]
      assert.near(2 * (p.birthtime - (p.parent + 1) / 10), p.P.x, 2e-6)
      first[p.parent] = math.min(first[p.parent] or 9, p.birthtime)
      last[p.parent] = math.max(last[p.parent] or 0, p.birthtime)
      count[p.parent] = (count[p.parent] or 0) + 1
    end
    for parent = 0, 6 do
      local born = (parent + 1) / 10
      assert.near(born + 1 / 300, first[parent], 2e-6)
      assert.near(born + 0.26, last[parent], 2e-6)
      assert.equal(78, count[parent])
    end
  end)

  it("are bit-identical on one, two and three threads", function()
    local emit = "rate = 4000, birth = 'random', velocity = {0, 1, 0}, spread = 60, life = {0.1, 0.4}"
    local function run(threads)
      return scene.run(([[
local parents = rapid.create { fps = 24 }
  :emit { source = rapid.mesh.sphere { radius = 0.3, center = {0, 0.4, 0} }, rate = 900, life = {0.1, 0.5},
    velocity = {0, -1, 0}, spread = 40 }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.6 } :solve { substeps = 2 }
local trail = rapid.create { fps = 24 } :points("read_trail", function(p) local _ = p.parent end)
  :spawn { from = parents, %s } :gravity {} :solve {}
local drops = rapid.create { fps = 24 } :points("read_drops", function(p) local _ = p.parent end)
  :spawn { from = parents, on = "hit", count = 5, velocity = {0, 2, 0}, spread = 50 } :gravity {} :solve {}
return { main = trail, drops = drops }]]):format(emit), { frames = {1, 13}, threads = threads })
    end
    local first = run(1)
    assert.is_true(#first[13] > 30000 and #first:output "drops"[13] > 300)
    for threads = 2, 3 do
      local other = run(threads)
      assert.same_points(first[13], other[13])
      assert.same_points(first:output "drops"[13], other:output "drops"[13])
    end
  end)

  it("do not depend on other parents, but for their ids", function()
    local function places(parents)
      local points, of_first = family(parents, "count = 3, velocity = {0, 1, 0}, spread = 90")[5], {}
      for i = 1, #points do
        if points[i].parent == 0 then of_first[#of_first + 1] = points[i].P end
      end
      return of_first
    end
    local alone = places(one)
    local among = places "P = {{0, 2, 0}, {5, 5, 5}}, v = {{3, 4, 1}, {1, 1, 1}}"
    assert.equal(12, #alone)
    for i = 1, 12 do assert.near(alone[i], among[i], 0) end
  end)
end)

describe("births at an event", function()
  local one = "P = {{0, 2, 0}}, v = {{3, 0, 0}}"
  local fall = math.sqrt(4 / g)

  local function born(emit, options, parents)
    local result = family(parents or one, emit, options)
    return result[options and options.frames or 13], result
  end

  it("hit: are at the contact at its time, in the frame of the event", function()
    local ground = ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.5 }"
    local frame = math.ceil(fall * 24) + 1
    local points, result = born('on = "hit", count = 4, inherit_velocity = 0, speed = 2',
      { before = ground, frames = frame })
    assert.equal(0, #result[frame - 1])
    assert.equal(4, #points)
    for i = 1, 4 do
      assert.near(fall, points[i].birthtime, 1e-6)
      assert.near({3 * fall, 2 * ((frame - 1) / 24 - fall), 0}, points[i].P, 3e-6) -- off the ground at 2 m/s
    end
    local same, all = born('on = "hit"', { before = ground, frames = frame, after = ":gravity {}" })
    assert.near(all:output "parents"[frame][1].P, same[1].P, 3e-6) -- with the velocity after the bounce
  end)

  it("hit: each of several in one frame, those above the least speed", function()
    local tube = [[:collide { shape = rapid.shape.plane { normal = {1, 0, 0} }, bounce = 0.5 }
      :collide { shape = rapid.shape.plane { normal = {-1, 0, 0}, offset = -1 }, bounce = 0.5 }]]
    local options = { before = tube, frames = 2 }
    local start = "P = {{0.5, 0, 0}}, v = {{192, 0, 0}}" -- 8 m per frame
    local speeds, times, t = {192, 96, 48}, {}, 0.5 / 192
    for k = 1, 3 do times[k], t = t, t + 1 / (192 * 0.5 ^ k) end
    local points = born('on = "hit", inherit_velocity = 0', options, start)
    assert.equal(3, #points)
    for k = 1, 3 do assert.near({k % 2, 0, 0}, points[k].P, 1e-6) end
    for k = 1, 3 do assert.near(times[k], points[k].birthtime, 1e-6) end
    for k = 1, 3 do assert.equal(k, #born(('on = "hit", min_speed = %g'):format(speeds[k] - 1), options, start)) end
  end)

  it("hit: none of a point that rests among others", function()
    local result = select(2, born('on = "hit"', { frames = 60, before = [[:gravity {} :contact { radius = 0.1 }
      :collide { shape = rapid.shape.plane {}, bounce = 0.3 }]] }, "P = {{0, 0.5, 0}}, v = {{0, 0, 0}}"))
    assert.is_true(#result[10] > 0)
    assert.equal(#result[40], #result[60])
  end)

  it("death: by age, on a shape, in an action", function()
    local points = born('on = "death", count = 3, inherit_velocity = 0', nil, one .. ", life = {0.3}")
    assert.equal(3, #points)
    assert.near(0.3, points[3].birthtime, 1e-6)
    assert.near(parabola(vec3(0, 2, 0), vec3(3, 0, 0), 0.3), points[3].P, 2e-6)

    points = born('on = "death", inherit_velocity = 0', { frames = 17,
      before = ':gravity {} :collide { shape = rapid.shape.plane {}, response = "die" }' })
    assert.near(fall, points[1].birthtime, 1e-6)
    assert.near({3 * fall, 0, 0}, points[1].P, 2e-6)

    points = born('on = "death", inherit_velocity = 0', { substeps = 48,
      before = ":gravity {} :action('kill', function(p) if p.P.x > 0.6 then p:kill() end end)" })
    assert.near(0.2, points[1].birthtime, 1.01 / 24 / 48) -- an action acts once per substep
    assert.near(3 * points[1].birthtime, points[1].P.x, 1e-5)
  end)

  it("birth: of initial points at the start, of newborn ones at their moment", function()
    local _, result = born('on = "birth", count = 2', { frames = 2 })
    assert.equal(2, #result[1])
    assert.near({0, 2, 0}, result[1][2].P, 0)
    local points = scene.run([[
local parents = rapid.create { fps = 24 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, rate = 50, birth = "even", velocity = {2, 0, 0} } :solve {}
return rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = parents, on = "birth" } :solve {}]], { frames = {1, 13} })[13]
    assert.equal(25, #points)
    for i = 1, 25 do
      assert.near(i / 50, points[i].birthtime, 1e-6)
      assert.near(2 * (0.5 - i / 50), points[i].P.x, 2e-6)
    end
  end)

  it("a comparison: at the moment when it begins to hold, once", function()
    local points = born('on = "age > 0.21", inherit_velocity = 0',
      { before = ':gravity {} :points("read_age", function(p) local _ = p.age end)' })
    assert.equal(1, #points)
    assert.near(0.21, points[1].birthtime, 1e-6)
    assert.near(parabola(vec3(0, 2, 0), vec3(3, 0, 0), 0.21), points[1].P, 2e-6)

    points = born 'on = "P.y < 1.5", inherit_velocity = 0'
    assert.equal(1, #points)
    assert.near(math.sqrt(1 / g), points[1].birthtime, 1e-6)
    assert.near(1.5, points[1].P.y, 1e-6)
  end)

  it("a comparison of hittotal: at the contact itself, along its normal", function()
    local ground = ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.5, record = %s }"
    local first = fall + 2 * 0.5 * g * fall / g -- time of the second bounce
    for record, moments in pairs { ["true"] = { fall, first, first + fall / 2 }, ["5"] = { fall } } do
      for n = 1, 3 do
        local points = born(('on = "hittotal >= %d", count = 2, inherit_velocity = 0, speed = 1'):format(n),
          { before = ground:format(record), frames = 40 })
        assert.equal(moments[n] and 2 or 0, #points)
        for i = 1, #points do
          assert.near(moments[n], points[i].birthtime, 1e-6)
          assert.near({3 * moments[n], 39 / 24 - moments[n], 0}, points[i].P, 1e-5)
        end
      end
    end
  end)

  it("a function of a point: at the end of the frame in which it begins to be true", function()
    local points = born("on = function(p) return p.P.y < 1.5 end, inherit_velocity = 0")
    assert.equal(1, #points)
    assert.near(math.ceil(24 * math.sqrt(1 / g)) / 24, points[1].birthtime, 1e-6)
  end)

  it("kill_parent: replaces the parent by its children in the same frame", function()
    local _, result = born('on = "age > 0.21", count = 3, kill_parent = true, inherit = {"heat"}',
      { before = ':gravity {} :attribute { heat = 4 } :points("read_age", function(p) local _ = p.age end)' })
    for frame = 1, 13 do
      local is_over = (frame - 1) / 24 > 0.21
      assert.equal(is_over and 0 or 1, #result:output "parents"[frame])
      assert.equal(is_over and 3 or 0, #result[frame])
    end
    assert.equal(4, result[13][1].heat)
  end)

  it("split: shares mass and volume", function()
    local points = born('on = "death", count = 8, split = true', nil,
      one .. ", life = {0.2}, mass = {4}, pscale = {0.6}")
    assert.equal(8, #points)
    for i = 1, 8 do
      assert.near(0.5, points[i].mass, 1e-7)
      assert.near(0.3, points[i].pscale, 1e-7)
    end
  end)
end)

describe("generations", function()
  it("follow each other within one frame, each moved for the time that is left", function()
    local result = scene.run([[
local shells = rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, v = {{1, 0, 0}}, life = {0.01} } }
  :solve {}
local stars = rapid.create { fps = 24 } :spawn { from = shells, on = "death", count = 2, life = 0.02 } :solve {}
local sparks = rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime end)
  :spawn { from = stars, on = "death", count = 3, inherit_velocity = 0 } :solve {}
return sparks]], { frames = {1, 2} })
    assert.equal(6, #result[2])
    for i = 1, 6 do
      assert.near(0.03, result[2][i].birthtime, 1e-6)
      assert.near({0.03, 0, 0}, result[2][i].P, 1e-6)
    end
  end)

  it("of one chain emit along the path of the frame before", function()
    local result = scene.run([[
local born = rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, v = {{0, 5, 0}}, n = {2} } }
return born:gravity {} :points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = born, count = rapid.attr "n", birth = "even", attributes = { n = 0 } } :solve {}]],
      { frames = {1, 8} })
    assert.equal(1, #result[2])
    for frame = 3, 8 do
      local points = result[frame]
      assert.equal(1 + 2 * (frame - 2), #points)
      for i = 2, #points do -- no matter when it is born, each flies with its parent
        assert.near((i - 1) / 48, points[i].birthtime, 1e-6)
        assert.near(points[1].P, points[i].P, 3e-6)
      end
    end
  end)
end)

describe("a node that can't emit", function()
  local function fails(text, message)
    local found = scene.error(text, { frames = {1, 3} })
    assert.truthy(found:find(message, 1, true), found)
  end
  local function with(parents, emit)
    return ("local parents = rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } %s\n"):format(parents)
      .. ("return rapid.create {} :spawn { %s } :solve {}"):format(emit)
  end

  it("is refused with a remedy", function()
    fails(with("", "from = parents, count = 1"), "no solve moves its points; end its chain with :solve {}")
    fails("local inner = rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :gravity { name = 'pull' }\n"
      .. "local outer = inner:solve { name = 'end' }\n"
      .. "return { a = outer, b = rapid.create {} :spawn { from = inner, count = 1 } :solve {} }",
      'from = node "pull" comes before its solve; give "end" or a node after it')
    fails("local slow = rapid.create { fps = 12 } :solve {}\n"
      .. "return rapid.create {} :spawn { from = slow, count = 1 } :solve {}", "give both the same fps")
    fails(with(":solve {}", "from = parents"), "the number of points is missing")
    fails(with(":solve {}", 'from = parents, on = "hits"'), 'on = "hits" is not an event')
    fails(with(":solve {}", 'from = parents, on = "hit", rate = 3'), "rate and on are given together")
    fails(with(":solve {}", 'from = parents, count = 1, kill_parent = true'),
      "kill_parent needs an event in a parent's life")
    fails(with(":solve {}", 'from = parents, count = 1, inherit = {"heta"}'),
      'node "emit1": inherit: the parents have no attribute "heta"')
    fails(with(":solve {}", 'from = parents, count = rapid.attr "n"'), 'no attribute "n"')
    fails(with(":solve {}", 'from = parents, count = 1, source_group = "old"'), 'no node makes a group "old"')
    fails(with(":solve {}", "from = parents, count = 1, impulse = {[2] = 3}"), 'unknown parameter "impulse"')
    fails(with(":solve {}", "from = function() return parents end, count = 1"), "from can't be a function of the frame")
    fails(with(":solve {}", "from = rapid.mesh.sphere {}, count = 1"), "from = a mesh has the wrong type")
    fails(with(":solve { tolerance = 1e-3 }", 'from = parents, on = "hit"'), "has a tolerance")
  end)
end)

describe("emit with a node as its source", function()
  local function refused(emit)
    return (scene.error(([[
local stars = rapid.create { points = two } :solve {}
local size, many = vec3(1, 2, 3), function() return 2 end
local old = function(p) return p.age > 1 end
local chain = rapid.create {} :attribute { heat = 1 }
  :emit { %s } :solve {}
return chain]]):format(emit)))
  end
  local function expect(call, emit)
    assert.equal('scene.lua:5: node "emit1": source is a node; :spawn emits from the points of a node: write ' .. call,
      refused(emit))
  end

  it("says how the scene's arguments are written for spawn, by the names of its variables", function()
    expect(':spawn { from = stars, life = {0.5, 1}, on = "death" }', 'source = stars, on = "death", life = {0.5, 1}')
    expect(":spawn { from = stars, count = many, on = old, velocity = {1, 2, 3} }",
      "source = stars, count = many, on = old, velocity = size")
    expect(':spawn { from = stars, attributes = {Cd = {1, 0, 0}}, inherit = {"heat"}, rate = rapid.attr "n" }',
      'source = stars, rate = rapid.attr "n", inherit = {"heat"}, attributes = { Cd = {1, 0, 0} }')
    expect(":spawn { from = stars, attributes = {a = 1, b = {1, 2}, c = 3, d = 4, e = 5, f = 6, g = 7}, count = 1 }",
      "source = stars, count = 1, attributes = { a = 1, b = {1, 2}, c = 3, d = 4, e = 5, f = 6, g = 7 }")
    expect(":spawn { from = chain, birth = function(...) ... end, rate = 5 }",
      "source = rapid.create {} :solve {}, rate = 5, birth = function(p) p.heat = 2 end")
    assert.matches('node "burst": .*name = "burst"', refused 'source = stars, count = 1, name = "burst"')
  end)

  it("says so of the part of the velocity that was inherited under another name", function()
    expect(":spawn { from = stars, inherit_velocity = 0.5, rate = 5 }", "source = stars, rate = 5, inherit = 0.5")
    assert.matches('unknown parameter "inherit"; did you mean "inherit_velocity"?',
      scene.error "return rapid.create {} :emit { source = two, rate = 5, inherit = 0.5 }", 1, true)
  end)

  it("gives the words with which the scene runs to the same bits as under the emitter's name", function()
    local text = "local stars = rapid.create { points = two } :gravity {} :solve {}\n"
      .. "return rapid.create {} :emit { %s } :solve {}"
    local call = scene.error(text:format "source = stars, rate = 500, spread = 40, velocity = {0, 1, 0}")
      :match "write (:spawn .*)$"
    local found = scene.run((text:gsub(":emit { %%s }", (call:gsub("%%", "%%%%")))))[3]
    local named = scene.run((text:format("from = stars, rate = 500, spread = 40, velocity = {0, 1, 0}, name = 'emit1'"
      ):gsub(":emit", ":spawn")))[3]
    assert.is_true(#found > 20)
    assert.same_points(named, found)
  end)

  it("asks no metatable of the arguments", function()
    local result = scene.run [[
local given = setmetatable({ source = two, count = 1 }, { __index = function(_, name) error(name) end })
return rapid.create {} :emit(given) :solve {}]]
    assert.equal(2, #result[3])
  end)

  it("finds a node that a function of the frame returns, too", function()
    local message = scene.error [[
local stars = rapid.create { points = two } :solve {}
return rapid.create {} :emit { source = function() return stars end, count = 1 } :solve {}]]
    assert.matches("source is a node; to emit from its points, use :spawn { from = ... }", message, 1, true)
  end)
end)

describe("the names of nodes that bear", function()
  it("are numbered together, whichever they are", function()
    local function names(first, second)
      local text = ("local a = rapid.create { points = two } :solve {}\nreturn rapid.create {} %s %s :solve {}")
        :format(first, second)
      return scene.command("explain", text, "--json").stdout
    end
    local emit, spawn = ":emit { source = two, count = 1 }", ":spawn { from = a, count = 1 }"
    for _, pair in ipairs { { emit, spawn }, { spawn, emit }, { spawn, spawn }, { emit, emit } } do
      local found = names(unpack(pair))
      assert.matches('"emit1"', found, 1, true)
      assert.matches('"emit2"', found, 1, true)
    end
  end)
end)
