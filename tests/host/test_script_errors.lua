-- Errors while a script runs: reported in one line with file, line, node, point and frame. They never end Rapid itself.
local scene = require "testing.scene"

local at = " (point id 0, frame 2)"

describe("an error in a kernel", function()
  it("is reported with its own line, however it was raised", function()
    for body, expected in pairs {
      ["error 'too hot'"] = "too hot",
      ["error('too hot', 0)"] = "too hot",
      ["error({})"] = "the script raised an error with a table instead of a message",
      ["error(print)"] = "the script raised an error with a function instead of a message",
      ["error(vec3(0, 0, 0))"] = "the script raised an error with a cdata instead of a message",
      ["error()"] = "the script raised an error without a message",
      ["error(true)"] = "the script raised an error with a boolean instead of a message",
      ["assert(p.v.x > 1, 'too slow')"] = "too slow",
      ["local t = nil; t.x = 1"] = "attempt to index local 't' (a nil value)",
      ["local x = p.v.x .. {}"] = "attempt to concatenate a table value",
      ["local x = ('x'):rep(3) + 1"] = "attempt to perform arithmetic on a string value",
      ["wnid(p)"] = "attempt to call global 'wnid' (a nil value)",
      ["local x = frame.nubmer"] = 'the frame has no "nubmer"; it has number, time, dt and detail',
      ["local x = p:rand()"] = "p:rand needs the index of the random number, not nil",
      ["local x = p:rand(1, 'frame')"] = 'p:rand needs the frame or a number as the second argument, not "frame"',
    } do
      assert.equal('scene.lua:2: node "kernel": ' .. expected .. at, scene.kernel_error(body), body)
    end
  end)

  it("that calls a method which is not there is found before the first frame", function()
    assert.equal('scene.lua:2: node "kernel": p has no method "jion"; did you mean "join"?',
      scene.kernel_error "p:jion 'hot'")
    assert.equal('scene.lua:2: node "kernel": p has no method "explode"; it has join, leave, within, kill and rand',
      scene.kernel_error "if p.id > 5 then p:explode() end")
  end)

  it("inside a helper shows the helper's line", function()
    assert.equal('scene.lua:3: node "wind": attempt to perform arithmetic on a nil value' .. at, scene.error [[
local function push(p)
  -- a separate line
  return p.v * (nil + 1)
end
return rapid.create { points = two } :points("wind", function(p)
  p.v = push(p)
end) :solve {}]])
  end)

  it("inside pcall is handled by the script", function()
    local points = scene.kernel("if not pcall(function() error {} end) then p.v = vec3(0, 24, 0) end")
    assert.near({0, 2, 0}, points[1].P, 1e-6)
  end)

  it("of endless recursion ends the run with 1, not the program", function()
    local text = scene.kernel_text("deeper(p)", nil, "local function deeper(x) return 1 + deeper(x) end")
    local result = scene.command("run", text, "-f 1-3")
    assert.equal(1, result.status)
    assert.equal('scene.lua:1: node "kernel": stack overflow: a function calls itself endlessly' .. at .. "\n",
      result.stderr)
  end)

  it("of runaway memory ends the run with 1, and names the limit", function()
    for _, body in ipairs {
      "local t = {} for i = 1, 1e9 do t[i] = {} end",
      "local s = 'x' while true do s = s .. s end",
      "local s = ('x'):rep(1e9)",
    } do
      local result = scene.command("run", scene.kernel_text(body), "-f 1-3 --script-memory 32M --quiet")
      assert.equal(1, result.status, body)
      assert.equal('scene.lua:2: node "kernel": the script needs more than 32 MiB of Lua memory; ' ..
        "--script-memory sets the limit" .. at .. "\n", (result.stderr:gsub("scene.lua:1:", "scene.lua:2:")))
    end
  end)

  it("of runaway memory is not caught by the script", function()
    local text = scene.kernel_text [[
local ok = pcall(function() local t = {} for i = 1, 1e9 do t[i] = i end end)
if not ok then p.v = vec3(0, 24, 0) end]]
    local result = scene.command("run", text, "-f 1-3 --script-memory 32M --quiet")
    -- Compiled code does not know its line, so the node's is given.
    assert.equal('scene.lua:1: node "kernel": the script needs more than 32 MiB of Lua memory; ' ..
      "--script-memory sets the limit" .. at .. "\n", result.stderr)
    assert.equal(1, result.status)
  end)
end)

