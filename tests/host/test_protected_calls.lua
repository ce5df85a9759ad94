-- pcall, xpcall, coroutines, table.sort and string.gsub in scripts: uses that would crash LuaJIT's own versions.
local scene = require "testing.scene"

-- Returns the value of an expression as text, after statements of graph code.
local function text_of(before, expression)
  return (scene.error(("%s\nerror(tostring(%s), 0)"):format(before, expression)):gsub("^scene%.lua:%d+: ", ""))
end

-- Runs graph code in a separate process; returns its result.
local function run_alone(text, arguments)
  return scene.command("run", text .. "\nreturn rapid.create { points = two } :solve {}", "-f 1-3 --quiet " ..
    (arguments or ""))
end

describe("a protected call", function()
  it("returns the values or the error of a function", function()
    assert.equal("true 1 nil 3", text_of("local ok, a, b, c = pcall(function(...) return ... end, 1, nil, 3)",
      "('%s %s %s %s'):format(ok, a, b, c)"))
    assert.equal("false hot", text_of("local ok, message = pcall(error, 'hot', 0)", "('%s %s'):format(ok, message)"))
    assert.equal("true 5", text_of("local ok, sum = xpcall(function(a, b) return a + b end, error, 2, 3)",
      "('%s %s'):format(ok, sum)"))
    assert.equal("false <hot>", text_of(
      "local ok, text = xpcall(error, function(message) return '<' .. message .. '>' end, 'hot', 0)",
      "('%s %s'):format(ok, text)"))
    assert.equal("false twice", text_of(
      "local ok, text = xpcall(error, function() error('twice', 0) end, 'hot', 0)", "('%s %s'):format(ok, text)"))
    assert.match("xpcall needs a function and an error handler, not nil", scene.error "xpcall(error)")
    assert.equal("3", text_of([[
local steps = coroutine.wrap(function() pcall(function() coroutine.yield(1) coroutine.yield(2) end) return 3 end)
steps() steps()]], "steps()"))
  end)

  it("of protected calls checks the stack", function()
    for _, code in ipairs {
      "local t = {} for i = 1, 200 do t[i] = pcall end pcall(unpack(t))",
      "local t = {} for i = 1, 7000 do t[i] = pcall end pcall(unpack(t))",
      "local t = {} for i = 1, 200 do t[i] = xpcall end xpcall(unpack(t))",
      "local function f() return 1 + f() end for i = 1, 200 do xpcall(f, function() return f() end) end",
      "local function f() pcall(f) end f()",
      "local function f() xpcall(f, f) end f()",
      "local f f = coroutine.wrap(function() pcall(f) xpcall(f, f) end) f()",
    } do
      local result = run_alone(code)
      assert.truthy(result.status == 0 or result.stderr:find "stack overflow", code .. ": " .. result.stderr)
    end
  end)

  it("does not catch that memory is used up, whatever the limit", function()
    local grow = "local t = {} local function grow(i) t[i] = ('x'):rep(1000) .. i end "
    for name, loop in pairs {
      pcall = "pcall(grow, i)", xpcall = "xpcall(grow, print, i)", gsub = "('x'):gsub('x', function() grow(i) end)",
      sort = "table.sort({ 2, 1 }, function(a, b) grow(i) return a < b end)",
      resume = "coroutine.resume(coroutine.create(grow), i)", nested = "pcall(pcall, pcall, grow, i)",
    } do
      for limit = 9, 24, 5 do
        local result = scene.command("run", "return rapid.create { points = two } :detail('d', function()\n" .. grow ..
          "for i = 1, 1e6 do " .. loop .. " end end) :solve {}", ("-f 1-3 --quiet --script-memory %dM"):format(limit))
        assert.truthy(result.stderr:find(("the script needs more than %d MiB of Lua memory"):format(limit), 1, true),
          name .. ": " .. result.stderr)
        assert.equal(1, result.status)
      end
    end
  end)
end)

