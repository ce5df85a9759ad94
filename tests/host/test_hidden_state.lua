-- Kernels that keep state from point to point and hide it from the bytecode analysis.
local scene = require "testing.scene"

local of_a_point = "; kernels run in parallel, in several Lua states: store the value in an attribute of the " ..
  "point, or compute it once for all points in a :detail"

-- S: a table shared by all points; push, keeper: a shared function and a shared coroutine; wrap: a table of S and push.
local before = "local S = { n = 0, list = {} } local function push(t, x) t[#t + 1] = x end " ..
  "local keeper = coroutine.wrap(function(k) while true do k = coroutine.yield(k) or k end end) " ..
  "local wrap = { S, push, push = push } "

-- Found by the bytecode analysis.
local seen = {
  ["setmetatable(S, {})"] = "changes a table that all points share by setmetatable",
  ["setmetatable(S.list, nil)"] = "changes a table that all points share by setmetatable",
  ["pcall(setmetatable, S, {})"] = "changes a table that all points share by setmetatable",
  ["pcall(table.insert, S, p.P.y)"] = "changes a table that all points share by table.insert",
  ["pcall(table.insert, S.list, 1, p.P.y)"] = "changes a table that all points share by table.insert",
  ["xpcall(table.insert, print, S, p.P.y)"] = "changes a table that all points share by table.insert",
  ["pcall(pcall, table.remove, S)"] = "changes a table that all points share by table.remove",
  ["table.sort(S)"] = "changes a table that all points share by table.sort",
  ["pcall(push, S, 1)"] = "assigns into a table that all points share",
  ["pcall(function(t) t.n = t.n + 1 end, S)"] = 'assigns the field "n" of a table that all points share',
  ["local t = setmetatable({}, { __newindex = S }) t[1] = 1"] =
    "makes a table that all points share the __newindex of another",
}

-- Found at run time.
local found = {
  ["local held = { S } held[1].n = held[1].n + 1"] = "n",
  ["local held = { S } rawequal(held, S) local t = held[1] t.more = 1"] = "more",
  ["local held = { S } held[1][#held[1] + 1] = p.P.y"] = false,
  ["(function(...) local t = ... t.n = t.n + 1 end)(S)"] = "n",
  ["local held = { wrap } held[1][2](held[1][1], 1)"] = false,
  ["local m = {} m['__new' .. 'index'] = S local t = setmetatable({}, m) t.n = nil t.k = 1"] = "k",
  ["coroutine.wrap(function(t) t.n = t.n + 1 end)(S)"] = "n",
  ["local held = { push } held[1](({ S })[1], 1)"] = false,
  ["local held = { keeper } held[1](1)"] = false,
  ["for _, t in ipairs { S } do t.n = t.n + 1 end"] = "n",
  ["('x'):gsub('x', function() local t = ({ S })[1] t.n = t.n + 1 end)"] = "n",
  ["table.sort({ 2, 1 }, function(a, b) local t = ({ S })[1] t.n = t.n + 1 return a < b end)"] = "n",
  ["local held = { S } setmetatable(held[1], { __index = print })"] = "__index",
  ["local held = { S } held[1].n = nil"] = "n",
  ["local held = { _G } held[1].counter = 1"] = "counter",
  ["local held = { math } held[1].floor = print"] = "floor",
}

describe("a kernel with hidden state", function()
  it("is refused before the first frame where its bytecode shows it", function()
    for body, expected in pairs(seen) do
      -- The position is in line 1 if the helper does the assignment.
      local message = scene.kernel_error(body, nil, before):gsub("^scene%.lua:[12]: ", "")
      assert.equal(('node "kernel": the kernel %s%s'):format(expected, of_a_point), message, body)
    end
  end)

  it("is refused in the first frame that it runs in, on any number of threads", function()
    local count = 0
    for body, name in pairs(found) do
      count = count + 1
      for _, threads in ipairs { 1, 3 } do
        local message = scene.error(scene.kernel_text(body, nil, before), { frames = {2, 2}, threads = threads })
        local reported = message:match('^scene%.lua:1: node "kernel": the kernel changes a value that all points ' ..
          "share %((.-)%); ")
        assert.truthy(reported, body .. ": " .. message)
        if name then assert.equal(name, reported, body) end
      end
    end
    assert.truthy(count >= 15)
  end)

  it("is refused as an action, as a test, and in :detail", function()
    local change = "local held = { S } held[1].n = held[1].n + 1"
    for _, chain in ipairs {
      ":action('k', function(p, step) %s end)", ":delete { where = function(p) %s return false end }",
      ":detail('k', function(points) %s end)",
    } do
      local message = scene.error(before .. "return rapid.create { points = two } " .. chain:format(change) ..
        " :solve {}", { frames = {1, 3} })
      assert.match("the kernel changes a value that all points share %(n%); ", message)
    end
  end)

  it("is told from one that reads what is shared, and changes what is its own", function()
    local result = scene.kernel([[
local own = { n = 0, list = {} }
for i, x in ipairs(S.list) do table.insert(own.list, x + i) end
own.n = S.n + #own.list
setmetatable(own, { __newindex = function(t, k, v) rawequal(t, k) end })
pcall(table.insert, own.list, 1)
local made = coroutine.wrap(function(x) local y = coroutine.yield(x) return y end)
made(1) made(2)
p.v = vec3(own.n + #own.list, 0, 0)]], nil, before .. "S.list = { 5, 6 } ")
    assert.equal(5, result[1].v.x)
  end)
end)