describe("a script that does not end", function()
  it("is ended after --script-timeout with its name, wherever it runs", function()
    for place, text in pairs {
      ["scene.lua: the graph's body"] = "while true do end",
      ["scene.lua: the graph's body "] = "local t = {} for i = 1, 40 do t = { t, t } end return rapid.create(t)",
      ['scene.lua:1: node "kernel"'] = scene.kernel_text "local x = 0 while true do x = x + 1 end",
      ['scene.lua:1: node "delete1"'] = "return rapid.create { points = two } " ..
        ":delete { where = function(p) while true do end end }",
      ["scene.lua:1: a parameter's function"] = "return rapid.create { points = two } " ..
        ":gravity { g = function() repeat until false end } :solve {}",
    } do
      local result = scene.command("run", text, "-f 1-3 --script-timeout 0.2")
      assert.equal(1, result.status)
      assert.equal(place:gsub(" $", "") .. ": the script ran for more than 0.2 s; --script-timeout sets the limit\n",
        result.stderr)
    end
  end)
end)

describe("a kernel that keeps something for other points", function()
  local keep = "; kernels run in parallel, in several Lua states: store the value in an attribute of the point, or " ..
    "compute it once for all points in a :detail"
  local field = 'assigns the field "%s" of a table that all points share'

  it("is refused before the first frame, with the line of the assignment", function()
    for body, case in pairs {
      ["count = count + 1"] = { "local count = 0", 'assigns the upvalue "count"' },
      ["total = p.id"] = { "", 'assigns the global "total"' },
      ["_G.total = p.id"] = { "", field:format "total" },
      ["box.n = p.id"] = { "local box = {}", field:format "n" },
      ["local b = box b.n = p.id"] = { "local box = {}", field:format "n" },
      ["box.deep.er = p.id"] = { "local box = { deep = {} }", field:format "er" },
      ["box[p.id] = 1"] = { "local box = {}", "assigns into a table that all points share" },
      ["box[1] = 1"] = { "local box = {}", "assigns into a table that all points share" },
      ["box[#box + 1] = p.P"] = { "local box = {}", "assigns into a table that all points share" },
      ["table.insert(box, p.P)"] = { "local box = {}", "changes a table that all points share by table.insert" },
      ["table.sort(box)"] = { "local box = {3, 1}", "changes a table that all points share by table.sort" },
      ["(p.id > 0 and box or { }).n = 1"] = { "local box = {}", field:format "n" },
      ["if p.id > 3 then box.n = 1 end"] = { "local box = {}", field:format "n" },
      ["bump(p)"] = { "local n = 0 local function bump() n = n + 1 end", 'assigns the upvalue "n"' },
      ["lib.bump(p)"] = { "local n = 0 local lib = { bump = function() n = n + 1 end }", 'assigns the upvalue "n"' },
      ["local f = bump f()"] = { "local n = 0 local function bump() n = n + 1 end", 'assigns the upvalue "n"' },
      ["local function inc() count = count + 1 end inc()"] = { "local count = 0", 'assigns the upvalue "count"' },
      ["pcall(bump)"] = { "local n = 0 local function bump() n = n + 1 end", 'assigns the upvalue "n"' },
      ["local b = get() b.n = 1"] = { "local box = {} local function get() return box end", field:format "n" },
      ["same(box).n = 1"] = { "local box = {} local function same(t) return t end", field:format "n" },
      ["for _, t in ipairs(list) do t.n = 1 end"] = { "local list = { {} }", field:format "n" },
      ["for _, t in pairs(list) do t.n = 1 end"] = { "local list = { {} }", field:format "n" },
      ["local _, t = next(list) t.n = 1"] = { "local list = { {} }", field:format "n" },
      ["local t = unpack(list) t.n = 1"] = { "local list = { {} }", field:format "n" },
      ["for _, f in ipairs(list) do f() end"] = { "local n = 0 local list = { function() --[[bump]] n = n + 1 end }",
                                                  'assigns the upvalue "n"' },
      ["box:bump()"] = { "local box = { bump = function(self) self.n = 1 end }", field:format "n" },
      ["object:bump()"] = {
        "local C = {} C.__index = C function C:bump() self.n = 1 end local object = setmetatable({}, C)",
        field:format "n" },
      ["local x = lazy.anything"] = {
        "local n = 0 local lazy = setmetatable({}, { __index = function() --[[bump]] n = n + 1 return n end })",
        'assigns the upvalue "n"' },
      ["local x = lazy + 1"] = {
        "local n = 0 local lazy = setmetatable({}, { __add = function() --[[bump]] n = n + 1 return n end })",
        'assigns the upvalue "n"' },
      ["local function set(t) t.n = 1 end set(box)"] = { "local box = {}", field:format "n" },
      ["table.move({ 1 }, 1, 1, 1, box)"] = { "local box = {}", "changes a table that all points share by table.move" },
      ["p.n = later()"] = { "local later = coroutine.wrap(function() end)",
                            "resumes a coroutine or an iterator that was made outside it" },
      ["p.n = coroutine.resume(thread)"] = { "local thread = coroutine.create(function() end)",
                                             "resumes a coroutine or an iterator that was made outside it" },
      ["local word = words()"] = { "local words = ('a b'):gmatch '%a'",
                                   "resumes a coroutine or an iterator that was made outside it" },
    } do
      local before, what = case[1], case[2]
      local line = before:find "bump" and 1 or 2
      assert.equal(('scene.lua:%d: node "kernel": the kernel %s%s'):format(line, what, keep),
        scene.kernel_error(body, nil, before), body)
    end
  end)

  it("is not one that makes tables of its own", function()
    scene.kernel([[
local t, sum = { 3, 1 }, 0
for k, v in pairs(box) do t[k] = v end
for _, v in ipairs(box.list) do t[#t + 1] = v end
local function add(into, v) into.sum = (into.sum or 0) + v sum = sum + v end
add(t, box.n) table.insert(t, 1, 2) table.sort(t) table.remove(t)
local copied = copy(box) copied.n = 5
local own = coroutine.wrap(function(x) t.last = x coroutine.yield(x) end) own(1)
assert(t.sum == 7 and sum == 7 and copied.n == 5 and box.n == 7)]], nil,
      "local function copy(t) local c = {} for k, v in pairs(t) do c[k] = v end return c end " ..
      "local box = { n = 7, list = { 1, 2 } }")
  end)

  it("in a parameter of a Lua node is refused, too", function()
    scene.folder:write("keeps.lua", [[
return require "rapid".node {
  name = "keeps", doc = "Keeps.", params = { all = { "floats", default = { 1, 2 }, doc = "numbers" } },
  points = function(p, frame, params)
    params.all[1] = p.id
  end,
}]])
    assert.equal('keeps.lua:4: node "keeps1": the kernel assigns into a table that all points share' .. keep,
      scene.error "return rapid.create { points = two } :keeps {} :solve {}")
  end)

  it("is refused by rapid check", function()
    local result = scene.command("check", scene.kernel_text("n = n + 1", nil, "local n = 0"))
    assert.equal(2, result.status)
    assert.equal('scene.lua:2: node "kernel": the kernel assigns the upvalue "n"' .. keep .. "\n", result.stderr)
  end)

  it("is refused in a test of a point too", function()
    assert.equal('scene.lua:1: node "delete1": the kernel assigns the upvalue "n"' .. keep, scene.error [[
local n = 0 return rapid.create { points = two } :delete { where = function() n = n + 1 return n > 1 end }]])
  end)
end)

describe("a graph that is not the same each time it runs", function()
  it("is refused when a second state runs it", function()
    -- Graph code cannot reach values that differ between states, but a file can change between them.
    scene.folder:write("twice.lua", "return 1")
    local result = scene.run([[
local height = require "twice"
return rapid.create { points = rapid.points.grid { size = {30, 30, 30}, spacing = 1 } }
  :points("k", function(p) p.v = vec3(0, height, 0) end) :solve {}]], { threads = 4 })
    assert.near({0, 1, 0}, result[3]:max "v", 0)
  end)
end)
