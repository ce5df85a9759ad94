-- Templates from which random_kernels.lua makes kernels. A letter after $ stands for an expression of a kind:
--
--   $N number, $I whole number, $V vec3, $Q quat, $B boolean, $T string, $X something with a field x,
--   $M anything, $F a function of one number, $G the name of a group
--
-- A template is used only if the names in it exist there: p, frame, params.
local templates = {}

-- The start of each scene. `sound` keeps most numbers finite and small, so that most kernels raise no error.
templates.head = [[
local function sound(x) if x ~= x or x > 1e5 or x < -1e5 then return 0.5 end return x end
local function sound3(a) return vec3(sound(a.x), sound(a.y), sound(a.z)) end
local function sound4(a) return quat(sound(a.x), sound(a.y), sound(a.z), sound(a.w)) end
local function whole(x) return math.floor(sound(x)) end
local function mixed(a, b) return a * 0.25 + b * 0.75 end
local function swapped(...) local a, b = ... return b, a end
local function first_true(...) local a, b, c = ... return a or b or c end
local function passed(...) return ... end
local function three(a) return a.x, a.y, a.z end
local function product(n, x) if n > 0 then return x * product(n - 1, x) end return 1 end
local limit, tiny, zero, minus_zero, large = 0.25, 1e-40, 0, -0, 3e38
local tint, spin, on, off, none = vec3(0.2, -0.4, 1.5), quat(0.5, 0.5, -0.5, 0.5), true, false, nil
local word, which = "a", "f"
local shared = { x = 2.5, y = -1, list = { 7, 8, 9 }, inner = { x = -0.75, v = vec3(1, 2, 3), f = mixed }, word = "b" }
]]

-- Expressions without subexpressions, by kind. Lane programs do not support those in `pointwise`.
local atoms = {
  N = { "0", "1", "2", "0.5", "3", "(-1)", "(-0.3)", "1e-3", "7.25", "limit", "tiny", "zero", "minus_zero", "large",
        "tint.x", "shared.x", "shared.inner.x", "p.f", "p.g", "p.f", "p.P.x", "p.v.y", "p.Cd.z", "p.axis.y",
        "p.orient.w", "p.pscale", "p.dt", "frame.time", "frame.dt", "frame.detail.mean", "params.strength",
        "params.axis.x", "p:rand(1)", "p:rand(2, frame)", "p.age", "p.nage", "p.mass", "math.pi", "math.huge",
        "shared.list[2]", "p[which]" },
  I = { "0", "1", "2", "3", "5", "(-2)", "100", "2147483647", "(-2147483648)", "p.id", "p.index", "p.instance",
        "p.instance", "p.parent", "p.hittotal", "frame.number", "params.count", "shared.list[1]" },
  V = { "p.P", "p.v", "p.Cd", "p.P", "p.v", "p.axis", "tint", "shared.inner.v", "vec3(1, 0, -2)", "params.axis",
        "frame.detail.middle" },
  Q = { "p.orient", "p.orient", "p.turn", "quat(0, 0, 0, 1)", "quat(0.6, 0, 0, -0.8)" },
  B = { "true", "false", "on", "off", "params.active", "p:within($G)", "(p.P.x > 1)", "(p.id % 2 == 0)", "(p.f < 0)",
        "(p.P.y < p.P.z)", "(p:rand(5) < 0.5)", "(p.instance == 0)", "(p.v.x >= -0.5)", "(p.id % 5 < 2)",
        "(p.id == 40)", "(p.index > 20)", "(frame.number == 2)" },
  T = { "\"a\"", "\"b\"", "word", "shared.word", "\"\"", "params.kind" },
  X = { "p.P", "p.orient", "tint", "shared", "shared.inner", "vec3(5, 6, 7)", "quat(1, 2, 3, 4)" },
  M = { "nil", "none", "true", "false", "1", "word", "shared", "mixed", "tint", "shared.list", "p.f", "p.P", "p.orient",
        "p.instance", "on", "params.kind", "params.active" },
  F = { "math.sin", "math.abs", "math.floor", "math.sqrt", "sound", "whole", "tonumber" },
  G = { "\"a\"", "\"b\"" },
  pointwise = {
    N = { "params.list[2]" },
    Q = { "spin" },
    T = { "p.name", "p.name" },
    X = { "spin" },
    M = { "frame.detail.mood", "pcall(sound, p.f)", "spin" },
  },
}

