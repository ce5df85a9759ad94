-- Kernels: reads and writes of p, groups, deaths, and the errors of each.
local scene = require "testing.scene"

local function values(points, name)
  local list = {}
  for i = 1, #points do list[i] = points[i][name] end
  return list
end

describe("a kernel", function()
  it("reads and writes floats and vec3s", function()
    local points = scene.kernel("p.v = p.v + vec3(p.heat, 2, 0) p.heat = p.heat * 2",
      "v = {{1, 0, 0}, {0, 0, 5}}, heat = {3, 4}")
    assert.near({4, 2, 0}, points[1].v, 0)
    assert.near({4, 2, 5}, points[2].v, 0)
    assert.same({ 6, 8 }, values(points, "heat"))
  end)

  it("moves the point at once, by a write to P before Solve", function()
    local points = scene.kernel("p.P = p.P + vec3(0, 10, 0) p.v = vec3(24, 0, 0)")
    assert.near({1, 11, 0}, points[1].P, 1e-6)
    assert.near({2, 11, 0}, points[2].P, 1e-6)
  end)

  it("reads back its own writes", function()
    local points = scene.kernel("p.heat = 3 p.heat = p.heat + 1 p.v = vec3(p.heat, 0, 0)", "heat = {0, 0}")
    assert.near({4, 0, 0}, points[2].v, 0)
  end)

  it("rounds its writes to the floats that are kept", function()
    local points = scene.kernel("p.heat = 0.1 if p.heat == 0.1 then p.heat = 7 end", "heat = {0, 0}")
    assert.near(0.1, points[1].heat, 1e-8)
    assert.not_equal(0.1, points[1].heat)
  end)

  it("sees id from 0, index from 1, and dt", function()
    local points = scene.kernel("p.a = p.id p.b = p.index p.c = p.dt", "a = {0, 0}, b = {0, 0}, c = {0, 0}")
    assert.same({ 0, 1 }, values(points, "a"))
    assert.same({ 1, 2 }, values(points, "b"))
    assert.near(1 / 24, points[1].c, 1e-8)
  end)

  it("sees the frame", function()
    local text = [[
return rapid.create { fps = 10, start = 5, points = two } :attribute { a = 0, b = 0, c = 0 }
  :points("k", function(p, frame) p.a = frame.number p.b = frame.time p.c = frame.dt end) :solve {}]]
    local result = scene.run(text, { frames = {5, 8} })
    assert.equal(0, result[5][1].a)
    assert.equal(8, result[8][1].a)
    assert.near(0.3, result[8][1].b, 1e-7)
    assert.near(0.1, result[8][1].c, 1e-8)
  end)

  it("works through other names of its point, and through helpers", function()
    local points = scene.kernel([[
local q = p q.heat = q.heat + 1
  local also = q or p add(also, 10)
  p["heat"] = p["heat"] + 100]], "heat = {0, 1}", "local function more(x) return x.heat + 1000 end " ..
      "local function add(x, n) x.heat = x.heat + n x.heat = more(x) end")
    assert.same({ 1111, 1112 }, values(points, "heat"))
  end)

  it("may call its own closures", function()
    local points = scene.kernel([[
local sum = 0
  local function add(x) sum = sum + x end
  local function heat() return p.heat end
  local list = {}
  local function keep(x) list[#list + 1] = x list.last = x end
  for k = 1, 4 do add(k) keep(k) end
  p.heat = heat() + sum + list.last]], "heat = {100, 200}")
    assert.same({ 114, 214 }, values(points, "heat"))
  end)

  it("keeps its own tables for each point alone", function()
    local points = scene.kernel("local t = {} t.n = (t.n or 0) + 1 t[1] = p.id p.heat = t.n + t[1]", "heat = {0, 0}")
    assert.same({ 1, 2 }, values(points, "heat"))
  end)

  it("reads tables and functions of the file, and Lua's own", function()
    local points = scene.kernel("p.heat = lib.scale(p.heat) + weights[p.index] + math.floor(2.5) + #names",
      "heat = {1, 2}",
      "local lib = { scale = function(x) return x * 10 end } local weights, names = {100, 200}, {'a', 'b', 'c'}")
    assert.same({ 115, 225 }, values(points, "heat"))
  end)

  it("runs on the points of its group alone", function()
    local result = scene.run [[
return rapid.create { points = two } :attribute { heat = 0 }
  :group { name = "far", where = function(p) return p.P.x > 0.5 end }
  :points { name = "k", group = "far", kernel = function(p) p.heat = p.heat + 1 end } :solve {}]]
    assert.same({ 0, 2 }, values(result[3], "heat"))
  end)

  it("runs on no point if its group is empty, and on all if all points are in it", function()
    for where, expected in pairs { ["p.id > 9"] = { 0, 0 }, ["p.id >= 0"] = { 1, 1 } } do
      local result = scene.run(([[
return rapid.create { points = two } :attribute { heat = 0 } :group { name = "g", where = function(p) return %s end }
  :points { name = "k", group = "g", kernel = function(p) p.heat = 1 end } :solve {}]]):format(where))
      assert.same(expected, values(result[3], "heat"))
    end
  end)

  it("may leave the group that it runs on: the choice is the one before", function()
    local result = scene.run [[
return rapid.create { points = two } :attribute { heat = 0 } :group { name = "g" }
  :points { name = "k", group = "g", kernel = function(p) p:leave "g" p.heat = p.heat + 1 end } :solve {}]]
    assert.same({ 2, 2 }, values(result[3], "heat"))
    assert.equal(0, #result[3]:group "g")
  end)
end)

describe("p.dt", function()
  it("is the age that a newborn has when the frame ends, and the frame's length for the others", function()
    local result = scene.run([[
return rapid.create { fps = 10 } :emit { source = rapid.points.from { P = {{0, 0, 0}} }, count = 4, birth = "even" }
  :attribute { first = -1, last = -1 }
  :points("k", function(p) if p.first < 0 then p.first = p.dt end p.last = p.dt end) :solve {}]], { frames = {2, 3} })
    -- With count and birth = "even", point k is born at (k+1)/count of the frame.
    for k = 0, 3 do
      assert.near(0.1 * (1 - (k + 1) / 4), result[2]:by_id(k).first, 1e-7)
      assert.near(0.1, result[3]:by_id(k).last, 1e-7)
    end
  end)

  it("is no attribute of a written frame", function()
    local points = scene.kernel "p.v = p.v * p.dt"
    assert.same({ "P", "id", "v" }, points:names())
  end)
end)

describe("p:join, p:leave and p:within", function()
  it("change and return the groups of a point, which stay with it", function()
    local result = scene.run([[
return rapid.create { points = two } :attribute { seen = 0 }
  :points("k", function(p, frame)
    if p:within "late" then p.seen = p.seen + 1 end
    if frame.number == 2 and p.id == 1 then p:join "late" p:join "other" end
    if frame.number == 4 then p:leave "late" end
  end) :solve {}]], { frames = {1, 5} })
    assert.same({ "late", "other" }, result[1]:groups())
    assert.equal(0, #result[1]:group "late")
    assert.same({ 1 }, values(result[2]:group "late", "id"))
    assert.equal(0, #result[4]:group "late")
    assert.same({ 0, 2 }, values(result[5], "seen"))
    assert.same({ 1 }, values(result[5]:group "other", "id"))
  end)

  it("join at once", function()
    local points = scene.kernel("p:join 'g' if p:within 'g' then p.heat = 1 end", "heat = {0, 0}")
    assert.same({ 1, 1 }, values(points, "heat"))
  end)

  it("work in helpers", function()
    local points = scene.kernel("mark(p)", "heat = {1, 5}",
      "local function mark(x) if x.heat > 2 then x:join 'hot' end end")
    assert.same({ 1 }, values(points:group "hot", "id"))
  end)

  it("return false for a group that nothing has made", function()
    local points = scene.kernel("if p:within 'nowhere' then p.v = vec3(1, 0, 0) end")
    assert.near({0, 0, 0}, points[1].v, 0)
  end)

  it("take a name that holds anything", function()
    local points = scene.kernel([[p:join '50%1 "of" them']])
    assert.equal(2, #points:group '50%1 "of" them')
  end)

  it("refuse a computed name", function()
    assert.equal('scene.lua:2: node "kernel": the kernel joins or leaves a group with a computed name; write the ' ..
      'name as a constant: p:join "old"', scene.kernel_error [[p:join("g" .. p.id)]])
    assert.equal('scene.lua:1: node "kernel": can\'t join the group "g0"; write the name as a constant: p:join ' ..
      '"old" (point id 0, frame 2)',
      scene.kernel_error("enter(p, 'g' .. p.id)", nil, "local function enter(x, name) x:join(name) end"))
  end)
end)

describe("p:kill", function()
  it("removes the point when its node ends", function()
    local result = scene.run [[
return rapid.create { points = two } :attribute { heat = 0 }
  :points("k", function(p) if p.id == 0 then p:kill() p.heat = 5 end end)
  :points("after", function(p) p.heat = p.heat + p.index end) :solve {}]]
    assert.same({ 1 }, values(result[2], "id"))
    assert.same({ 1 }, values(result[2], "heat"))
    assert.same({ 1 }, values(result[3], "id"))
  end)

  it("may remove all, and from a helper", function()
    assert.equal(0, #scene.kernel("p:kill()"))
    assert.equal(1, #scene.kernel("gone(p)", nil, "local function gone(x) if x.id == 1 then x:kill() end end"))
  end)
end)

describe("a kernel that asks for something unknown", function()
  it("is refused before the first frame, with the nearest name", function()
    for body, expected in pairs {
      ["p.v = p.v * p.haet"] = 'scene.lua:2: node "kernel": no attribute "haet"; did you mean "heat"? ' ..
        "(or add :attribute{ haet = 0 } before it)",
      ["p.haet = 1"] = 'scene.lua:2: node "kernel": no attribute "haet"; did you mean "heat"? ' ..
        "(or add :attribute{ haet = 0 } before it)",
      ["p.v = p.v * p.wobble"] = 'scene.lua:2: node "kernel": no attribute "wobble"; ' ..
        "add :attribute{ wobble = 0 } before it",
      ["p.v = p.v * p.pscal"] = 'scene.lua:2: node "kernel": no attribute "pscal"; did you mean "pscale"? ' ..
        "(or add :attribute{ pscal = 0 } before it)",
      ["p.id = 3"] = 'scene.lua:2: node "kernel": the kernel assigns p.id, which is read-only',
      ["p.dt = 3"] = 'scene.lua:2: node "kernel": the kernel assigns p.dt, which is read-only',
      ["p.index = 3"] = 'scene.lua:2: node "kernel": the kernel assigns p.index, which is read-only',
    } do
      local text = scene.kernel_text(body, "heat = {1, 2}")
      local result = scene.command("check", text)
      assert.equal(expected .. "\n", result.stderr)
      assert.equal(2, result.status)
    end
  end)

  it("is refused when it runs, where the name is computed", function()
    assert.equal('scene.lua:2: node "kernel": no attribute "heat" here; declare a computed name with reads = { ' ..
      '"heat" }, or also write it as a constant (the kernel names P, dt, id, index) (point id 0, frame 2)',
      scene.kernel_error("local name = 'he' .. 'at' p.P = p.P * p[name]", "heat = {1, 2}"))
    assert.near({2, 0, 0}, scene.kernel("local name = 'he' .. 'at' p.v = vec3(p[name], 0, 0) local _ = p.heat",
      "heat = {1, 2}")[2].v, 0)
  end)
end)

describe("a kernel's computed names", function()
  local chain = [[
return rapid.create { points = two } :attribute { red = 2, blue = 0 }
  :%s { name = "mix", reads = %s, writes = %s, kernel = function(p)
      p["bl" .. "ue"] = p["re" .. "d"] + 1
    end } :solve {}]]

  it("are those that its node declares", function()
    for _, node in ipairs { "points", "action" } do
      local result = scene.run(chain:format(node, '{ "red" }', '{ "blue" }'), { frames = {1, 2} })
      assert.equal(3, result[2][1].blue)
    end
    local pushed = scene.run([[
return rapid.create { points = two } :action { reads = { "force" }, writes = { "force" }, kernel = function(p)
    p["for" .. "ce"] = p["for" .. "ce"] + vec3(24, 0, 0)
  end } :solve {}]], { frames = {1, 2} })
    assert.near({1, 0, 0}, pushed[2][1].v, 1e-6)
  end)

  it("are checked as others are, before the first frame", function()
    assert.equal('scene.lua:2: node "mix": no attribute "rde"; did you mean "red"? (or add :attribute{ rde = 0 } ' ..
      "before it)", scene.error(chain:format("points", '{ "rde" }', '{ "blue" }')))
    assert.equal('scene.lua:2: node "mix": writes: id is read-only',
      scene.error(chain:format("action", '{ "red" }', '{ "id" }')))
    assert.match('assigns "blue" by a computed name; declare it with writes = { "blue" } %(point id 0, frame 2%)',
      scene.error(chain:format("points", '{ "red", "blue" }', "{}")))
  end)
end)

describe("a kernel that writes what can't be kept", function()
  local place = 'scene.lua:2: node "kernel": '
  local at = " (point id 0, frame 2)"

  it("names the attribute and the value", function()
    for body, expected in pairs {
      ["p.heat = 0 / 0"] = "heat became nan; a float must be between -3.4e38 and 3.4e38",
      ["p.heat = 1 / 0"] = "heat became inf; a float must be between -3.4e38 and 3.4e38",
      ["p.heat = -1e39"] = "heat became -1e+39; a float must be between -3.4e38 and 3.4e38",
      ["p.v = vec3(1, 1e39, 0)"] = "v became vec3(1, 1e+39, 0); a float must be between -3.4e38 and 3.4e38",
      ["p.v = p.v / 0"] = "v became vec3(nan, nan, nan); a float must be between -3.4e38 and 3.4e38",
      ["p.heat = 'hot'"] = 'attribute "heat" takes a number, not "hot"',
      ["p.heat = nil"] = 'attribute "heat" takes a number, not nil',
      ["p.heat = true"] = 'attribute "heat" takes a number, not true',
      ["p.heat = p.v"] = 'attribute "heat" takes a number, not vec3(0, 0, 0)',
      ["p.v = 1"] = 'attribute "v" takes a vec3, not 1',
      ["p.v = {1, 2, 3}"] = 'attribute "v" takes a vec3, not a table; vec3(x, y, z) makes one',
      ["p.v = nil"] = 'attribute "v" takes a vec3, not nil',
      ["p.hitnum = 1.5"] = 'attribute "hitnum" takes a whole number, not 1.5',
      ["p.hitnum = 3e9"] = 'attribute "hitnum" takes a whole number, not 3000000000',
    } do
      -- The sign of 0 / 0 is not defined.
      local message = scene.kernel_error(body, "heat = {1, 2}"):gsub("%-nan", "nan"):gsub("; P = .*%)$", ")")
      assert.equal(place .. expected .. at, message)
    end
  end)

  it("reports a value that is not finite with all that the point has", function()
    assert.equal(place .. "heat became inf; a float must be between -3.4e38 and 3.4e38 (point id 0, frame 2; " ..
      "P = {0, 1, 0}, v = {0, 0, 0}, heat = 3, in \"hot\")",
      scene.kernel_error("p:join 'hot' p.heat = 3 p.heat = 1 / 0", "heat = {1, 2}"))
  end)

  it("keeps the largest float", function()
    assert.equal(3.4028234663852886e38, scene.kernel("p.heat = 3.4028234663852886e38", "heat = {0, 0}")[1].heat)
    local largest = scene.kernel("local x = 3.4028234663852886e38 p.v = vec3(x, -x, x)")[1].v
    assert.same({ 3.4028234663852886e38, -3.4028234663852886e38 }, { largest.x, largest.y })
  end)

  it("names the first point that fails, whichever thread comes upon one first", function()
    local text = [[
return rapid.create { points = rapid.points.grid { size = {40, 40, 40}, spacing = 1 } }
  :points("k", function(p) if p.id % 1000 == 777 then p.v = p.v / 0 end end) :solve {}]]
    for _, threads in ipairs { 1, 2, 7 } do
      local message = scene.error(text, { threads = threads })
      assert.truthy(message:find("(point id 777, frame 2; P = {-19.5, -0.5, -2.5}, v = {0, 0, 0})", 1, true), message)
    end
  end)
end)

describe("a test of a point", function()
  it("can't change it", function()
    assert.equal('scene.lua:1: node "delete1": assigns "v"; a condition must not change its point (point id 0, ' ..
      'frame 1)',
      scene.error "return rapid.create { points = two } :delete { where = function(p) p.v = vec3(0, 0, 0) end }")
  end)

  it("is true as Lua has it", function()
    for value, left in pairs { ["nil"] = 2, ["false"] = 2, ["0"] = 0, ["''"] = 0, ["p.id == 1"] = 1 } do
      local text = "return rapid.create { points = two } :delete { where = function(p) return %s end } :solve {}"
      assert.equal(left, #scene.run(text:format(value))[2], value)
    end
  end)
end)

describe("a kernel of many names", function()
  it("reads and writes a hundred attributes, and joins as many groups", function()
    local made, body = {}, {}
    for i = 1, 100 do
      made[i] = ("a%d = %d"):format(i, i)
      body[i] = ("p.a%d = p.a%d * 2 + p.a%d if p.id == %d then p:join 'g%d' end"):format(i, i, i % 100 + 1, i % 2, i)
    end
    local text = "return rapid.create { points = two } :attribute { %s } :points('k', function(p) %s end) :solve {}"
    local points = scene.run(text:format(table.concat(made, ", "), table.concat(body, " ")), { frames = {2, 2} })[2]
    for i = 1, 99 do
      assert.equal(3 * i + 1, points[1]["a" .. i])
      assert.equal(1, #points:group("g" .. i))
    end
  end)
end)
