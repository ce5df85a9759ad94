-- :detail: a function over the whole set, and its values for kernels.
local scene = require "testing.scene"

local function run(body, frames, after)
  return scene.run(([[
return rapid.create { fps = 24, seed = 5,
  points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 3, 0}}, heat = {1, 2, 3, 4} } }
  :attribute { n = 0, Cd = {1, 1, 1} }
  :detail("d", function(points, frame)
  %s
end)%s :solve {}]]):format(body, after or ""), { frames = frames or {1, 2} })
end

local function values(points, name)
  local list = {}
  for i = 1, #points do list[i] = points[i][name] end
  return list
end

describe("a detail function", function()
  it("reads and writes the points by index", function()
    local points = run([[
for i = 1, #points do local p = points[i] p.heat = p.heat * 10 + p.index p.v = vec3(0, i, 0) end]])[2]
    assert.same({ 11, 22, 33, 44 }, values(points, "heat"))
    assert.near({0, 3, 0}, points[3].v, 0)
  end)

  it("leaves alone what other sets share", function()
    local result = run("points[1].heat = points[1].heat + 1", {1, 4})
    assert.same({ 1, 2, 3, 4 }, values(result[1], "heat"))
    assert.same({ 2, 2, 3, 4 }, values(result[2], "heat"))
    assert.same({ 4, 2, 3, 4 }, values(result[4], "heat"))
  end)

  it("sums, averages and bounds", function()
    local points = run [[
points[1].n = points:sum "heat"
points[2].n = points:mean("P").y
points[3].n = points:min "heat" + points:max "heat"
local lo, hi = points:bounds()
points[4].n = lo.x + hi.x + hi.y]][2]
    assert.same({ 10, 0.75, 5, 5 }, values(points, "n"))
  end)

  it("finds the neighbours within a radius, in order, as counting all pairs does", function()
    local text = [[
return rapid.create { fps = 24 }
  :emit { source = rapid.shape.box { size = {1, 1, 1} }, from = "volume", impulse = { [2] = 600 } }
  :attribute { n = 0, order = 0, direct = 0 }
  :detail("d", function(points)
    for i = 1, #points do
      local near, last = points:neighbours(i, 0.15), 0
      points[i].n = #near
      for _, j in ipairs(near) do
        if j <= last or j == i then points[i].order = 1 end
        last = j
      end
      local direct = 0
      for j = 1, #points do
        if j ~= i and (points[j].P - points[i].P):length() <= 0.15 then direct = direct + 1 end
      end
      points[i].direct = direct
    end
  end) :solve {}]]
    local points, most = scene.run(text, { frames = {2, 2} })[2], 0
    for i = 1, #points do
      assert.equal(points[i].direct, points[i].n)
      assert.equal(0, points[i].order)
      most = math.max(most, points[i].n)
    end
    assert.truthy(most > 8)
  end)

  it("adds points, which get ids of their own and the values that it gives", function()
    local result = run("if frame.number == 2 then points:add { P = vec3(7, 8, 9), heat = 5 } end", {1, 4})
    for _, frame in ipairs { 2, 4 } do
      local points = result[frame]
      assert.equal(5, #points)
      assert.equal(4, points[5].id)
      assert.near({7, 8, 9}, points[5].P, 0)
      assert.equal(5, points[5].heat)
      assert.near({1, 1, 1}, points[5].Cd, 0)
    end
  end)

  it("adds points that move for a part of the frame, from lists of numbers, into groups", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = two } :group { name = "old", where = function(p) return p.id < 2 end }
  :points("hot", function(p) if p.id == 99 then p:join "hot" end end)
  :detail("d", function(points, frame)
    if frame.number ~= 3 then return end
    points:add { P = {7, 8, 9}, v = {0, 2, 0}, dt = 0.01, group = "hot" }
    points:add { P = {7, 8, 9}, v = {0, 2, 0}, group = { "hot", "old" } }
  end)
  :points("read", function(p) local _ = p.age end) :solve {}]], { frames = {1, 4} })
    local points = result[3]
    assert.near({7, 8.02, 9}, points[3].P, 1e-6)
    assert.near(0.01, points[3].age, 1e-8)
    assert.near({7, 8 + 2 / 24, 9}, points[4].P, 1e-6)
    assert.is_true(points[3]:within "hot" and points[4]:within "hot" and points[4]:within "old")
    assert.is_false(points[3]:within "old")
    assert.near({0, 1, 0}, points[1].P, 0)
    assert.near({7, 8.02 + 2 / 24, 9}, result[4][3].P, 1e-6)
  end)

  it("keeps whole frames for added points where others are newborn", function()
    local points = scene.run([[
return rapid.create { fps = 24 } :emit { source = two, count = 2, velocity = {0, 1, 0} }
  :detail("d", function(points) points:add { v = {0, 2, 0} } end) :solve {}]], { frames = {2, 2} })[2]
    assert.near({0, 2 / 24, 0}, points[3].P, 1e-6)
  end)

  it("kills points when it ends", function()
    local points = run("points:kill(2) points[4]:kill() points[1].n = #points")[2]
    assert.same({ 0, 2 }, values(points, "id"))
    assert.equal(4, points[1].n)
  end)

  it("sorts by an attribute or by a function, and points keep their ids", function()
    assert.same({ 3, 2, 1, 0 }, values(run("points:sort(function(p) return -p.heat end)")[2], "id"))
    assert.same({ 1, 0, 2, 3 }, values(run("points[1].heat = 3 points:sort 'heat'")[2], "id"))
    assert.same({ 2, 1, 0 }, values(run("points:kill(4) points:sort(function(p) return -p.heat end)")[2], "id"))
  end)

  it("kills, adds and sorts in any order", function()
    -- Heats 1, 2, 3, 4: the last point is killed, then the order is reversed, then the point with heat 2 is killed.
    local points = run([[
if frame.number == 2 then
  points:kill(4) points:add { heat = 9 } points[1]:join "g"
  points:sort(function(p) return -p.heat end)
  points[3]:kill() points[2].n = points[4]:within "g" and points[1].heat or 0
end]], {2, 2})[2]
    assert.same({ 3, 1, 9 }, values(points, "heat"))
    assert.same({ 4, 0, 0 }, values(points, "n"))
    assert.same({ 2, 0, 4 }, values(points, "id"))
  end)

  it("sees attributes of any name", function()
    local points = scene.run([[
return rapid.create { points = two } :attribute { place = 5, serial = 6, size = 7 }
  :detail("d", function(points)
    points[1].place = points[1].place + 1 points[1].size = points[2].serial
  end) :solve {}]], { frames = {2, 2} })[2]
    assert.same({ 6, 6, 6 }, { points[1].place, points[1].serial, points[1].size })
  end)

  it("assigns the least and the largest integers, as a kernel does, and none beyond them", function()
    local text = [[
return rapid.create { points = two } :attribute { instance = 0 }
  :detail("d", function(points) points[1].instance, points[2].instance = -2147483648, 2147483647 end)
  :points("k", function(p) if p.id == 1 then p.instance = -p.instance - 1 end end) :solve {}]]
    assert.same({ -2147483648, -2147483648 }, values(scene.run(text, { frames = {2, 2} })[2], "instance"))
    for _, beyond in ipairs { "-2147483649", "2147483648" } do
      local message = scene.error((text:gsub("2147483647", beyond)))
      assert.truthy(message:find("attribute \"instance\" takes a whole number, not " .. beyond, 1, true), message)
    end
  end)

  it("runs as often as a long sequence has frames", function()
    local result = scene.run([[
local chain = rapid.create { points = two } :attribute { n = 0 }
for i = 1, 60 do chain = chain:detail("d" .. i, function(points) points[1].n = points[1].n + 1 end) end
return chain:solve {}]], { frames = {601, 601} })
    assert.equal(36000, result[601][1].n)
  end)

  it("joins and leaves groups, and draws random numbers", function()
    local points = run([[
for i = 1, #points do if points[i].heat > 2 then points[i]:join "hot" end end
points[3]:leave "hot"
points[1].n = points[1]:rand(1)]], {1, 2}, ':points("k", function(p) if p:within "hot" then p.n = 7 end end)')[2]
    assert.equal(7, points[4].n)
    assert.equal(0, points[3].n)
    assert.truthy(points[1].n > 0 and points[1].n < 1)
  end)
end)