local composed = {
  N = { "$I", "$I", "($N + $N)", "($N - $N)", "($N * $N)", "($N / $N)", "($N % $N)", "(-$N)", "($N ^ 2)", "($N ^ $N)",
        "($N * 0)", "(0 - $N)", "($N + 0)", "($N % 1.5)", "math.sin($N)", "math.cos($N)", "math.exp(-math.abs($N))",
        "math.sqrt($N)", "math.abs($N)", "math.tan($N)", "math.atan2($N, $N)", "math.log($N)", "math.floor($N)",
        "math.ceil($N)", "math.min($N, $N)", "math.max($N, $N, $N)", "$V:length()", "$V:dot($V)", "$Q:length()",
        "$V.x", "$V.y", "$V.z", "$Q.w", "($X).x", "($X).y", "($B and $N or $N)", "($N < $N and $N or $N)",
        "mixed($N, $N)", "sound($N)", "shared.inner.f($N, $N)", "first_true($N, $M)",
        "first_true(none, $B and $N, $N)", "(swapped($M, $N))", "p:rand($N)", "p:rand($I, $N)", "p.rand(p, $N)",
        "product(2, $N)", "product($I % 4, sound($N))", "(type($M) == \"number\" and 1 or 2)",
        "rapid.math.fit($N, -1, 2, $N, $N)", "rapid.math.smoothstep(-2, 3, $N)", "rapid.math.clamp($N, -1, 1)" },
  I = { "($I + $I)", "($I - $I)", "($I * $I)", "($I % 7)", "($I % -3)", "($I % $I)", "(-$I)", "whole($N)",
        "math.floor($N)", "math.abs($I)", "($B and $I or $I)", "mixed($I, $I)" },
  V = { "($V + $V)", "($V - $V)", "($V * $N)", "($N * $V)", "($V * $V)", "($V / $N)", "(-$V)", "$V:normalized()",
        "$V:cross($V)", "$V:lerp($V, $N)", "($B and $V or $V)", "vec3($N, $N, $N)", "vec3(three($V))",
        "$Q:rotate($V)", "vec3(passed($N, three($V)))", "sound3($V)" },
  Q = { "($Q * $Q)", "$Q:normalized()", "$Q:inverse()", "$Q:slerp($Q, $N)", "($B and $Q or $Q)",
        "quat($N, $N, $N, $N)", "rapid.math.rotation($V + vec3(0, 97, 0), $N)", "sound4($Q)" },
  B = { "($N < $N)", "($N <= $N)", "($N > $N)", "($N >= $N)", "($N == $N)", "($I == $I)", "($N ~= $N)", "($V == $V)",
        "($V == $Q)", "($Q ~= $Q)", "(not $B)", "($B and $B)", "($B or $B)", "($M == nil)", "($M == $M)", "(not $M)",
        "(type($M) == \"number\")", "($B == $B)", "($M == false)" },
  T = { "($B and $T or $T)", "type($M)" },
  X = { "$V", "$Q", "($B and $X or $X)" },
  M = { "$N", "$V", "$Q", "$B", "$T", "$X", "($B and $M or $M)", "($M or $M)", "($M and $M)", "($B and $M)" },
  F = { "($B and $F or $F)" },
  G = { "($B and $G or $G)" },
  pointwise = {
    N = { "($F)($N)", "select(2, $M, $N)", "rapid.math.noise($V)", "({ $N, $N })[2]", "(pcall(sound, $M) and 1 or 2)",
          "(\"3\" + $N)", "math.fmod($N, 3)", "math.deg($N)", "(math.modf($N))", "p[$B and \"f\" or \"g\"]" },
    I = { "#$T", "bit.band($I, 255)", "bit.bor($I, $I)", "bit.bxor($I, $I)", "bit.bnot($I)", "bit.lshift($I, 3)",
          "bit.rshift($I, $I)", "bit.arshift($I, 2)", "bit.rol($I, $I)", "bit.bswap($I)", "bit.tobit($N)",
          "bit.band($N, $N)" },
    V = { "rapid.math.curl_noise($V)" },
    B = { "($T == $T)", "($T ~= $T)", "($T < $T)", "rawequal($B, $B)" },
    T = { "($T .. $T)", "($T .. $I)", "($T):sub(1, 2)", "($T):upper()" },
    X = { "{ x = $N, y = 2 }" },
    F = { "function(x) return x * $N end" },
  },
}

-- Expressions that are valid everywhere.
templates.plain = { N = "0.5", I = "2", V = "tint", Q = "spin", B = "on", T = "word", X = "shared", M = "nil",
                    F = "sound", G = "\"a\"" }

local stores = {
  "p.f = sound($N)", "p.f = sound($N)", "p.g = sound($N)", "p.v = sound3($V)", "p.Cd = sound3($V)", "p.P = sound3($V)",
  "p.orient = sound4($Q)", "p.turn = sound4($Q)", "p.instance = whole($N)", "p.instance = whole($I)",
  "p.parent = whole($N)", "p.hittotal = whole($I)", "p.mass = 0.1 + math.abs(sound($N))", "p[which] = sound($N)",
  "p.instance = sound($N) * 0", "p.parent = sound($N) * -0.0 p.g = math.atan2(p.parent, -1)",
  "p.instance = sound($N) * -0.0 p.f = p.instance", "p.f = p.instance", "p.f = p.f", "p.f = sound(($X).x)",
  "p.pscale = sound($N)", "p[\"g\"] = sound($N)",
  pointwise = { "p.name = $T", "p[$B and \"f\" or \"g\"] = sound($N)" },
}