describe("functions that call a script", function()
  it("nest to a limit, with an error", function()
    for name, code in pairs {
      ["table.sort"] = "local function f() table.sort({ 1, 2 }, function(a, b) f() return a < b end) end f()",
      ["string.gsub"] = "local function f() return (('x'):gsub('x', f)) end f()",
      coroutines = "local function f() coroutine.wrap(f)() end f()",
      ["coroutines "] = "local function f() local ok, m = coroutine.resume(coroutine.create(f)) error(m, 0) end f()",
      ["coroutines  "] = "local function f() table.sort({ 1, 2 }, function(a, b) coroutine.wrap(f)() end) end f()",
      ["table.sort "] = "local m = {} function m.__lt() table.sort { setmetatable({}, m), setmetatable({}, m) } end " ..
        "m.__lt()",
    } do
      local result = run_alone(code)
      assert.truthy(result.stderr:find "stack overflow: [%w.]+ nested more than 100 deep",
        name .. ": " .. result.stderr)
      assert.equal(2, result.status)
    end
  end)

  it("may be left by an error at any depth, and called again", function()
    assert.equal("done", text_of([[
local function f(depth) table.sort({ 1, 2 }, function() if depth == 90 then error("out", 0) end f(depth + 1) end) end
for i = 1, 300 do
  assert(not pcall(f, 1))
  pcall(coroutine.wrap(function() coroutine.yield() end))
  pcall(string.gsub, "x", "x", function() error "out" end)
end]], "'done'"))
  end)

  it("sort as ever", function()
    assert.equal("3 2 1", text_of("local t = { 2, 3, 1 } table.sort(t, function(a, b) return a > b end)",
      "table.concat(t, ' ')"))
    assert.equal("1 2 3", text_of("local t = { 2, 3, 1 } table.sort(t)", "table.concat(t, ' ')"))
  end)
end)

describe("a weak table", function()
  local refusal = "a table can't be weak (__mode), because its contents would depend on the garbage collector"

  it("can't be made", function()
    for _, mode in ipairs { "'k'", "'v'", "'kv'", "false" } do
      assert.equal("scene.lua:1: " .. refusal, scene.error(("setmetatable({}, { __mode = %s })"):format(mode)))
    end
  end)

  -- A collected object leaves the table before its finalizer runs, so a lookup gives a whole object, or nil.
  it("that is made so later gives back what is alive, where a key is looked up", function()
    for _, mode in ipairs { "k", "v", "kv" } do
      local result = run_alone(([[
local weak, lost = {}, 0
for i = 1, 200 do
  local meta = {}
  local table = setmetatable({}, meta)
  meta.__mode = "%s"
  table[1], table.x = rapid.levelset.sphere { radius = 0.3, voxel = 0.1 }, rapid.shape.sphere { radius = i }
  weak[i] = table
end
for i = 1, 300 do local garbage = ("x"):rep(100000) .. i end
for i = 1, 200 do
  for _, key in ipairs { 1, "x" } do
    local shape = weak[i][key]
    if shape then assert(shape:distance(vec3(0, 0, 0)) < 0) else lost = lost + 1 end
  end
end
print(lost > 100 and "collected" or "kept")]]):format(mode))
      assert.equal("", result.stderr)
      assert.match(mode == "k" and "kept" or "collected", result.stdout)
    end
  end)

  it("that is made so later gives nothing back where it is walked", function()
    for _, code in ipairs { "for key in pairs(weak) do kept = key end", "kept = next(weak)" } do
      local result = run_alone([[
local meta, kept = {}, nil
local weak = setmetatable({}, meta)
meta.__mode = "k"
weak[rapid.shape.sphere { radius = 1 }] = 1
for i = 1, 300 do local garbage = ("x"):rep(100000) .. i end
]] .. code)
      assert.equal("scene.lua:6: " .. refusal .. "\n", result.stderr)
    end
  end)
end)