describe("a detail value", function()
  it("is read by the kernels after it, and by those of later frames", function()
    local result = run([[
points.detail.total = (points.detail.total or 0) + points:sum "heat" points.detail.at = points:mean "P"]], {1, 3}, [[

  :points("k", function(p, frame) p.n = frame.detail.total p.Cd = frame.detail.at end)
  :action("a", function(p, step) p.heat = p.heat + step.detail.total end)]])
    assert.equal(10, result[2][1].n)
    assert.near({0.75, 0.75, 0}, result[2][1].Cd, 1e-6)
    assert.equal(11, result[2][1].heat)
    assert.equal(10 + 50, result[3][1].n)
  end)

  it("leaves the kernel that reads it compiled", function()
    for _, node in ipairs { ":points", ":action" } do
      local result = scene.run(([[
return rapid.create { points = rapid.points.grid { size = {10, 10, 10}, spacing = 0.5 } }
  :detail("sum", function(points) points.detail.mean = 0.5 end)
  %s("k", function(p, frame) p.v = p.v * (1 + frame.detail.mean) end) :solve {}]]):format(node),
        { frames = {1, 4}, threads = 1, watch_traces = true })
      assert.same({}, result.trace_aborts)
    end
  end)

  it("that is not there, or can't be one, is an error", function()
    local function message(body, kernel)
      return scene.error(([[
return rapid.create { points = two } :detail("d", function(points) %s end)
  :points("k", function(p, frame) %s end) :solve {}]]):format(body, kernel or ""), { frames = {1, 2} })
    end
    assert.equal('scene.lua:2: node "k": no detail value "totl"; there are lo, total (point id 0, frame 2)',
      message("points.detail.total = 1 points.detail.lo = 2", "local _ = frame.detail.totl"))
    assert.equal('scene.lua:2: node "k": no detail value "n"; set it in a :detail: points.detail.n = 0 ' ..
      "(point id 0, frame 2)", message("", "local _ = frame.detail.n"))
    assert.equal('scene.lua:1: node "d": points.detail.x = nan; a detail value is a finite number or a vec3 (frame 2)',
      (message("points.detail.x = 0/0"):gsub("-nan", "nan")))
    assert.match("detail.n can't be assigned in a kernel", message("points.detail.n = 1", "frame.detail.n = 2"))
  end)
end)

