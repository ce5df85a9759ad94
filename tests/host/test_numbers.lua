-- Numbers have one meaning: operators, `math` and `bit` give the same bits in lanes, compiled and interpreted, in all
-- code of a scene, and in every kind of run.
--
-- Three kernels compute each expression: a lane program, if there is one; one that creates a table, which LuaJIT
-- compiles; and one that creates a function, which it interprets. MATH_VALUES is the number of random pairs, which
-- follow 1,024 special ones.
local amount = require "tests.amount"
local command = require "testing.command"
local scene = require "testing.scene"

local random_pairs = amount.of("MATH_VALUES", 2000)

local special = {
  "0", "-0", "1", "-1", "0.5", "-0.5", "1.5", "-1.5", "2.5", "-0.7", "-0.3", "2", "-2", "3", "10", "0.1",
  "825.6962440394036", "0x1p31", "-0x1p31", "0x1p32", "0x1p52 + 0.5", "0x1p53", "-0x1p53", "0x1p-1074", "-0x1p-1074",
  "0x1p-1022", "1e308", "-1e308", "1 / 0", "-1 / 0", "0 / 0", "-7",
}

local head = [[
local names = { "r1", "r2", "r3", "r4" }
local function special(i)
  local x = 0
SPECIAL
  return x
end
-- x 2^e, |e| < 1024
local function scaled(x, e)
  if e < 0 then
    e = -e
SMALLER
  else
LARGER
  end
  return x
end
local function operands(p)
  if p.id < 1024 then return special(p.id % 32), special(math.floor(p.id / 32)) end
  return scaled(p.x1 + p.x2, p.xe), scaled(p.y1 + p.y2, p.ye)
end
-- Splits a number into floats: its class and exponent, and its digits.
local function parts_of(x)
  if x ~= x then return 5000, 0 end
  if x == 1 / 0 then return 5001, 0 end
  if x == -1 / 0 then return 5002, 0 end
  if x == 0 then return 1 / x > 0 and 5003 or 5004, 0 end
  local size, e = math.abs(x), 0
DOWN
UP
  return e, x < 0 and -size or size
end
local function store(p, x)
  local kind, digits = parts_of(x)
  p.r1 = kind
  p.r2 = digits
  p.r3 = digits - p.r2
  p.r4 = digits - p.r2 - p.r3
end
local function compare(p, x, number)
  local kind, digits = parts_of(x)
  if not (p.r1 == kind and p.r2 + p.r3 + p.r4 == digits) and p.bad == 0 then p.bad = number end
end
local function check(p, x, number)
  if number < 0 then store(p, x) else compare(p, x, number) end
end
return rapid.create { seed = 3, points = rapid.points.grid { size = {COUNT, 0, 0}, spacing = 1 } }
  :attribute { r1 = 0, r2 = 0, r3 = 0, r4 = 0, bad = 0, x1 = 0, x2 = 0, xe = 0, y1 = 0, y2 = 0, ye = 0 }
  :points("digits", function(p)
      local x, y = 1 + p:rand(1), 1 + p:rand(2)
      if p:rand(3) < 0.5 then x = -x end
      if p:rand(4) < 0.5 then y = -y end
      p.x1, p.y1 = x, y
      if p:rand(5) < 0.8 then p.x2, p.y2 = x - p.x1, y - p.y1 end
      p.xe = math.floor((p:rand(6) - 0.5) * (p:rand(7) < 0.7 and 12 or 2040))
      p.ye = math.floor((p:rand(8) - 0.5) * (p:rand(9) < 0.7 and 12 or 2040))
    end)
]]

