-- Attempts to escape the sandbox. Each ends in an error with file and line, and has no effect.
--
-- An attempt is a piece of graph code that raises no error if it works. It is tried in every place that runs graph
-- code.
local places = require "tests.script_places"
local scene = require "testing.scene"

local bytecode = ("%q"):format(string.dump(function() return 1 end)):gsub("\n", "n")

-- Files next to the graph.
local files = {
  module = "\n%s",
  node = "return require 'rapid'.node { name = 'guest', doc = 'A guest.', points = function(p)\n%s\nend }",
}

-- Returns the message of a scene that must fail, without its position, and the position. If a body has filled the
-- stack, LuaJIT has no room left to report the line.
local function refused(text)
  local message = scene.error(text, { frames = {1, 2} })
  local place = message:match "^[%w_]+%.lua:%d+" or message:match "^scene%.lua: stack overflow: a function calls"
  assert(place, "no file and line: " .. message)
  return (message:gsub("^[%w_]+%.lua:?%d*: ", ""):gsub('^node ".-": ', ""):gsub(" %([^()]*frame %d%)$", "")), place
end

local function nothing(name) return ("attempt to index global '%s' (a nil value)"):format(name) end
local function no_call(name) return ("attempt to call global '%s' (a nil value)"):format(name) end
local function no_field(name) return ("attempt to call field '%s' (a nil value)"):format(name) end

-- Names that exist in no place.
local absent = {
  ["files by io.open"] = { "io.open('escaped', 'w')", nothing "io" },
  ["files by io.lines"] = { "for line in io.lines '/etc/passwd' do print(line) end", nothing "io" },
  ["processes by io.popen"] = { "io.popen 'touch escaped'", nothing "io" },
  ["processes by os.execute"] = { "os.execute 'touch escaped'", nothing "os" },
  ["the environment by os.getenv"] = { "os.getenv 'HOME'", nothing "os" },
  ["the end of the program by os.exit"] = { "os.exit(0)", nothing "os" },
  ["C by ffi"] = { "ffi.C.system 'touch escaped'", nothing "ffi" },
  ["the registry by debug"] = { "debug.getregistry()", nothing "debug" },
  ["hooks by debug"] = { "debug.sethook(print, 'l')", nothing "debug" },
  ["upvalues of Rapid by debug"] = { "debug.getupvalue(rapid.create, 1)", nothing "debug" },
  ["metatables by debug"] = { "debug.setmetatable(1, {})", nothing "debug" },
  ["debug by an error handler"] = { "xpcall(error, debug.traceback)", nothing "debug" },
  ["modules of Lua by package.loaded"] = { "package.loaded.io.open 'x'", nothing "package" },
  ["C by package.loadlib"] = { "package.loadlib('libc.so.6', 'system')", nothing "package" },
  ["the trace compiler by jit"] = { "jit.off()", nothing "jit" },
  ["programs by dofile"] = { "dofile '/etc/passwd'", no_call "dofile" },
  ["programs by loadfile"] = { "loadfile '/etc/passwd'", no_call "loadfile" },
  ["the environment of others by getfenv"] = { "getfenv(0).io.open 'x'", no_call "getfenv" },
  ["an environment by setfenv"] = { "setfenv(1, {})", no_call "setfenv" },
  ["tables behind their metatables by rawset"] = { "rawset(rapid, 'create', print)", no_call "rawset" },
  ["tables behind their metatables by rawget"] = { "rawget(rapid, 'create')", no_call "rawget" },
  ["finalizers by newproxy"] = { "newproxy(true)", no_call "newproxy" },
  ["the collector by collectgarbage"] = { "collectgarbage 'stop'", no_call "collectgarbage" },
  ["bytecode by string.dump"] = { "string.dump(function() end)", no_field "dump" },
  ["bytecode by a method of strings"] = { "local s = 'x' s.dump(print)", no_field "dump" },
  ["chance by math.random"] = { "math.random()", no_field "random" },
}