describe("an error in a detail function", function()
  it("names the node, the line and the frame", function()
    for body, expected in pairs {
      ["points[5].heat = 1"] = "points: there is no point 5; the set has 1 to 4",
      ["points[0].heat = 1"] = "points: there is no point 0; the set has 1 to 4",
      ["points[1].hat = 1"] = 'no attribute "hat"; did you mean "heat"? (or add :attribute{ hat = 0 } before it)',
      ["points[1].N = vec3(1, 0, 0)"] = 'no attribute "N"; add :attribute{ N = {0, 0, 0} } before it',
      ["points:max 'colour'"] = 'no attribute "colour"; the colour of points is Cd',
      ["points[1].heat = vec3(0, 0, 0)"] = 'attribute "heat" takes a number, not vec3(0, 0, 0)',
      ["points[1].P = vec3(1 / 0, 0, 0)"] = "P became vec3(inf, 0, 0); a float must be between -3.4e38 and 3.4e38",
      ["points[1].id = 3"] = "id is read-only",
      ["points:add { id = 3 }"] = "id is read-only",
      ["points:add { dt = 0.1 }"] =
        "points:add: dt = 0.1; it must be from 0 to 0.0416666667 s, the time that the point moves in this frame",
      ["points:add { group = 'cold' }"] = "points:add: no node makes a group \"cold\"",
      ["points:add { heta = 3 }"] =
        'no attribute "heta"; did you mean "heat"? (or add :attribute{ heta = 0 } before it)',
      ["points:neighbours(1, 0)"] = "neighbours within 0 m of points up to 3 m from the origin; the radius must be " ..
        "above 0, and above 2.79397e-09 m there",
      ["points:average 'heat'"] = 'points have no "average"; they have add, bounds, detail, events, kill, max, ' ..
        "mean, min, neighbours, sort and sum",
      ["points:sort(function(p) return p.P end)"] =
        "points:sort: the key of point 1 is vec3(0, 0, 0); it must be a number",
      ["error {}"] = "the script raised an error with a table instead of a message",
    } do
      local ok, message = pcall(run, body)
      assert.falsy(ok, body)
      assert.equal('scene.lua:5: node "d": ' .. expected .. " (frame 2)",
        (message:gsub(scene.folder.path:gsub("%W", "%%%0") .. "/", "")), body)
    end
  end)

  it("that is a store into what other functions share is found before the first frame", function()
    assert.match('node "d": the kernel assigns the global "n"; a frame may depend only on the points that enter it: ' ..
      "store the value in a detail value, points.detail.NAME = value", select(2, pcall(run, "n = #points")))
  end)
end)

