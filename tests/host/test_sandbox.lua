-- Names and operations that graph code cannot reach, in the body of a graph and in kernels, and determinism.
local scene = require "testing.scene"

-- Runs a statement in the body and in a kernel; returns the two messages, without position, or nil if it succeeded.
local function try(statement)
  local function run(text)
    local ok, message = pcall(scene.run, text, { frames = {2, 2} })
    if ok then return nil end
    return (message:gsub("^.-scene%.lua:%d+: ", ""):gsub('^node "%w+": ', ""):gsub(" %(point.-%)$", ""))
  end
  return run(statement .. "\nreturn rapid.create { points = two } :solve {}"),
    run(("return rapid.create { points = two } :points('k', function(p, frame) %s end) :solve {}"):format(statement))
end

-- The value of an expression of graph code, as text.
local function text_of(expression, before)
  local message = scene.error(("%s error(%s, 0)"):format(before or "", expression))
  return (message:gsub("^scene%.lua:%d+: ", ""))
end

describe("graph code", function()
  it("finds nothing that leads out of it", function()
    for _, name in ipairs {
      "io", "os", "debug", "ffi", "jit", "package", "module", "dofile", "loadfile", "rawset", "rawget", "rawlen",
      "setfenv", "getfenv", "newproxy", "collectgarbage", "gcinfo", "arg", "string.dump", "('').dump", "math.random",
      "math.randomseed", "getmetatable('')", "getmetatable(two)", "getmetatable(vec3(0, 0, 0))",
      "getmetatable(print)", "getmetatable(1)", "_G.io", "_G._G.debug", "package and package.loaded", "table.foreach",
      "bit.ffi", "coroutine.debug",
    } do
      local in_body, in_kernel = try(("local found = %s if found ~= nil then error('found', 0) end"):format(name))
      assert.is_nil(in_body, name)
      assert.is_nil(in_kernel, name)
    end
  end)

  it("can only load modules next to the graph", function()
    for _, name in ipairs {
      "ffi", "io", "os", "debug", "jit", "jit.util", "jit.vmdef", "package", "string", "bytecode", "kernel", "sandbox",
      "host", "socket", "posix", "lfs", "testing.command", "nodes.lift",
    } do
      local message = assert(try(("require %q"):format(name)), name)
      assert.equal(("no module %q; looked for /"):format(name), message:sub(1, #name + 26))
    end
    for _, name in ipairs { "/etc/passwd", "../scene", "..", "", "a/b", "x\0y", "~" } do
      local message = assert(try(("require %q"):format(name)), name)
      assert.truthy(message:find("looked for nothing, because the name of a module must consist of letters, " ..
        "digits, _ and dots", 1, true),
        message)
    end
  end)

  it("loads text alone, and into its own environment", function()
    local code = ("%q"):format(string.dump(function() return 1 end))
    assert.equal("bytecode can't be loaded", (try(("assert(load(%s))"):format(code))))
    assert.equal("bytecode can't be loaded", (try(("assert(loadstring(%s))"):format(code))))
    -- After a prefix that is legal at the start of a file.
    assert.truthy(try(("assert(load('#!\\n' .. %s))"):format(code)):find "bytecode")
    assert.truthy(try(("assert(load('\\239\\187\\191' .. %s))"):format(code)):find "bytecode")
    assert.equal("load needs a string, not a function", (try "assert(load(function() return '' end))"))
    assert.is_nil((try "assert(load 'return io == nil and vec3 ~= nil and debug == nil')()"))
    assert.equal("found", text_of("load('return word')()", "word = 'found'"))
  end)

  it("can't pass for code of Rapid by a name", function()
    assert.equal('scene.lua:2: node "kernel": the kernel assigns the upvalue "n"', (scene.kernel_error("n = n + 1", nil,
      "local n = 0"):match "^(.-);"))
    -- A chunk with the name of one of Rapid's own would not be analysed.
    local message = scene.error [[
local make = load("local n = 0 return function(p) n = n + 1 end", "=[rapid runner]")
return rapid.create { points = two } :points("k", make()) :solve {}]]
    assert.truthy(message:find('the kernel assigns the upvalue "n"', 1, true), message)
  end)

  it("changes libraries for itself alone", function()
    -- Rapid's own Lua writes program text with format, gsub and concat.
    local result = scene.run [[
string.format = function() return "] error 'out' --" end
string.gsub, string.find, string.sub = string.format, string.format, string.format
table.concat, table.sort, table.insert = string.format, string.format, string.format
math.floor, ipairs, pairs, type, tostring, error, select = nil, nil, nil, nil, nil, nil, nil
return rapid.create { points = two } :attribute { heat = 0 }
  :points("k", function(p) p.heat = p.heat + 1 p:join "g" end) :solve {}]]
    assert.equal(2, result[3][1].heat)
    assert.truthy(scene.error([[string.format = function() return "wrong" end rapid.levelset.read()]])
      :find "the path is missing")
  end)

  it("can't change the methods of strings", function()
    local in_body = try "getmetatable('').__index.format = error"
    assert.truthy(in_body:find("attempt to index"), in_body)
    assert.truthy(try("('').format = error"):find "attempt to index")
  end)

  it("can't put a metatable on anything but its own tables", function()
    for statement, expected in pairs {
      ["setmetatable('', {})"] = "setmetatable needs a table",
      ["setmetatable(two, {})"] = "setmetatable needs a table",
      ["setmetatable(vec3(0, 0, 0), {})"] = "setmetatable needs a table",
      ["setmetatable(print, {})"] = "setmetatable needs a table",
    } do
      local in_body, in_kernel = try(statement)
      assert.equal(expected, in_body)
      assert.equal(expected, in_kernel)
    end
    assert.equal("cannot change a protected metatable",
      (try "local t = setmetatable({}, { __metatable = false }) setmetatable(t, {})"))
  end)

  it("gets no pointer out of a vec3, a frame or a number of 64 bits", function()
    for _, statement in ipairs {
      "local v = vec3(1, 2, 3) v[1000] = 1", "local v = vec3(1, 2, 3) local x = v[0]",
      "local v = vec3(1, 2, 3) local x = v + 8", "local v = vec3(1, 2, 3)()", "local x = (1LL)[0]",
      "local x = 1LL; x.y = 1", "local t = 1LL()",
    } do
      assert.truthy(try(statement), statement)
    end
    for _, statement in ipairs {
      "p[1] = 2", "local x = p[-1]", "local x = p + 1", "p()", "local x = #p", "frame.number = 3", "local x = frame[0]",
      "local x = frame.columns", "p.P = two", "p.v = 1LL", "p.v = frame", "p.P = p", "p.v = print",
    } do
      local _, in_kernel = try(statement)
      assert.truthy(in_kernel, statement)
    end
  end)

  it("can't use a point outside its kernel", function()
    local message = scene.error([[
local later = coroutine.wrap(function(p) while true do coroutine.yield(p.P) end end)
many = {} for i = 1, 20000 do many[i] = i end -- more than the comparison covers
return rapid.create { points = two }
  :points("k", function(p) local held = { later } p.P = held[1](p) end)
  :attribute { heat = function(frame) return frame.number < 3 and 0 or later().x end } :solve {}]], { threads = 1 })
    assert.truthy(message:find('node "attribute1": a point can\'t be used outside its kernel', 1, true), message)
  end)

  it("makes nodes and shapes in coroutines too", function()
    local result = scene.run [[
local make = coroutine.wrap(function(points)
  local mesh = rapid.mesh.box { size = {1, 2, 3} }
  coroutine.yield(rapid.create { points = points } :points("k", function(p) p.v = vec3(24, 0, 0) end))
end)
return make(two):solve {}]]
    assert.near({2, 1, 0}, result[2][2].P, 1e-6)
    assert.equal('scene.lua:1: node "gravity1": unknown parameter "x"; gravity has group, g',
      scene.error "return coroutine.wrap(function() return rapid.create {} :gravity { x = 1 } end)()")
  end)
end)

describe("what graph code sees", function()
  it("is ordered: pairs and next visit numbers, then names, then false and true", function()
    local before = [[
local t, words = {}, {}
for _, key in ipairs { "zebra", true, "b", 10, -2, "a", false, 1.5, "B", 3 } do t[key] = key end
for key, value in pairs(t) do assert(key == value) words[#words + 1] = tostring(key) end]]
    local expected = "-2 1.5 3 10 B a b zebra false true"
    assert.equal(expected, text_of("table.concat(words, ' ')", before))
    assert.equal(expected, text_of("table.concat(words, ' ')", before ..
      " words = {} local key = next(t) while key ~= nil do words[#words + 1] = tostring(key) key = next(t, key) end"))
  end)

  it("lets a loop over pairs remove the entries that it visits", function()
    assert.equal("a c", text_of("table.concat(words, ' ')", [[
local t, words = { a = 1, b = 2, c = 3 }, {}
for key in pairs(t) do words[#words + 1] = key t[key] = nil t.b = nil end]]))
  end)

  it("does not let the order of addresses decide", function()
    assert.equal("pairs can't order keys that are not numbers or strings (here: table); use a list",
      (try "for key in pairs { [{}] = 1, [{}] = 2 } do local _ = key end"))
    assert.is_nil((try "for key in pairs { [{}] = 1, x = 2 } do local _ = key end"))
    assert.equal("pairs needs a table, not nil", (try "for key in pairs(nil) do local _ = key end"))
    assert.equal("next needs a table, not a number", (try "next(1)"))
    assert.equal("next was given a key that is not in the table", (try "next({}, 'x')"))
  end)

  it("has no addresses in it", function()
    for expression, expected in pairs {
      ["tostring {}"] = "table",
      ["tostring(function() end)"] = "function",
      ["tostring(print)"] = "function",
      ["tostring(coroutine.create(print))"] = "thread",
      ["tostring(rapid.create {})"] = "a node",
      ["tostring(rapid.shape.sphere {})"] = "a sphere",
      ["tostring(two)"] = "points",
      ["('%s and %s'):format({}, print)"] = "table and function",
      ["string.format('%5s|%-6s|%s', {}, 0xbeef, 'at 0xbeef')"] = "table|48879 |at 0xbeef",
      ["tostring 'it is 0xdeadbeef'"] = "it is 0xdeadbeef",
      ["select(2, pcall(function() return {} .. '' end))"] = "attempt to concatenate a table value",
    } do
      assert.equal(expected, text_of(expression), expression)
    end
    for _, flags in ipairs { "p", "-20p", "5.3p" } do
      local message = try(("local s = ('%%%s'):format({})"):format(flags))
      assert.equal("%p is not available, because addresses differ from run to run", message)
    end
    assert.equal("50%p", text_of "('%d%%p'):format(50)")
  end)
end)

describe("require", function()
  it("runs a module next to the graph once, with its own file in messages", function()
    scene.folder:write("wind.lua", [[
local wind = { calls = 0 }
function wind.push(p, strength)
  p.v = p.v + vec3(strength, 0, 0)
end
function wind.fail(p)
  return p.P + nil
end
return wind]])
    local result = scene.run [[
local wind = require "wind"
assert(wind == require "wind")
return rapid.create { points = two } :points("k", function(p) wind.push(p, 24) end) :solve {}]]
    assert.near({2, 1, 0}, result[2][2].P, 1e-6)
    assert.truthy(scene.error([[
local wind = require "wind"
return rapid.create { points = two } :points("k", function(p) wind.fail(p) end) :solve {}]])
      :find '^wind.lua:6: node "k": can\'t compute vec3%(0, 1, 0%) %+ nil')
  end)

  it("finds modules in folders, by dots, and on RAPID_PATH", function()
    os.execute("mkdir -p " .. scene.folder:file "parts" .. " " .. scene.folder:file "elsewhere")
    scene.folder:write("parts/height.lua", "return 7")
    scene.folder:write("elsewhere/depth.lua", "return 5")
    assert.equal("7", text_of "tostring(require 'parts.height')")
    local text = "print(require 'depth') return rapid.create {}"
    local result = scene.command("check", text, "",
      { environment = { RAPID_PATH = "/nowhere:" .. scene.folder:file "elsewhere" } })
    assert.equal("5", result.stdout:match "^[^\n]*")
    local missing = scene.command("check", text)
    assert.equal('scene.lua:1: no module "depth"; looked for depth.lua\n', missing.stderr)
    assert.equal(2, missing.status)
  end)

  it("reports an error in a module with the module's file", function()
    scene.folder:write("broken.lua", "local x = 1\nlocal = 2")
    assert.equal("broken.lua:2: '<name>' expected near '='", scene.error "require 'broken'")
    scene.folder:write("raises.lua", "\n\nerror 'no wind today'")
    assert.equal("raises.lua:3: no wind today", scene.error "local wind = require 'raises'")
    scene.folder:write("nodes_in.lua", "local rapid = require 'rapid'\nreturn rapid.create { fsp = 24 }")
    assert.equal('nodes_in.lua:2: node "create1": unknown parameter "fsp"; did you mean "fps"?',
      scene.error "return (require 'nodes_in')")
  end)

  it("ends where modules require each other", function()
    scene.folder:write("hen.lua", "return require 'egg'")
    scene.folder:write("egg.lua", "return require 'hen'")
    local message = scene.error "require 'hen'"
    assert.equal('egg.lua:1: module "hen" requires itself through other modules', message)
  end)
end)
