-- Wrong kernels: the message for each, with node, file and line. If the kernel ran until the fault, also the point and
-- the frame.
local scene = require "testing.scene"

local shared_by_all = "; kernels run in parallel, in several Lua states: store the value in an attribute of the " ..
  "point, or compute it once for all points in a :detail"
local read_only = "a component of a vector or a field of the frame can't be assigned; make a new vec3: p.v = " ..
  "vec3(1, p.v.y, p.v.z)"
local columns = "heat = {1, 2}, count = {1, 2}"

-- Found before the first frame, so without point and frame.
local before_the_first_frame = {
  ["p.id = 3"] = "the kernel assigns p.id, which is read-only",
  ["p.dt = 3"] = "the kernel assigns p.dt, which is read-only",
  ["p.index = 3"] = "the kernel assigns p.index, which is read-only",
  ["p:jion 'hot'"] = 'p has no method "jion"; did you mean "join"?',
  ["p:explode()"] = 'p has no method "explode"; it has join, leave, within, kill and rand',
  ["p:join(p.heat > 0 and 'a' or 'b')"] =
    "the kernel joins or leaves a group with a computed name; write the name as a constant: p:join \"old\"",
  ["total = p.heat"] = 'the kernel assigns the global "total"' .. shared_by_all,
  ["shared.n = p.heat"] = 'the kernel assigns the field "n" of a table that all points share' .. shared_by_all,
}

-- Found by the plan.
local by_the_plan = {
  ["p.haet = 1"] = 'no attribute "haet"; did you mean "heat"? (or add :attribute{ haet = 0 } before it)',
  ["p.v = p.velocity"] = 'no attribute "velocity"; the velocity of points is v',
}

-- Found at a point.
local at_a_point = {
  ["p.heat = nil"] = 'attribute "heat" takes a number, not nil',
  ["p.v = vec3(1, 2, 3) * frame"] =
    "can't compute vec3(1, 2, 3) * the frame (frame.time is a number); the other must be a number or a vec3",
  ["p.heat = 'hot'"] = 'attribute "heat" takes a number, not "hot"',
  ["p.heat = p.P"] = 'attribute "heat" takes a number, not vec3(0, 1, 0)',
  ["p.heat = {}"] = 'attribute "heat" takes a number, not a table',
  ["p.heat = p.heat > 0"] = 'attribute "heat" takes a number, not true',
  ["p.heat = math.sqrt(-p.heat)"] = "heat became nan; a float must be between -3.4e38 and 3.4e38",
  ["p.heat = 1 / (p.heat - 1)"] = "heat became inf; a float must be between -3.4e38 and 3.4e38",
  ["p.heat = 10 ^ 39"] = "heat became 1e+39; a float must be between -3.4e38 and 3.4e38",
  ["p.v = 1"] = 'attribute "v" takes a vec3, not 1',
  ["p.v = {0, 1, 0}"] = 'attribute "v" takes a vec3, not a table; vec3(x, y, z) makes one',
  ["p.v = p.P / 0"] = "v became vec3(nan, inf, nan); a float must be between -3.4e38 and 3.4e38",
  ["p.v = p.v + 1"] = "can't compute vec3(0, 0, 0) + 1; both must be a vec3",
  ["p.v = p.v * nil"] = "can't compute vec3(0, 0, 0) * nil; the other must be a number or a vec3",
  ["p.v.x = 1"] = read_only,
  ["p.heat = p.P.w"] = 'a vec3 has no "w"; it has x, y, z, dot, cross, length, normalized and lerp',
  ["p.v = p.P:corss(p.v)"] = 'a vec3 has no "corss"; it has x, y, z, dot, cross, length, normalized and lerp',
  ["p.v = p.P:cross(2)"] = "v:cross(w) needs a vec3, not 2",
  ["p.heat = p.P.length()"] = "v:length() needs a vec3, not nil",
  ["p.v = vec3(1, 2)"] = "vec3 needs three numbers, vec3(0, 1, 0); one is nil",
  ["if p.P > p.v then p.heat = 1 end"] = "vec3 values have no order; compare their lengths or components",
  ["p.heat = rapid.math.clmap(p.heat, 0, 1)"] = 'rapid.math has no "clmap"; did you mean "clamp"?',
  ["p.heat = rapid.math.clamp(p.heat, 2, 1)"] = "clamp(x, lo, hi): lo = 2 is above hi = 1",
  ["p.heat = rapid.math.noise(p.heat)"] = "noise(P, time, octaves, seed) needs a vec3 P, not 1",
  ["p.heat = p + 1"] = "p is the point; use one of its attributes, such as p.v",
  ["p.heat = 2 * p"] = "p is the point; use one of its attributes, such as p.v",
  ["p.heat = p()"] = "p is the point; use one of its attributes, such as p.v",
  ["p.v = vec3(3e38, 3.5e38, 0)"] =
    "v became vec3(3e+38, 3.5e+38, 0); a float must be between -3.4e38 and 3.4e38",
  ["p.heat = p:rand()"] = "p:rand needs the index of the random number, not nil",
  ["p.heat = frame.nubmer"] = 'the frame has no "nubmer"; it has number, time, dt and detail',
  ["frame.number = 3"] = read_only,
  ["p.heat = frame.detail.total"] =
    'no detail value "total"; set it in a :detail: points.detail.total = 0',
  ["p.heat = p['he' .. 'at'] + p['co' .. 'unt']"] =
    'no attribute "count" here; declare a computed name with reads = { "count" }, or also write it as a constant ' ..
    "(the kernel names dt, heat, id, index)",
  ["p['he' .. 'at'] = 1"] =
    'no attribute "heat" here; add :attribute{ heat = 0 } before it, or declare a computed name with writes = { ' ..
      '"heat" }',
  ["local t; t.x = p.heat"] = "attempt to index local 't' (a nil value)",
  ["p.heat = wnid(p)"] = "attempt to call global 'wnid' (a nil value)",
  ["p.heat = p.heat .. {}"] = "attempt to concatenate a table value",
  ["error 'too hot'"] = "too hot",
  ["error { heat = p.heat }"] = "the script raised an error with a table instead of a message",
  ["assert(p.heat > 5, 'too cold')"] = "too cold",
}