describe("a node that Lua defines with detail", function()
  it("gets its parameters, and is checked as others are", function()
    scene.folder:write("count.lua", [[
return require "rapid".node {
  name = "count", doc = "Counts neighbours.",
  params = { radius = { "float", default = 1, min = 0, unit = "m", doc = "how near" } },
  detail = function(points, frame, params)
    for i = 1, #points do points[i].n = #points:neighbours(i, params.radius) end
  end,
}]])
    local text = [[
return rapid.create { points = two } :attribute { n = 0 } :count { radius = %s } :solve {}]]
    assert.equal(1, scene.run(text:format "1.5", { frames = {1, 2} })[2][1].n)
    assert.equal(0, scene.run(text:format "0.5", { frames = {1, 2} })[2][1].n)
    assert.match('node "count1": radius = %-1 is out of range', scene.error(text:format "-1"))
  end)
end)

describe("points.events", function()
  -- A ball falls from 1 m and hits the floor once per bounce; another, with a life of 0.3 s, dies on the way.
  local function text(before, after)
    return ([[
return rapid.create { fps = 24, points = rapid.points.from {
    P = {{0, 1, 0}, {5, 9, 0}}, life = {math.huge, 0.3}, mass = {2, 1} } }
  :emit { source = rapid.points.from { P = {{9, 9, 9}} }, impulse = {[3] = 1}, birth = "even" }
  %s :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.5 } :solve {} %s]]):format(before, after)
  end
  local keep = [[:detail("keep", function(points)
    local events = points.events
    local d = points.detail
    d.hits, d.deaths, d.births = #events.hits, #events.deaths, #events.births
    for _, hit in ipairs(events.hits) do
      d.at, d.speed, d.impulse, d.id, d.P, d.N = hit.time, hit.speed, hit.impulse, hit.id, hit.P, hit.N
      d.v = hit.v
    end
    for _, death in ipairs(events.deaths) do d.died, d.dead = death.time, death.id end
    for _, birth in ipairs(events.births) do d.born, d.new = birth.time, birth.id end
  end)
  :attribute { a = {0, 0, 0}, b = {0, 0, 0}, c = {0, 0, 0} }
  :points("show", function(p, frame)
    local d = frame.detail
    p.a = vec3(d.hits, d.deaths, d.births)
    if d.hits > 0 then p.b, p.c = vec3(d.at, d.speed, d.impulse), vec3(d.id, d.P.y, d.v.y * d.N.y) end
    if d.deaths > 0 then p.b = vec3(d.died, d.dead, 0) end
    if d.births > 0 then p.b = vec3(d.born, d.new, 0) end
  end)]]

  it("after Solve are those of the frame: contacts, deaths and births, with their times", function()
    local result = scene.run(text("", keep), { frames = {2, 14} })
    local meets = math.sqrt(2 / 9.81)
    for frame, points in result:frames() do
      local from, to = (frame - 2) / 24, (frame - 1) / 24
      local function within(time) return from < time and time <= to and 1 or 0 end
      assert.near({within(meets), within(0.3), frame == 3 and 1 or 0}, points[1].a, 0, tostring(frame))
      if within(meets) == 1 then
        assert.near({meets, 9.81 * meets, 2 * 1.5 * 9.81 * meets}, points[1].b, 1e-5)
        assert.near({0, 0, 0.5 * 9.81 * meets}, points[1].c, 1e-5)
      elseif within(0.3) == 1 then
        assert.near({0.3, 1, 0}, points[1].b, 1e-6)
      elseif frame == 3 then
        assert.near(2, points[1].b.y, 0)
        assert.near(2 / 24, points[1].b.x, 1e-6)
      end
    end
  end)

  it("in front of Solve are those of the frame before", function()
    local result = scene.run(text(keep, ""), { frames = {2, 14} })
    local meets = math.sqrt(2 / 9.81)
    for frame, points in result:frames() do
      local from, to = (frame - 3) / 24, (frame - 2) / 24
      assert.equal(from < meets and meets <= to and 1 or 0, points[1].a.x)
    end
  end)

  it("need a Solve", function()
    assert.matches("points.events needs a :solve at the end of the chain", scene.error [[
return rapid.create { points = two } :detail("d", function(points) return #points.events.hits end)]], 1, true)
  end)
end)