-- Names that exist but refuse the use.
local firm = {
  ["the metatable of strings"] = { "getmetatable('').__index.rep = print", "attempt to index a nil value" },
  ["the methods of strings"] = { "local s = 'x' s.rep = print", "attempt to index local 's' (a string value)" },
  ["the metatable of rapid"] = { "getmetatable(rapid).__index = print", "attempt to index a boolean value" },
  ["a metatable for rapid"] = { "setmetatable(rapid, {})", "cannot change a protected metatable" },
  ["the metatable of vec3"] = { "getmetatable(vec3(0, 0, 0)).__add = print", "attempt to index a nil value" },
  ["the metatable of points"] = { "getmetatable(two).__gc = print", "attempt to index a nil value" },
  ["a metatable for a function"] = { "setmetatable(print, {})", "setmetatable needs a table" },
  ["what lies behind a vec3"] = { "local v = vec3(1, 2, 3) print(v[3])", 'a vec3 has no "3"' },
  ["writing behind a vec3"] = { "local v = vec3(1, 2, 3) v[3] = 4", 'a vec3 has no "3"' },
  ["a pointer by arithmetic"] = { "local v = vec3(1, 2, 3) + 8", "can't compute vec3(1, 2, 3) + 8" },
  ["a type by a value"] = { "local v = vec3(1, 2, 3) v 'int*'", "a vec3 is not a function" },
  ["memory by a number of 64 bits"] = { "print((0x7fff0000LL)[0])", "cannot be indexed" },
  ["addresses by tostring"] = { "error(tostring(print) .. tostring {}, 0)", "functiontable" },
  ["addresses by format"] = { "print(('%p'):format(print))", "%p is not available" },
  ["addresses by concatenation"] = { "print(vec3(0, 0, 0) .. {})", "attempt to concatenate a table" },
  ["addresses by a message"] = { "print(vec3(0, 0, 0)[{}])", 'a vec3 has no "a table"' },
  ["addresses by the message of rapid"] = { "print(rapid[print])", 'rapid has no "a function"' },
  ["an error object that does something"] = {
    "error(setmetatable({}, { __tostring = function() return 'seen' end }))",
    "the script raised an error with a table instead of a message" },
  ["depth without end"] = { "local function f() return 1 + f() end f()", "stack overflow" },
  ["depth without end in C"] = { "local function f() return (('x'):gsub('x', f)) end f()", "overflow" },
  ["depth without end in coroutines"] = { "local function f() coroutine.wrap(f)() end f()", "overflow" },
  ["depth without end in a pattern"] = {
    "(('x'):rep(300000)):match(('x?'):rep(300000) .. ('x'):rep(300000))", "pattern too complex" },
}

-- Uses that are legal only in the body of a graph or a module.
local loading = {
  ["a library as a module"] = { "require 'ffi'", 'no module "ffi"' },
  ["inner modules of the compiler"] = { "require 'jit.util'", 'no module "jit.util"' },
  ["modules of Rapid"] = { "require 'sandbox'", 'no module "sandbox"' },
  ["a folder above"] = { "require '../scene'", "the name of a module must consist of letters" },
  ["a file anywhere"] = { "require '/etc/passwd'", "the name of a module must consist of letters" },
  ["bytecode by load"] = { ("assert(load(%s))()"):format(bytecode), "bytecode can't be loaded" },
  ["bytecode by loadstring"] = { ("assert(loadstring(%s))()"):format(bytecode), "bytecode can't be loaded" },
  ["bytecode behind a comment"] = { ("assert(load('#\\n' .. %s))()"):format(bytecode), "bytecode" },
  ["bytecode by a reader"] = {
    ("assert(load(function() return %s end))()"):format(bytecode), "load needs a string, not a function" },
}