local function check_all(kernels, where, line)
  local count = 0
  for body, expected in pairs(kernels) do
    count = count + 1
    assert.equal(('scene.lua:%d: node "kernel": %s%s'):format(line or 2, expected, where),
      (scene.kernel_error(body, columns, "local shared = {}"):gsub("%-nan", "nan"):gsub("; P = .*%)$", ")")), body)
  end
  return count
end

describe("a wrong kernel", function()
  local static, dynamic = 0, 0

  it("that its code reveals is reported before the first frame, with node, file and line", function()
    static = check_all(before_the_first_frame, "") + check_all(by_the_plan, "")
  end)

  it("is reported with node, file, line, point and frame while it runs", function()
    dynamic = check_all(at_a_point, " (point id 0, frame 2)")
  end)

  it("is reported in at least thirty kinds", function()
    assert.truthy(static + dynamic >= 30, static + dynamic)
  end)

  it("is reported with the same point, whichever thread fails first", function()
    local text = [[
return rapid.create { points = rapid.points.grid { size = {30, 30, 30}, spacing = 1 } }
  :points("kernel", function(p)
    if p.id % 5000 == 4711 then p.v = p.v / 0 end
  end) :solve {}]]
    for _, threads in ipairs { 1, 4 } do
      assert.equal('scene.lua:3: node "kernel": v became vec3(nan, nan, nan); a float must be between -3.4e38 ' ..
        "and 3.4e38 (point id 4711, frame 2; P = {-9.5, -7.5, -13.5}, v = {0, 0, 0})",
        (scene.error(text, { threads = threads }):gsub("%-nan", "nan")))
    end
  end)

  it("is refused where it is a function of Lua's own", function()
    for _, call in ipairs { ":points('k', math.sin)", ":action('k', string.rep)", ":delete { where = math.floor }" } do
      local message = scene.error("return rapid.create { points = two } " .. call .. " :solve {}")
      assert.match('^scene.lua:1: node "%w+": the kernel is a function of Lua\'s library; write a function in the ' ..
        "scene that calls it$", message)
    end
  end)

  it("leads to its own line through a helper, a module and a Lua node", function()
    scene.folder:write("air.lua", "local air = {}\nfunction air.push(p)\n  return p.v + p.heat\nend\nreturn air")
    scene.folder:write("blown.lua", [[
local air = require "air"
return require "rapid".node {
  name = "blown", doc = "Is blown.",
  points = function(p)
    p.v = air.push(p)
  end,
}]])
    local chain = "return rapid.create { points = two } :attribute { heat = 1 } %s :solve {}"
    local message = "air.lua:3: node \"%s\": can't compute vec3(0, 0, 0) + 1; both must be a vec3 (point id 0, frame 2)"
    assert.equal(message:format "k", scene.error("local air = require 'air'\n" ..
      chain:format ":points('k', function(p) p.v = air.push(p) end)"))
    assert.equal(message:format "blown1", scene.error(chain:format ":blown {}"))
  end)
end)
