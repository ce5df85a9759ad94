-- The operator ^ as calls. Rewritten programs compute what LuaJIT computes if its powers are exact.
local power_operator = require "power_operator"

local env = setmetatable({ [power_operator.name] = math.pow }, { __index = _G })

local function run(text)
  return setfenv(assert(loadstring(text)), env)()
end

local function rewritten(text)
  return (assert(power_operator.rewrite(text)):gsub(power_operator.name, "P"))
end

local function has_powers(f)
  local util, vmdef = require "jit.util", require "jit.vmdef"
  for pc = 1, util.funcinfo(f).bytecodes - 1 do
    local op = bit.band((util.funcbc(f, pc)), 0xff)
    if vmdef.bcnames:sub(op * 6 + 1, op * 6 + 3) == "POW" then return true end
  end
  for k = -1, -util.funcinfo(f).gcconsts, -1 do
    local value = util.funck(f, k)
    if type(value) == "proto" and has_powers(value) then return true end
  end
  return false
end

describe("the operator ^", function()
  it("is a call of its operands", function()
    for text, expected in pairs {
      ["return a^b"] = "return (P(a,(b)))",
      ["return a ^ b ^ c"] = "return (P(a ,( (P(b ,( c))))))",
      ["return -a^2"] = "return -(P(a,(2)))",
      ["return 2^-a^-b"] = "return (P(2,(-(P(a,(-b))))))",
      ["return (a^b)^c"] = "return (P(((P(a,(b)))),(c)))",
      ["return a.b[c^d]:e(f)^#g.h + 1"] = "return (P(a.b[(P(c,(d)))]:e(f),(#g.h))) + 1",
      ["return f\"^\"^2, f{1}^2, f[[^]]^2"] = "return (P(f\"^\",(2))), (P(f{1},(2))), (P(f[[^]],(2)))",
      ["return 2^f\"1\", 2^f{1}(2).x, 2^a:b'c'"] = "return (P(2,(f\"1\"))), (P(2,(f{1}(2).x))), (P(2,(a:b'c')))",
      ["return '2'^'3', ...^2"] = "return (P('2',('3'))), (P(...,(2)))",
      ["return 0x1p-2^1e-3^.5"] = "return (P(0x1p-2,((P(1e-3,(.5))))))",
      ["return a --[[ ^ ]]^ --^\n b"] = "return (P(a --[[ ^ ]],( --^\n b)))",
      ["return not a^b, '\\'^'"] = "return not (P(a,(b))), '\\'^'",
    } do
      assert.equal(expected, rewritten(text))
    end
  end)

  it("is left alone in strings and comments", function()
    for _, text in ipairs {
      "return '^', \"\\\"^\", [[^]], [==[ ]] ^ ]==] -- ^\n--[[ ^\n]] --[=[ ]] ^ ]=]", "return ('x'):find '^x'",
      "return 1",
    } do
      assert.equal(nil, power_operator.rewrite(text))
    end
  end)

  it("leaves a function to LuaJIT, which refuses it", function()
    for _, text in ipairs { "return function() end ^ 2", "return 2 ^ function() end", "return 2 ^ 3 ^ function() end" }
    do
      assert.equal(nil, power_operator.rewrite(text))
    end
    assert.equal("return function() return (P(a,(2))) end ^ 2", rewritten "return function() return a^2 end ^ 2")
  end)

  it("takes one value of a call", function()
    assert.equal(8, run(power_operator.rewrite "local function two() return 2, 3 end  return two() ^ (two() + 1)"))
    assert.equal(4, run(power_operator.rewrite "local function two() return 2, 3 end  return two() ^ two()"))
  end)

  it("has the value of LuaJIT's in random expressions of small whole numbers", function()
    local state = 1
    local function draw(n)
      state = (state * 16807) % 2147483647
      return state % n + 1
    end
    local function pick(list) return list[draw(#list)] end
    local expression
    local function simple(depth)
      if depth == 0 then return pick { "1", "2", "t.two", "t[1]", "three", "'2'", "(#'ab')", "0x2", "2e0" } end
      return pick {
        function() return ("(%s)"):format(expression(depth - 1)) end,
        function() return ("f(%s)"):format(expression(depth - 1)) end,
        function() return ("t:same(%s).value"):format(expression(depth - 1)) end,
        function() return ("({ %s })[1]"):format(expression(depth - 1)) end,
        function() return ("(function() return %s end)()"):format(expression(depth - 1)) end,
        function() return "f\"2\"" end,
      }()
    end
    function expression(depth)
      if depth == 0 then return simple(0) end
      return pick {
        function() return ("%s^%s"):format(simple(depth - 1), simple(0)) end,
        function() return ("%s ^ %s ^ %s"):format(simple(0), simple(0), pick { "1", "-1", "0", "2" }) end,
        function() return ("-%s^%s * %s"):format(simple(depth - 1), pick { "2", "1" }, simple(depth - 1)) end,
        function() return ("%s - - %s^2"):format(simple(depth - 1), simple(0)) end,
        function()
          return ("(0 + %s < %s^2 and %s or %s)"):format(simple(0), simple(depth - 1), simple(0), simple(0))
        end,
        function() return ("%s %% 7"):format(simple(depth - 1)) end,
      }()
    end
    local head = "local three, t = 3, { 2, two = 2, same = function(_, x) return { value = x } end } "
      .. "local function f(x) return x % 5 end return "
    local count = 0
    for _ = 1, 500 do
      local text = head .. expression(4)
      local own = power_operator.rewrite(text)
      if own then
        local expected, value = tonumber(assert(loadstring(text))()), tonumber(run(own))
        assert.equal(false, has_powers(assert(loadstring(own))))
        if math.abs(expected) < 2 ^ 53 then
          count = count + 1
          assert.near(expected, value, math.abs(expected) * 1e-15)
        end
      end
    end
    assert.truthy(count > 200)
  end)
end)