local function each(attempts, f)
  local names = {}
  for name in pairs(attempts) do names[#names + 1] = name end
  table.sort(names)
  for _, name in ipairs(names) do f(name, attempts[name][1], attempts[name][2]) end
end

-- A scene with legal uses of every library, in all the places.
local function nothing_is_left()
  local listed = table.concat(scene.folder:list(), " ")
  assert.falsy(listed:find "escaped", listed)
  local result = scene.run([[
local words = {}
for name, value in pairs { b = 2, a = 1 } do table.insert(words, ("%s%d"):format(name, value)) end
assert(table.concat(words) == "a1b2" and ("x"):rep(2) == "xx" and tostring(vec3(1, 2, 3) + vec3(1, 1, 1))
  == "vec3(2, 3, 4)" and math.floor(2.5) == 2 and rapid.math.clamp(3, 0, 1) == 1 and escaped == nil)
return rapid.create { points = two } :points("k", function(p) p.v = vec3(#("x"):rep(24), 0, 0) end) :solve {}]])
  assert.near({2, 1, 0}, result[2][2].P, 1e-6)
end

describe("a way out", function()
  it("by a name that does not exist is an error everywhere, with file and line", function()
    local count = 0
    each(absent, function(name, code, expected)
      count = count + 1
      for where, text in pairs(places) do
        local message, place = refused(text:format(code))
        -- The existing names follow.
        assert.equal(expected, message:sub(1, #expected), where .. ": " .. name)
        assert.equal("scene.lua:2", place, where .. ": " .. name)
      end
    end)
    assert.truthy(count >= 26)
    nothing_is_left()
  end)

  it("by a name that exists is an error everywhere, with file and line", function()
    local count = 0
    each(firm, function(name, code, expected)
      count = count + 1
      for where, text in pairs(places) do
        -- A kernel's assignment to shared values is refused before it runs.
        local before = (where ~= "body" and where ~= "parameter") and "that all points share" or expected
        local message, place = refused(text:format(code))
        assert.truthy(message:find(expected, 1, true) or message:find(before, 1, true), where .. ": " .. name .. ": " ..
          message)
        assert.truthy(place == "scene.lua:2" or expected:find "overflow", where .. ": " .. name)
      end
    end)
    assert.truthy(count >= 22)
    nothing_is_left()
  end)

  it("by loading is an error where graph code loads, and wherever it runs", function()
    local count = 0
    each(loading, function(name, code, expected)
      count = count + 1
      for _, where in ipairs { "body", "parameter", "detail" } do
        local message, place = refused(places[where]:format(code))
        assert.truthy(message:find(expected, 1, true), where .. ": " .. name .. ": " .. message)
        assert.equal("scene.lua:2", place, name)
      end
      for _, where in ipairs { "kernel", "action", "test" } do
        local message, place = refused(places[where]:format(code))
        assert.truthy(message:find "^a kernel can't call %l+; ", where .. ": " .. name .. ": " .. message)
        assert.equal("scene.lua:2", place, name)
      end
    end)
    assert.truthy(count >= 9)
    nothing_is_left()
  end)

  it("fails in a module or a node next to the graph, too", function()
    for _, attempts in ipairs { absent, firm } do
      each(attempts, function(name, code, expected)
        scene.folder:write("helper.lua", files.module:format(code:gsub("rapid", "require('rapid')"):gsub("two",
          "require('rapid').points.from { P = {{0, 0, 0}} }")))
        local message, place = refused "local helper = require 'helper' return rapid.create {}"
        if expected:find "rapid" then expected = "has no" end
        assert.truthy(message:find(expected, 1, true), name .. ": " .. message)
        assert.truthy(place == "helper.lua:2" or expected:find "overflow", name .. ": " .. place)
        if not code:find "rapid" and not code:find "two" then
          scene.folder:write("guest.lua", files.node:format(code))
          message, place = refused "return rapid.create { points = two } :guest {} :solve {}"
          assert.truthy(message:find(expected, 1, true), name .. ": " .. message)
          assert.truthy(place == "guest.lua:2" or expected:find "overflow", name .. ": " .. place)
        end
      end)
    end
    for _, file in ipairs { "coded.lua", "escapee.lua" } do
      scene.folder:write(file, string.dump(function() return 1 end))
    end
    assert.match("bytecode can't be loaded", scene.error "local coded = require 'coded'")
    assert.match("bytecode can't be loaded", scene.error "return rapid.create {} :escapee {}")
    scene.folder:write("coded_scene.lua", string.dump(function() return 1 end))
    local ok, message = pcall(require("rapid").run, scene.folder:file "coded_scene.lua", { frames = {1, 1} })
    assert.falsy(ok)
    assert.match("bytecode can't be loaded", message)
    nothing_is_left()
  end)

  it("by making things in a kernel is an error", function()
    for code, expected in pairs {
      ["rapid.create {}"] = ":create is called while a frame runs; make nodes in the graph's body",
      ["rapid.mesh.box {}"] = "a kernel can't call rapid.mesh.box; make it once outside",
      ["rapid.translate(1, 2, 3)"] = "a kernel can't call rapid.translate; make it once outside",
      ["rapid.param('x', 1)"] = "a kernel can't call rapid.param; call it once outside",
      ["rapid.node { name = 'x' }"] = "rapid.node is called while a frame runs; call it in the file of the node",
      ["load 'escaped = 1' ()"] = "a kernel can't call load; its result can't be checked there",
      ["require 'helper'"] = "a kernel can't call require; call it first in the graph's body",
    } do
      assert.equal(expected, (refused(places.kernel:format(code))))
    end
    assert.match(":create is called while a frame runs", (refused(places.parameter:format "rapid.create {}")))
    nothing_is_left()
  end)
end)

-- Objects that a function has received, and their methods, stored beyond their lifetime. They are stored in a
-- coroutine, where the bytecode analysis does not find them.
describe("a value kept for later", function()
  local keep = [[
local keeper = coroutine.wrap(function(kept) while true do kept = coroutine.yield(kept) or kept end end)
local held = { keeper } ballast = {} for i = 1, 20000 do ballast[i] = i end
]]
  -- Uses, in frame 3, a value that an earlier node stored in frame 2.
  local function message_of(chain, use)
    local message = scene.error((keep .. [[
return rapid.create { points = two } :attribute { heat = 0 } %s
  :drag { linear = function(frame) if frame.number > 2 then local kept = held[1]() %s end return 1 end }
  :solve {} ]]):format(chain, use), { frames = {1, 3} })
    return message:match '^scene.lua:4: node "drag1": (.*) %(frame 3%)$'
  end

  it("by a kernel is of no use", function()
    local kernel = ":points('k', function(p) local box = { keeper } box[1](%s) p:leave 'g' p:kill() end)"
    for what, use in pairs {
      p = "kept.heat = 1", ["p "] = "print(kept.P)", ["p.join"] = "kept(nil, 'g')", ["p.leave"] = "kept(nil, 'g')",
      ["p.within"] = "kept(nil, 'g')", ["p.kill"] = "kept()", ["p.rand"] = "kept(nil, 1)",
    } do
      assert.equal("a point can't be used outside its kernel", message_of(kernel:format(what), use), what)
    end
    local action = ":action('a', function(p, step) local box = { keeper } box[1](%s) end)"
    assert.equal("a point can't be used outside its kernel", message_of(action:format "step", "print(kept.time)"))
    assert.equal("a point can't be used outside its kernel", message_of(action:format "p", "print(kept.v)"))
  end)

  it("by a :detail function is of no use", function()
    local detail = ":detail('d', function(points) points[1].heat = 1 points[1]:join 'g' local box = { keeper } " ..
      "if frame == nil then box[1](%s) end end)"
    for what, use in pairs {
      ["points[1]"] = "kept.heat = 2", ["points[2]"] = "print(kept.heat)", ["points[1] "] = "kept:join 'g'",
      ["points[1]  "] = "kept:kill()", points = "kept[1].heat = 2", ["points "] = "kept:add { heat = 1 }",
      ["points  "] = "kept:sort 'heat'", ["points   "] = "print(kept:sum 'heat')",
      ["points    "] = "kept:neighbours(1, 1)",
    } do
      assert.equal("points can't be used outside the :detail function that received them",
        message_of(detail:format(what), use), what .. use)
    end
  end)

  it("is no way for one :detail function into the points of another", function()
    local message = scene.error(keep .. [[
return rapid.create { points = rapid.points.grid { size = {3, 1, 1}, spacing = 0.1 } } :attribute { heat = 0 }
  :detail("a", function(points) local box = { keeper } box[1](points) points[300].heat = 1 end)
  :delete { where = function(p) return p.id > 1 end }
  :detail("b", function() local box = { keeper } box[1]()[300].heat = 1 end) :solve {}]], { frames = {1, 2} })
    assert.match("points can't be used outside the :detail function that received them", message)
  end)
end)

describe("methods", function()
  it("of points take no forged point, nor a forged set", function()
    for code, expected in pairs {
      ["points[1].join({ rapid_place = 1e8, rapid_serial = 1 }, 'g')"] =
        "p:join must be called with a colon, not a dot",
      ["points[1].leave(vec3(1, 2, 3), 'g')"] = "p:leave must be called with a colon, not a dot",
      ["points[1].within({ rapid_place = -1e8 }, 'P')"] = "p:within must be called with a colon, not a dot",
      ["points[1].rand({ rapid_place = 1e8 }, 1)"] = "p:rand must be called with a colon, not a dot",
      ["points[1].kill {}"] = "p:kill must be called with a colon, not a dot",
      ["points.sum({}, 'P')"] = "points:sum must be called with a colon, not a dot",
      ["points.neighbours(points[1], 1, 1)"] = "points:neighbours must be called with a colon, not a dot",
      ["points[1].rapid_place = 1e8"] = "a component of a vector or a field of the frame can't be assigned",
      ["points.rapid_serial = 7"] = "a component of a vector or a field of the frame can't be assigned",
      ["points[1e9].P = vec3(0, 0, 0)"] = "points: there is no point 1000000000; the set has 1 to 2",
      ["points[1.5].P = vec3(0, 0, 0)"] = "points: there is no point 1.5; the set has 1 to 2",
      ["points[0/0].P = vec3(0, 0, 0)"] = "there is no point",
    } do
      local message = refused(places.detail:format(code))
      assert.truthy(message:find(expected, 1, true), message)
    end
  end)

  it("of shapes take no forged shape", function()
    for code, expected in pairs {
      ["ball.distance({}, p.P)"] = "shape:distance(P) must be called with a colon, not a dot",
      ["ball.distance(p, p.P)"] = "shape:distance(P) must be called with a colon, not a dot",
      ["ball.gradient(two, p.P)"] = "shape:gradient(P) must be called with a colon, not a dot",
      ["ball:distance(1)"] = "shape:distance(P) needs a vec3, not 1",
    } do
      local text = "local ball = rapid.shape.sphere {} " .. places.kernel:format("local _ = " .. code)
      assert.equal(expected, (refused(text)))
    end
  end)

  it("of tables write into nothing of Rapid", function()
    for code in pairs {
      ["table.insert(frame.detail, 1)"] = 1, ["table.insert(p, 1)"] = 1, ["table.insert(frame, 1)"] = 1,
      ["table.sort(frame.detail)"] = 1,
    } do
      assert.match("bad argument #1 to '%l+' %(table expected, got %l+%)", (refused(places.kernel:format(code))))
    end
  end)
end)

describe("a library", function()
  it("that a graph changes is another one in the next run, and in a kernel it is not changed at all", function()
    scene.run [[
string.rep, table.insert, math.floor, _G.pairs = print, print, print, print
string.escaped, escaped, rapid.math.clamp = 1, 1, nil
return rapid.create { points = two } :solve {}]]
    nothing_is_left()
    for _, code in ipairs { "string.rep = print", "math.floor = nil", "_G.pairs = nil", "rapid.create = print",
                            "table.insert(math, 1)", "getmetatable(_G or {}).x = 1" } do
      local message = refused(places.kernel:format(code))
      assert.truthy(message:find "that all points share" or message:find "attempt to index", message)
    end
  end)
end)

describe("a bomb", function()
  it("of memory ends the run with 1 and the name of the limit, in every place", function()
    for where, text in pairs(places) do
      for _, code in ipairs { "local t = {} for i = 1, 1e9 do t[i] = { i } end", "print(#('x'):rep(1e9))" } do
        local result = scene.command("run", text:format(code), "-f 1-3 --script-memory 32M --quiet")
        -- Functions of the frame are called for the first time before that.
        assert.equal((where == "body" or where == "parameter") and 2 or 1, result.status, where)
        -- If a body has filled the memory, the line is unknown.
        local place = where == "body" and "^scene.lua:[%d: ]+" or "^scene.lua:%d+: "
        assert.truthy(result.stderr:find(place .. ".*the script needs more than 32 MiB of Lua memory; " ..
          "%-%-script%-memory sets the limit"), where .. ": " .. result.stderr)
      end
    end
  end)

  it("of time ends the run with 1 and its name, in every place", function()
    local names = {
      body = "scene.lua: the graph's body", kernel = 'scene.lua:1: node "k"', test = 'scene.lua:1: node "delete1"',
      action = 'scene.lua:1: node "a"', detail = 'scene.lua:1: node "d"',
      parameter = "scene.lua:1: a parameter's function",
    }
    local loops = { body = "while true do pcall(error) end", detail = "repeat until false",
                    kernel = "(('a'):rep(40)):find(('a-'):rep(40) .. 'b')",
                    action = "while true do coroutine.wrap(function() end)() end" }
    for where, text in pairs(places) do
      local result = scene.command("run", text:format(loops[where] or "while true do end"),
        "-f 1-3 --script-timeout 0.2")
      assert.equal(1, result.status)
      assert.equal(names[where] .. ": the script ran for more than 0.2 s; --script-timeout sets the limit\n",
        result.stderr)
    end
  end)
end)