local function fill(text)
  local lines = {}
  for k, value in ipairs(special) do lines[k] = ("  if i == %d then x = %s end"):format(k - 1, value) end
  local smaller, larger, down, up = {}, {}, {}, {}
  for k = 9, 0, -1 do
    local step = 2 ^ k
    smaller[#smaller + 1] = ("    if e >= %d then x, e = x * 0x1p-%d, e - %d end"):format(step, step, step)
    larger[#larger + 1] = ("    if e >= %d then x, e = x * 0x1p%d, e - %d end"):format(step, step, step)
    down[#down + 1] = ("  if size >= 0x1p%d then size, e = size * 0x1p-%d, e + %d end"):format(step, step, step)
    up[#up + 1] = ("  if size < 0x1p-%d then size, e = size * 0x1p%d, e - %d end"):format(step, step, step)
  end
  table.insert(up, 1, up[1]) -- subnormal numbers
  return (text:gsub("%u%u+", {
    SPECIAL = table.concat(lines, "\n"), SMALLER = table.concat(smaller, "\n"), LARGER = table.concat(larger, "\n"),
    DOWN = table.concat(down, "\n"), UP = table.concat(up, "\n"), COUNT = tostring(1024 + random_pairs),
  }))
end

-- before: text before the graph. Returns the indices of the expressions that are not lane programs.
local function check(expressions, before)
  local text = { before or "", fill(head) }
  for k, expression in ipairs(expressions) do
    text[#text + 1] = ([[
  :points("lanes%d", function(p) local x, y = operands(p)  check(p, EXPR, -1) end)
  :points("traced%d", function(p) local t = { operands(p) }  local x, y = t[1], t[2]  check(p, EXPR, %d) end)
  :points("interpreted%d", function(p) local f = function() return p end
      local x, y = operands(p)  check(p, EXPR, %d + 0.5) end)
]]):gsub("EXPR", (expression:gsub("%%", "%%%%%%%%"))):format(k, k, k, k, k)
  end
  text[#text + 1] = "  :solve {}"
  local result = scene.run(table.concat(text), { frames = {2, 3}, threads = 1, watch_lanes = true })
  for frame = 2, 3 do
    local points = result[frame]
    if points:max "bad" ~= 0 then
      for k = 1, #points do
        local bad = points[k].bad
        if bad ~= 0 then
          error(("frame %d: %s differs %s (pair %d)"):format(frame, expressions[math.floor(bad)],
            bad % 1 > 0 and "interpreted" or "compiled", points[k].id))
        end
      end
    end
  end
  local without = {}
  for _, reason in ipairs(result.no_lanes) do
    if not reason:find "makes a table" and not reason:find "makes a function" then without[#without + 1] = reason end
  end
  return without
end

describe("in lanes, compiled and interpreted", function()
  it("operators give the same bits", function()
    assert.same({}, check {
      "x + y", "x - y", "x * y", "x / y", "x % y", "-x", "-x + y", "x - -y", "-x * -y", "x + 0", "0 - x", "x * 2",
      "x / 4", "x * -1", "x / -1", "x % 2", "x % -0.3", "5 % x", "x < y and 1 or 2", "x <= y and 1 or 2",
      "x > y and 1 or 2", "x >= y and 1 or 2", "x == y and 1 or 2", "x ~= y and 1 or 2", "not (x < y) and 1 or 2",
    })
  end)

  it("powers give the same bits, in modules and with upvalues too", function()
    scene.folder:write("squares.lua", [[
local function of_exponent(y) return function(x) return x ^ y end end
return { of = function(x) return x ^ 2 end, by_upvalue = of_exponent(2) }
]])
    assert.same({}, check({
      "x ^ y", "x ^ 2", "x ^ 3", "x ^ 0.5", "x ^ -1", "x ^ 1", "x ^ 0", "2 ^ y", "(-0.7) ^ y", "x ^ two",
      "2 ^ -x ^ two", "math.pow(x, y)", "math.pow(x, 2)", "squares.of(x)", "squares.by_upvalue(x)", "math.abs(x) ^ y",
    }, "local two, squares = 2, require \"squares\"\n"))
  end)

  it("functions of math give the same bits", function()
    local without = check {
      "math.min(x, y)", "math.max(x, y)", "math.min(x, y, 0.5)", "math.max(0, x)", "math.max(x, -0)", "math.min(-0, x)",
      "math.min(x)", "math.floor(x)", "math.ceil(x)", "math.floor(math.ceil(x))", "math.abs(x)", "math.abs(-x)",
      "math.sqrt(x)", "math.sin(x)", "math.cos(x)", "math.tan(x)", "math.asin(x)", "math.acos(x)", "math.atan(x)",
      "math.atan2(x, y)", "math.exp(x)", "math.log(x)", "math.log(x, y)", "math.log(x, 10)", "math.log10(x)",
      "math.sinh(x)", "math.cosh(x)", "math.tanh(x)", "math.ldexp(x, y)", "math.ldexp(0.5, 0x1p40)", "math.deg(x)",
      "math.rad(x)", "math.asin(1 / x)", "math.acos(1 / x)", "math.huge - x", "x * math.pi",
    }
    assert.same({}, without)
    check { "math.fmod(x, y)", "(math.modf(x))", "(select(2, math.modf(x)))", "(math.frexp(x))",
            "(select(2, math.frexp(x)))" }
  end)

  it("functions of bit give the same bits", function()
    check {
      "bit.tobit(x)", "bit.tobit(x + 1)", "bit.tobit(x + y)", "bit.bnot(x)", "bit.band(x, y)",
      "bit.band(x + y - 1, 255)",
      "bit.bor(x, y)", "bit.bor(x - 0.5, 0)", "bit.bxor(x, y)", "bit.bxor(x * 2 + 1, 7)", "bit.lshift(x, y)",
      "bit.rshift(x, y)", "bit.arshift(x, y)", "bit.rol(x, y)", "bit.ror(x, y)", "bit.bswap(x)",
      "tonumber(bit.tohex(x), 16)", "tonumber(tostring(x)) or 1", "#tostring(x)",
    }
  end)

  it("loops count from -0", function()
    check {
      "(function() local s, n = 0, 0  for i = x, x + 2 do s, n = s + 1 / i, n + 1  if n > 3 then break end end "
        .. " return s end)()",
    }
  end)

  it("every function of math and bit is among these", function()
    local file = assert(io.open(debug.getinfo(1, "S").source:sub(2)))
    local text = file:read "*a"
    file:close()
    local names = scene.error [[
local names = {}
for name, value in pairs(math) do if type(value) == "function" then names[#names + 1] = "math." .. name end end
for name in pairs(bit) do names[#names + 1] = "bit." .. name end
error("NAMES " .. table.concat(names, " "))]]
    local count = 0
    for name in names:match("NAMES (.*)"):gmatch "%a+%.%w+" do
      assert.truthy(text:find(name .. "(", 1, true), name)
      count = count + 1
    end
    assert.truthy(count > 30)
  end)
end)

local pointwise = [[
return rapid.create { seed = 2, points = rapid.points.grid { size = {60, 0, 60}, spacing = 1 } }
  :attribute { a = 0, b = 0, c = 0, d = 0 }
  :points("tables", function(p)
      local t = { 825.6962440394036 + p.id * 0, p.id * 0, p.id % 7 * -0.1 }
      local x, zero = t[1], t[2]
      p.a = p.a + (x ^ 2 - x * x)
      p.b = 1 / math.min(zero, -zero) > 0 and 1 or -1
      local m = math.max(zero / zero, p.id)
      p.c = m == m and 1 or -1
      p.d = 1 / math.ceil(t[3] - 0.05) > 0 and 1 or -1
    end)
  :points("lanes", function(p)
      local x = 825.6962440394036 + p.id * 0
      p.a = p.a + (x ^ 2.5 - x ^ 2 * math.sqrt(x)) + math.log(1 + p.a * p.a)
    end)
  :action("steps", function(p, step)
      local t = { 1 + step.dt + p.id * 1e-3 }
      p.d = p.d + t[1] ^ 2 * 1e-3 + t[1] ^ 0.3
    end)
  :gravity { g = function(frame) return vec3(0, -math.max(1, 0.1 * frame.number ^ 2), 0) end }
  :solve { substeps = 2 }]]

describe("a scene of powers, least and largest", function()
  local folder = command.folder()
  folder:write("scene.lua", "local rapid = require \"rapid\"\n" .. pointwise)
  local function rapid(arguments)
    local result = command.rapid(arguments, { cwd = folder.path })
    assert.equal(0, result.status, result.stderr)
  end
  rapid "run scene.lua -f 1-6 -o 'one.####.csv' --threads 1 --quiet"
  local function same(prefix)
    for frame = 1, 6 do
      local name = (".%04d.csv"):format(frame)
      assert.truthy(#folder:read("one" .. name) > 1000)
      assert.truthy(folder:read("one" .. name) == folder:read(prefix .. name), prefix .. name)
    end
  end

  it("has the same files on any number of threads", function()
    for _, threads in ipairs { 2, 7 } do
      rapid(("run scene.lua -f 1-6 -o 't%d.####.csv' --threads %d --quiet"):format(threads, threads))
      same("t" .. threads)
    end
  end)

  it("has them if it is resumed", function()
    rapid "run scene.lua -f 1-3 -o 'r.####.csv' --threads 1 --cache kept --quiet"
    rapid "run scene.lua -f 1-6 -o 'r.####.csv' --threads 1 --cache kept --quiet"
    same "r"
  end)

  it("has them if it is run in parts", function()
    for k = 1, 3 do rapid(("run scene.lua -f 1-6 --part %d/3 -o 'p.####.csv' --quiet"):format(k)) end
    rapid "merge -o 'm.####.csv' 'p_part{part}.####.csv' --quiet"
    same "m"
  end)
end)

describe("a processor without fused multiplication", function()
  it("computes the same functions", function()
    local folder = command.folder()
    local functions = { "x ^ y", "2.5 ^ x", "math.atan2(x, y)", "math.log(y, 3)" }
    for _, name in ipairs { "sin", "cos", "tan", "atan", "exp", "sinh", "tanh" } do
      functions[#functions + 1] = ("math.%s(x * 3)"):format(name)
    end
    for _, name in ipairs { "asin", "acos", "cosh" } do functions[#functions + 1] = ("math.%s(y - 1)"):format(name) end
    functions[#functions + 1] = "math.log(x) + math.log10(y) + math.sin(x * 1e7)"
    local text = { [[
local rapid = require "rapid"
return rapid.create { seed = 5, points = rapid.points.grid { size = {9999, 0, 0}, spacing = 1 } }
  :attribute { first = 0, second = 0, third = 0 }
]] }
    -- The last digits of a double are those that remain after two floats.
    for k, expression in ipairs(functions) do
      text[#text + 1] = ([[
  :points("lanes%d", function(p) local x, y = p:rand(1) * 2, p:rand(2) + 0.5
      local value = EXPR
      p.first = value
      p.second = value - p.first
      p.third = p.third * 0.7 + (value - p.first - p.second) * 0x1p50
    end)
  :points("traced%d", function(p) local t = { p:rand(1) * 2, p:rand(2) + 0.5 } local x, y = t[1], t[2]
      local value = EXPR
      p.first = value
      p.second = value - p.first
      p.third = p.third * 0.7 + (value - p.first - p.second) * 0x1p50
    end)
]]):gsub("EXPR", expression):format(k, k)
    end
    folder:write("scene.lua", table.concat(text) .. "  :solve {}")
    local variants = { fused = "", plain = "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX2_Usable,-FMA_Usable" }
    for name, tunables in pairs(variants) do
      local result = command.rapid(("run scene.lua -f 2 -o '%s.####.csv' --quiet"):format(name),
        { cwd = folder.path, environment = { GLIBC_TUNABLES = tunables } })
      assert.equal(0, result.status, result.stderr)
    end
    assert.truthy(folder:read "fused.0002.csv" == folder:read "plain.0002.csv")
  end)
end)

describe("functions of the whole set and the body of a scene", function()
  it("have the squares of constants, and of string given to load", function()
    local points = scene.run([[
local x = 825.6962440394036 -- the C library's pow rounds its square up
local found = { 825.6962440394036 ^ 2, x ^ 2, load("return 825.6962440394036 ^ 2")(), math.pow(x, 2) }
local v = 0
for k = 1, #found do if found[k] ~= x * x then v = k end end
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{v, 0, 0}} } }]], { frames = {1, 1} })[1]
    assert.equal(0, points[1].v.x)
  end)

  it("compute as each other", function()
    local points = scene.run([[
local values = { 825.6962440394036, -0.7, 3, 1e-3, -0.0, 12.75, 0 / 0 }
local function all(x, y)
  return { x ^ 2, x ^ y, math.min(x, y), math.max(y, x), math.ceil(x), x % y, math.log(x), bit.tobit(x + y) }
end
local expected = {}
for i, x in ipairs(values) do
  expected[i] = {}
  for j, y in ipairs(values) do expected[i][j] = all(x, y) end
end
local function same(a, b) return a == b and 1 / a == 1 / b or a ~= a and b ~= b end
return rapid.create { points = two }
  :detail("compare", function(points)
      local bad = 0
      for _ = 1, 30 do
        for i = 1, #values do
          for j = 1, #values do
            local found = all(values[i], values[j])
            for k = 1, #found do
              if not same(found[k], expected[i][j][k]) then bad = bad + 1 end
            end
          end
        end
      end
      points[1].v = vec3(bad, 0, 0)
    end)]], { frames = {1, 1} })[1]
    assert.equal(0, points[1].v.x)
  end)
end)