-- Statements that may raise an error.
templates.risky = {
  "p.f = $N", "p.v = $V", "p.instance = $N", "p.parent = $I", "p.instance = $I", "p.f = $M", "p.orient = $Q",
  "p.Cd = $X", "p.v = $M", "p.name = $M", "p.f = ($M).x", "p.f = sound($M + $N)", "p.v.x = $N", "p.f = ($V).q",
  "p.f = ($X).z", "p.instance = 2147483648", "p.parent = $N * 1e300", "p.axis = $V", "frame.time = 1", "p:rand($M)",
  "p.f = rapid.math.fit($N, zero, minus_zero, 1, 2)", "if p.id == $I then error(word) end",
  "if p.id == $I then error(shared) end",
}

-- Statements that store a value depending on %s, a variable.
templates.observations = {
  N = "p.f = sound(p.f * 0.5 + %s)", I = "p.g = sound(p.g - %s * 0.25)", V = "p.Cd = sound3(p.Cd + %s)",
  Q = "p.turn = sound4(%s * p.turn)", B = "if %s then p.g = p.g + 1 end", T = "if %s == \"a\" then p.g = 3 end",
  X = "p.g = sound(p.g - (%s).x)", M = "if type(%s) == \"number\" then p.g = 4 elseif %s then p.g = 5 end",
  F = "p.f = sound(%s(p.f))",
}

local function joined(list, further)
  local all = {}
  for _, each in ipairs { list, further } do
    for _, template in ipairs(each) do all[#all + 1] = template end
  end
  return all
end

-- Returns a function that takes only_lanes and returns the lists by kind.
local function by_kind(lists)
  local found = { [true] = {}, [false] = {} }
  for kind in pairs(templates.plain) do
    found[true][kind] = lists[kind]
    found[false][kind] = joined(lists[kind], lists.pointwise[kind] or {})
  end
  return function(only_lanes) return found[only_lanes] end
end
templates.atoms, templates.composed = by_kind(atoms), by_kind(composed)

local all_stores = { [true] = stores, [false] = joined(stores, stores.pointwise) }
function templates.stores(only_lanes) return all_stores[only_lanes] end

-- Special and ordinary values of all types, for the points of a scene.
templates.points = [[
local list = { P = {}, v = {}, Cd = {}, f = {}, orient = {}, instance = {}, name = {} }
local values = { 0, -0, 1, -1, 0.5, -2.25, 3, 1e-45, -1e-40, 0.1, 7, 1e5, -3e38, 3.4e38, 16777217, 1.5, -0.75, 2 }
local whole_values = { 0, 1, -1, 2, 3, 7, -8, 255, 65536, 2147483647, -2147483648, 12 }
for i = 1, size do
  local function value(k) return values[(i * k + k) % #values + 1] end
  list.P[i] = { i % 7 - 3, (i * 5) % 11 * 0.5 - 2, (i * 3) % 4 }
  list.v[i] = { (i * 13) % 17 * 0.25 - 2, 0.5, i % 3 - 1 }
  list.Cd[i], list.f[i] = { value(5), value(7), value(11) }, value(1)
  list.orient[i] = { 0, i % 2, 0, i % 5 * 0.25 }
  list.instance[i], list.name[i] = whole_values[i * 5 % #whole_values + 1], i % 3 == 0 and "a" or "leaf"
end
]]

-- The first nodes after the points.
templates.graph = [[
  :attribute { f = 0.5, g = -1.5, Cd = {1, 1, 1}, axis = {0, 1, 0}, turn = {0, 0, 0, 1}, orient = {0, 0, 0, 1},
               instance = 3, attributes = { name = "a" } }
  :detail("sum", function(points, frame)
      points.detail.mean, points.detail.middle = #points * 0.01, vec3(1, #points, 0)
      points.detail.mood = frame.number % 2 == 0 and 4 or vec3(7, 8, 9)
    end)
  :group { name = "a", where = function(p) return p.id % 3 == 0 end }]]

-- The first lines of kernels, by their position in the chain.
templates.openings = {
  points = "  :points { name = \"k%d\", reads = names, writes = names, kernel = function(p, frame)",
  vararg = "  :points { name = \"k%d\", reads = names, writes = names, kernel = function(...) local p, frame = ...",
  group = "  :points { name = \"k%d\", group = \"a\", reads = names, writes = names, kernel = function(p, frame)",
  action = "  :action { name = \"k%d\", reads = names, writes = names, kernel = function(p, step)",
  delete = "  :delete { name = \"k%d\", where = function(p)",
  node = "  :knob%d { name = \"k%d\", strength = function(f) return f.number - 2.5 end, "
    .. "active = function(f) return f.number == 2 end }",
}

-- The file of a node with a kernel, for string.format: its functions, its number, the body of the kernel.
templates.node = [[
local rapid = require "rapid"
%s
return rapid.node {
  name = "knob%d", doc = "A random kernel.",
  params = {
    strength = { "float", default = 1, doc = "a number" }, count = { "int", default = 4, doc = "a whole number" },
    axis = { "vec3", default = {0, 1, 0}, doc = "a vector" }, active = { "bool", default = true, doc = "a flag" },
    kind = { "string", default = "leaf", doc = "a string" }, list = { "floats", default = {1, 2, 3}, doc = "numbers" },
  },
  points = function(p, frame, params)
%s
  end,
}
]]

return templates
