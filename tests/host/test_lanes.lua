-- Lane programs: the same bits as one point at a time, for every construct that they support, and fallback of a tile to
-- the kernel itself. test_random_kernels.lua has random kernels.
local scene = require "testing.scene"

-- Points with values of both signs, zeros and large ones, of all types.
local head = [[
local points = rapid.points.grid { size = {10, 9, 7}, spacing = 1 }
local limit, tint, names = 0.25, vec3(0.2, -0.4, 1.5), { near = 2.5, { 7 } }
local function mixed(a, b) return a * 0.25 + b * 0.75 end
local function choice(p) if p.P.x > 1 then return p.v, 2 end return -p.v, p.heat end
return rapid.create { points = points, seed = 4 }
  :attribute { heat = 0.5, instance = 3, axis = {0, 1, 0}, turn = {0, 0, 0, 1} }
  :points("first", function(p)
      p.v = p.P * 0.3 - vec3(0.7, 0.2, 0.1) * p:rand(7)
      p.heat = p.P.x - p.P.y * 0.5
      if p.P.z > 2 then p:join "high" end
      if p.id == 200 then p.heat = 0 end
    end)
]]

local function values_of(points)
  local lines = {}
  for k = 1, #points do
    local point = points[k]
    local words = {}
    for _, name in ipairs(points:names()) do words[#words + 1] = name .. "=" .. tostring(point[name]) end
    for _, name in ipairs(points:groups()) do words[#words + 1] = name .. tostring(point:within(name)) end
    lines[k] = table.concat(words, " ")
  end
  return lines
end

-- Returns the points of both modes, and the list of kernels that are not lane programs.
local function both(text, frames)
  local lanes = scene.run(text, { frames = frames or {1, 4}, watch_lanes = true, threads = 1 })
  local single = scene.run(text, { frames = frames or {1, 4}, watch_traces = true, threads = 1 })
  local last = (frames or {1, 4})[2]
  return values_of(lanes[last]), values_of(single[last]), lanes.no_lanes, lanes
end

local function same(body, behind)
  local text = head .. ("  :points(\"k\", function(p, frame)\n%s\nend)\n%s  :solve {}"):format(body, behind or "")
  local lanes, single, none = both(text)
  assert.same({}, none)
  assert.same(single, lanes)
  return lanes
end

describe("a kernel as a program of lanes", function()
  for what, body in pairs {
    ["arithmetic"] = "p.heat = (p.heat + 2) * p.P.x - p.P.y / (1 + p.heat * p.heat) % 0.7 - -p.P.z",
    ["a remainder of both signs"] = "p.heat = p.P.x % 0.7 + p.P.y % -0.3",
    ["powers"] = "p.heat = p.P.x ^ 2 + math.abs(p.P.y) ^ 0.5 + 2 ^ p.P.z + p.P.x ^ -3",
    ["loops over known numbers"] = "local a = 1  for k = 3, 1, -1 do a = a * p.P.x + k  if a > 9 then break end "
      .. "if p.P.y > 0 then a = a - 1 end end  for k = 1, 0 do a = 1e9 end  p.heat = a",
    ["loops within loops"] = "local a = 0  for i = 1, 3 do for k = i, 3 do a = a + i * k * p.P.x end end  p.heat = a",
    ["functions"] = "p.heat = math.sqrt(math.abs(p.P.x)) + math.floor(p.P.y) + math.ceil(p.P.z) + math.sin(p.P.x) "
      .. "+ math.cos(p.P.y * 40) + math.exp(p.P.z)",
    ["functions of the C library"] = "p.heat = math.tan(p.P.x) + math.atan(p.P.y) + math.atan2(p.P.y, p.P.z + 0.01) "
      .. "+ math.log(1.5 + math.abs(p.P.x)) + math.log10(2 + p.P.x ^ 2) + math.tanh(p.P.z) + math.sinh(p.P.x) "
      .. "+ math.cosh(p.P.y) + math.asin(p:rand(1)) + math.acos(-p:rand(2))",
    ["zeros of both signs"] = "p.heat = math.atan2(-0.0, -1) + 3 * math.atan2(0.0, -1) + p.P.x",
    ["angles that are large"] = "p.heat = math.sin(p.P.x * 1e5) + math.cos(p.P.y * 1e9)",
    ["the least and the largest"] = "p.heat = math.max(math.min(p.P.x, p.P.y, 0.5), p.P.z, -0.25)",
    ["vectors"] = "p.v = (p.P + p.v * 2 - tint) / 3 * p.P + -tint:cross(p.v) * p.P:dot(p.v)",
    ["functions of vectors"] = "p.v = p.P:normalized():lerp(p.v, p:rand(1)) * p.v:length()",
    ["turns"] = "p.turn = rapid.math.rotation(p.P + vec3(0, 20, 0), p.heat * 30) * p.turn  "
      .. "p.axis = p.turn:rotate(p.axis)",
    ["random numbers"] = "p.v = vec3(p:rand(1), p:rand(2, frame), p:rand(p.P.x)) * p:rand(3, p.P.y)",
    ["branches"] = "if p.P.x > 1 then p.heat = 1 elseif p.P.y < 0 then p.heat = 2 else p.heat = p.heat * 3 end",
    ["branches within branches"] = "local a = 1  if p.P.x > 0 then a = 2  "
      .. "if p.P.y > 0 then a = p.P.z  p.v = p.v * 2 end else p.heat = -a end  p.heat = p.heat + a",
    ["and, or, not"] = "local far = p.P.x > 2 or not (p.P.y > 0 and p.P.z > 0)  "
      .. "p.heat = far and 3 or p.P.x > 0 and 4 or 5",
    ["comparisons"] = "p.heat = (p.P.x >= 1 and 1 or 0) + (p.P.y <= 1 and 2 or 0) + (p.P.z ~= 1 and 4 or 0) "
      .. "+ (p.P.x == p.P.y and 8 or 0) + (p.P == p.v and 16 or 0)",
    ["a return in the middle"] = "if p.P.x > 1 then return end  p.heat = 9",
    ["helpers"] = "p.heat = mixed(p.P.x, p.heat)  local a, b = choice(p)  p.v = a * b",
    ["values that are shared"] = "p.heat = limit * names.near + names[1][1] + frame.time * frame.number "
      .. "+ frame.dt + p.dt",
    ["functions of rapid.math"] = "p.heat = rapid.math.fit(p.P.x, -1, 1, 0, 2) + rapid.math.smoothstep(-2, 2, p.P.y) "
      .. "+ rapid.math.clamp(p.P.z, -1, 1)",
    ["groups"] = "if p:within \"high\" then p:leave \"high\" else p:join \"low\" end  "
      .. "p.heat = p:within \"low\" and 1 or 0",
    ["whole numbers"] = "p.instance = p.instance + math.floor(p.P.x) * 2  p.heat = p.id + p.index",
    ["a whole number that a float is rounded to"] = "p.heat = 3 - 1e-12 * p.P.x  p.instance = p.heat",
    ["death"] = "if p.P.x > 2 and p:rand(9) < 0.5 then p:kill() end",
    ["what it has written"] = "p.heat = 1 / 3  p.v = vec3(p.heat, p.heat * 3, 0)  p.heat = p.v.x - 1 / 3",
  } do
    it("has the same bits with " .. what, function()
      same(body)
    end)
  end

  it("is one in a group, in a test, with parameters and detail values, and in an action", function()
    local text = head .. [[
  :detail("sum", function(points) points.detail.mean = #points * 0.001 end)
  :points { name = "of_high", group = "high", kernel = function(p, frame) p.heat = p.heat + frame.detail.mean end }
  :delete { where = function(p) return p.heat > 3 and p:rand(5) < 0.5 end }
  :action("inside", function(p, step)
      p.v = p.v * (1 - 0.1 * step.dt) + vec3(0, 0.01 * step.index, p:rand(1, step))
      p.P = p.P + vec3(0, 0, 1e-3 * step.time)
    end)
  :gravity {} :solve { substeps = 3 }]]
    local lanes, single, none = both(text)
    assert.same({}, none)
    assert.same(single, lanes)
    assert.truthy(#lanes > 100)
  end)

  it("keeps a float rounded that goes into a column of doubles", function()
    local text = head .. [[
  :action("inside", function(p) p.heat = 1 / 3  p.v = vec3(p.heat, 0, 0) end)
  :action("lost", function(p) p.v = (p.v - vec3(1 / 3, 0, 0)) * 1e9 end)
  :solve {}]]
    local lanes, single, none, frames = both(text)
    assert.same({}, none)
    assert.same(single, lanes)
    assert.near(9.93, frames[4][1].v.x, 0.01) -- 1e9 (float(1/3) - 1/3)
  end)

  it("has the same bits where newborn points move for a part of the frame", function()
    local text = [[
return rapid.create { seed = 9 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} }, rate = 12000, birth = "random", life = {0.05, 0.2},
          velocity = {1, 2, 3}, spread = 40, attributes = { heat = 1 } }
  :points("k", function(p)
      p.heat = p.heat * math.exp(-p.dt) + math.sin(9 * p.dt)
      p.v = p.v * (1 - p.dt) + vec3(math.cos(p.dt), p.dt, 0)
      if p.age > 0.1 then p:join "old" end
    end)
  :points { name = "of_old", group = "old", kernel = function(p) p.heat = p.heat - p.dt * p.dt end }
  :solve {}]]
    local lanes, single, none = both(text, {1, 6})
    assert.same({}, none)
    assert.same(single, lanes)
    assert.truthy(#lanes > 1000)
  end)

  it("follows a parameter whose value changes", function()
    local node = scene.folder:write("swell.lua", [[
local rapid = require "rapid"
return rapid.node { name = "swell", doc = "larger", params = { by = { "float", default = 1, doc = "times" } },
  points = function(p, _, params) p.heat = p.heat * params.by end }
]])
    assert.truthy(node)
    local text = head .. "  :swell { by = function(frame) return frame.number end } :solve {}"
    local lanes, single, none = both(text, {1, 5})
    assert.same({}, none)
    assert.same(single, lanes)
  end)

  it("follows a flag that chooses what it does, and changes", function()
    scene.folder:write("grow.lua", [[
local rapid = require "rapid"
return rapid.node { name = "grow", doc = "larger, or smaller",
  params = { up = { "bool", default = true, doc = "larger" } },
  points = function(p, _, params) if params.up then p.heat = p.heat * 3 else p.heat = p.heat * 0.5 end end }
]])
    local text = head .. "  :grow { up = function(frame) return frame.number % 2 == 0 end } :solve {}"
    for last = 2, 5 do
      local lanes, single, none = both(text, {1, last})
      assert.same({}, none)
      assert.same(single, lanes)
    end
  end)

  -- The value that even points store in x, and odd ones; an expression of x, and its results for both.
  for _, case in ipairs {
    { "vec3(1, 2, 3)", "quat(5, 6, 7, 1)", "x.x", 1, 5 },
    { "p.turn", "p.axis", "x.y", 0, 1 },
    { "1", "vec3(5, 6, 7)", "type(x) == \"number\" and x or x.x", 1, 5 },
    { "p.P", "5", "type(x) == \"number\" and x or 1", 1, 5 },
    { "nil", "5", "x or 1", 1, 5 },
    { "false", "5", "x or 1", 1, 5 },
    { "nil", "p.P.x > 1e9", "x == false and 5 or 1", 1, 5 },
    { "\"a\"", "\"b\"", "x == \"a\" and 1 or 5", 1, 5 },
    { "\"a\"", "1", "x == 1 and 5 or 1", 1, 5 },
    { "names", "names[1]", "x.near or x[1]", 2.5, 7 },
    { "math.abs", "math.floor", "x(-0.5)", 0.5, -1 },
    { "mixed", "math.atan2", "x(4, 0)", 1, math.pi / 2 },
    { "p.within", "p.rand", "type(x(p, 1)) == \"boolean\" and 1 or 5", 1, 5 },
    { "frame.detail", "names", "x.near", 9, 2.5 },
  } do
    local first, second, result, even, odd = unpack(case)
    it(("follows a local that is %s for some points and %s for others"):format(first, second), function()
      local text = head .. ([[
  :detail("near", function(points) points.detail.near = 9 end)
  :points("k", function(p, frame)
      local x
      if p.id %% 2 == 0 then x = %s else x = %s end
      p.heat = %s
    end) :solve {}]]):format(first, second, result)
      local lanes, single, _, frames = both(text, {1, 2})
      assert.same(single, lanes)
      for k = 1, 40 do
        assert.near(frames[2][k].id % 2 == 0 and even or odd, frames[2][k].heat, 1e-6)
      end
    end)
  end

  it("has no -0 in whole numbers, as a point by itself has none", function()
    local text = head .. [[
  :points("k", function(p)
      p.instance, p.parent = -math.abs(p.P.x) * 0, -p.heat * 0
      p.heat = (1 / p.instance > 0 and 1 or 2) + (1 / p.parent > 0 and 10 or 20)
    end) :solve {}]]
    local lanes, single, none, frames = both(text)
    assert.same({}, none)
    assert.same(single, lanes)
    assert.equal(11, frames[4][600].heat)
    -- Also in the next kernel of a pass, and if only one branch assigns.
    same("p.instance = p.P.x * -0.0",
      ":points(\"next\", function(p) p.heat = 1 / p.instance > 0 and 1 or -1 end)")
    same("if p.P.x > 0 then p.instance = p.P.x * -0.0 end  p.heat = math.atan2(p.instance, -1)")
  end)

  it("gives the kernel of no node a third argument that is nil", function()
    local lanes, single, none, frames = both(head .. [[
  :detail("mean", function(points) points.detail.mean = 2 end)
  :points("third", function(p, frame, third) p.heat = third and 9 or frame.detail.mean end) :solve {}]])
    assert.same({}, none)
    assert.same(single, lanes)
    assert.equal(2, frames[4][1].heat)
  end)

  it("is rejected if it writes a string or another type", function()
    for body, message in pairs { ["p.name = 3"] = "takes a string, not 3", ["p.name = \"b\""] = false } do
      local text = head:gsub("heat = 0.5", "heat = 0.5, attributes = { name = \"a\" }")
        .. ("  :points(\"k\", function(p)\n%s\nend) :solve {}"):format(body)
      if message then
        assert.truthy(scene.error(text):find(message, 1, true))
      else
        local _, _, none = both(text)
        assert.truthy(none[1]:find("the attribute name is a text", 1, true), none[1])
      end
    end
  end)

  it("is rejected if its calls never end", function()
    local chain = { "local function f0(x) return x end" }
    for k = 1, 25 do chain[k + 1] = ("local function f%d(x) return f%d(f%d(x)) end"):format(k, k - 1, k - 1) end
    local text = table.concat(chain, "\n") .. "\n" .. head
      .. "  :points(\"k\", function(p) if p.heat > 1e9 then p.heat = f25(p.heat) end end) :solve {}"
    local lanes, single, none = both(text)
    assert.equal(1, #none)
    assert.truthy(none[1]:find("it is long", 1, true), none[1])
    assert.same(single, lanes)
  end)

  it("has the same bits on any number of threads", function()
    local text = head .. [[
  :points("k", function(p) p.v = p.v:normalized() * math.sin(p.P.x) * p:rand(2) end) :solve {}]]
    local one = values_of(scene.run(text, { frames = {1, 3}, threads = 1 })[3])
    assert.same(one, values_of(scene.run(text, { frames = {1, 3}, threads = 3 })[3]))
  end)

  it("gives a tile back whose points do what it can't", function()
    local lanes, single, none = both(head .. [[
  :points("k", function(p)
      local far = p.P.x > 4 and p.P.y > 3
      if far then
        local list = { p.P.x, p.P.y }
        table.sort(list)
        p.heat = list[1]
      else
        p.heat = p.heat * 2
      end
    end) :solve {}]])
    assert.same({}, none)
    assert.same(single, lanes)
  end)

  for body, message in pairs {
    ["p.heat = 1 / p.heat"] = "became inf",
    ["p.heat = math.log(p.heat)"] = "heat became nan",
    ["if p.P.x > 4 then p.v = 3 end"] = "takes a vec3, not 3",
    ["if p.P.x > 4 then error(\"here\") end"] = "here",
    ["if p.P.x > 4 then local t = nil  p.heat = t.x end"] = "nil",
    ["p.instance = p.P.x / 3"] = "takes a whole number",
    ["p.heat = rapid.math.clamp(1, p.P.x, 2)"] = "is above hi",
  } do
    it("fails as one point at a time does: " .. body, function()
      local text = head .. ("  :points(\"k\", function(p)\n%s\nend) :solve {}"):format(body)
      local reported = scene.error(text, { threads = 1 })
      assert.equal(scene.error(text, { threads = 1, watch_traces = true }), reported)
      assert.truthy(reported:find(message, 1, true), reported)
    end)
  end

  it("reports the reason if it is rejected", function()
    for body, reason in pairs {
      ["for k = 1, frame.number do p.heat = p.heat + k end"] = "it has a loop whose steps are not known",
      ["local t = { p.heat } p.heat = t[1]"] = "it makes a table",
      ["while true do p.heat = 1 break end"] = "it has a loop",
    } do
      local _, _, none = both(head .. ("  :points(\"k\", function(p, frame)\n%s\nend) :solve {}"):format(body))
      assert.equal(1, #none)
      assert.truthy(none[1]:find(reason, 1, true), none[1])
      assert.truthy(none[1]:find("scene.lua:13", 1, true), none[1])
    end
  end)
end)

describe("math.sin", function()
  it("takes a string that is a number, as Lua's own does, and refuses others", function()
    local result = scene.run([[return rapid.create { points = two } :points("k", function(p)
      p.v = vec3(math.sin "0.5", math.cos(0.5), math.exp(0.5)) end) :solve {}]])
    assert.near(math.sin(0.5), result[2][1].v.x, 1e-7)
    assert.near(math.exp(0.5), result[2][1].v.z, 1e-7)
    assert.truthy(scene.error [[local x = math.sin(nil)]]:find("number expected, got nil", 1, true))
  end)
end)
