-- Motions that Rapid calls exact, compared with closed forms over random scenes: drags and springs that the advice
-- reports as treated exactly, springs to planes, quadratic drag alone, balls that bounce on planes, and points that
-- slide on them.
--   EXACT_SCENES=2000 EXACT_SEED=7 rapid test tests/solver/estimate
-- runs more scenes with another seed.
local ffi = require "ffi"
local scene = require "testing.scene"
local amount = require "tests.amount"
local lehmer = require "tests.lehmer"

local draw = lehmer.new()
local pick, chance, between, magnitude = draw.pick, draw.chance, draw.between, draw.magnitude
local scenes = amount.of("EXACT_SCENES", 20)
local seed = tonumber(os.getenv "EXACT_SEED") or 1
local fps, frames = 24, 12

-- Round values as columns and parameters of points do.
local function single(x) return tonumber(ffi.new("float[1]", x)[0]) end
local function text(x) return ("%.9g"):format(x) end
local function vector(size) return { single(between(-size, size)), single(between(-size, size)),
  single(between(-size, size)) } end
local function list(v) return ("{%s, %s, %s}"):format(text(v[1]), text(v[2]), text(v[3])) end

-- x'' = G - k x' - w2 x, G constant: returns x and v after t, from x and v, along one axis. Uses real or complex
-- roots; without a spring, the closed form of the drag.
local function moved(x, v, G, k, w2, t)
  if w2 == 0 and k == 0 then return x + v * t + G * t * t / 2 end
  if w2 == 0 then
    local decayed = -(math.exp(-k * t) - 1) / k
    if k * t < 1e-3 then decayed = t * (1 - k * t / 2 * (1 - k * t / 3 * (1 - k * t / 4))) end
    local final = G / k
    return x + final * t + (v - final) * decayed
  end
  local rest, D = G / w2, k * k / 4 - w2
  local y = x - rest
  if D < 0 then
    local w = math.sqrt(-D)
    return rest + math.exp(-k * t / 2) * (y * math.cos(w * t) + (v + k / 2 * y) / w * math.sin(w * t))
  end
  local fast = -(k / 2 + math.sqrt(D))
  local slow = w2 / fast
  local a = (v - fast * y) / (slow - fast)
  return rest + a * math.exp(slow * t) + (y - a) * math.exp(fast * t)
end

-- Returns the nodes of a scene of linear forces, and their sum for a point: G, k and w2, with w2q included in G.
local function linear_forces(points)
  local nodes, parts = {}, {}
  for _ = 1, pick { 1, 2, 3, 4 } do
    local kind = pick { "gravity", "wind", "drag", "drag", "spring", "spring" }
    local own = chance(0.3)
    local function rate(low, high)
      if own then return 'rapid.attr "own"', function(p) return p.own end end
      local k = single(magnitude(low, high))
      return text(k), function() return k end
    end
    if kind == "gravity" then
      local g = vector(10)
      nodes[#nodes + 1] = (":gravity { g = %s }"):format(list(g))
      parts[#parts + 1] = function() return g, 0, 0 end
    elseif kind == "wind" then
      local u, name, k = vector(10), rate(-2, 3)
      nodes[#nodes + 1] = (":wind { velocity = %s, drag = %s }"):format(list(u), name)
      parts[#parts + 1] = function(p) return { k(p) * u[1], k(p) * u[2], k(p) * u[3] }, k(p), 0 end
    elseif kind == "drag" then
      local name, k = rate(-2, 4)
      nodes[#nodes + 1] = (":drag { linear = %s }"):format(name)
      parts[#parts + 1] = function(p) return { 0, 0, 0 }, k(p), 0 end
    else
      local name, stiffness = rate(-2, 5)
      local damping, at = chance(0.5) and single(magnitude(-2, 3)) or 0, vector(1)
      local each = chance(0.3)
      nodes[#nodes + 1] = (":spring { stiffness = %s, damping = %s, target = %s }"):format(name, text(damping),
        each and 'rapid.attr "home"' or list(at))
      parts[#parts + 1] = function(p)
        local q, w2 = each and p.home or at, stiffness(p) / p.mass
        return { w2 * q[1], w2 * q[2], w2 * q[3] }, damping / p.mass, w2
      end
    end
  end
  for _, p in ipairs(points) do
    p.G, p.k, p.w2 = { 0, 0, 0 }, 0, 0
    for _, part in ipairs(parts) do
      local G, k, w2 = part(p)
      for axis = 1, 3 do p.G[axis] = p.G[axis] + G[axis] end
      p.k, p.w2 = p.k + k, p.w2 + w2
    end
  end
  return table.concat(nodes, " ")
end

local function columns(points, names)
  local parts = {}
  for _, name in ipairs(names) do
    local values = {}
    for i, p in ipairs(points) do values[i] = type(p[name]) == "table" and list(p[name]) or text(p[name]) end
    parts[#parts + 1] = ("%s = {%s}"):format(name, table.concat(values, ", "))
  end
  return "points = rapid.points.from { " .. table.concat(parts, ", ") .. " }"
end

local function some_points(speed)
  local points = {}
  for i = 1, 8 do
    points[i] = { P = vector(1), v = vector(speed), mass = single(magnitude(-1, 1)), home = vector(1),
      own = single(magnitude(-1, 3)) }
  end
  return points
end

describe(("random scenes (%d of seed %d)"):format(scenes, seed), function()
  it("whose drags and springs are told to be treated exactly are where a closed form has them", function()
    local reported, faults = 0, {}
    for number = 1, scenes do
      draw.start(seed, number)
      local points = some_points(magnitude(-1, 1))
      local source = ("return rapid.create { fps = %d, %s } %s :solve { substeps = %d }"):format(fps,
        columns(points, { "P", "v", "mass", "home", "own" }), linear_forces(points), pick { 1, 1, 2, 5 })
      local check = scene.command("check", source)
      assert.equal(0, check.status, check.stderr)
      assert.falsy(check.stdout:find("solved in closed form, with", 1, true), source)
      if check.stdout:find("treated exactly", 1, true) then reported = reported + 1 end
      local set = scene.run(source, { frames = {1 + frames, 1 + frames} })[1 + frames]
      for i, p in ipairs(points) do
        local D = p.k * p.k / 4 - p.w2
        -- Near critical damping, the roots of this closed form cancel.
        if p.w2 == 0 or math.abs(D) > 1e-3 * p.w2 then
          local x, off, size = set[i].P, 0, 0
          for axis, name in ipairs { "x", "y", "z" } do
            local expected = moved(p.P[axis], p.v[axis], p.G[axis], p.k, p.w2, frames / fps)
            off, size = math.max(off, math.abs(x[name] - expected)), math.max(size, math.abs(expected), 1)
          end
          -- The rounding of P and v in each frame, for a motion that may turn within it.
          if off > frames * 2 ^ -22 * (size + p.v[1] ^ 2 ^ 0.5) then
            faults[#faults + 1] = ("scene %d: point %d is off by %g m\n%s"):format(number, i - 1, off, source)
          end
        end
      end
    end
    assert.equal("", table.concat(faults, "\n"))
    assert.truthy(reported > scenes / 3, reported)
  end)

  -- Returns a unit vector, and single-precision components of its direction.
  local function direction()
    local n = vector(1)
    n[2] = single(between(0.5, 2))
    local all = vec3(unpack(n))
    return all:normalized(), list(n), all:length()
  end
  local function as_vec3(v) return vec3(v[1], v[2], v[3]) end
  -- Compares the positions in a scene's last frame with the expected ones: expected(p).
  local function compare(source, points, expected, number, faults)
    local set = scene.run(source, { frames = {1 + frames, 1 + frames} })[1 + frames]
    for i, p in ipairs(points) do
      local P = expected(p)
      local off, size = (set[i].P - P):length(), math.max(1, P:length(), as_vec3(p.v):length())
      if off > frames * 2 ^ -21 * size or off ~= off then
        faults[#faults + 1] = ("scene %d: point %d is off by %g m\n%s"):format(number, i - 1, off, source)
      end
    end
  end

  it("of springs to planes, with weight and drag, are where a closed form has them", function()
    local faults = {}
    for number = 1, scenes do
      draw.start(seed, number)
      local n, normal, length = direction()
      local points, g, offset = some_points(magnitude(-1, 1)), vector(10), single(between(-1, 1))
      local k, stiffness, damping = single(magnitude(-2, 2)), single(magnitude(-2, 4)), single(magnitude(-2, 1))
      local source = ("return rapid.create { fps = %d, %s } :gravity { g = %s } :drag { linear = %s } :spring { "
        .. "target = rapid.shape.plane { normal = %s, offset = %s }, stiffness = %s, damping = %s } "
        .. ":solve { substeps = %d }"):format(fps, columns(points, { "P", "v", "mass" }), list(g), text(k), normal,
        text(offset), text(stiffness), text(damping), pick { 1, 1, 2, 5 })
      compare(source, points, function(p)
        local P, v, G, t = as_vec3(p.P), as_vec3(p.v), as_vec3(g), frames / fps
        local drag, w2 = k + damping / p.mass, stiffness / p.mass
        local d = n:dot(P) - offset / length
        local height = moved(d, n:dot(v), n:dot(G), drag, w2, t)
        local along = v - n * n:dot(v)
        local pull = G - n * n:dot(G)
        local one = moved(0, 1, 0, drag, 0, t)
        return P + n * (height - d) + along * one + pull * moved(0, 0, 1, drag, 0, t)
      end, number, faults)
    end
    assert.equal("", table.concat(faults, "\n"))
  end)

  it("of quadratic drag alone are where the logarithm has them", function()
    local faults = {}
    for number = 1, scenes do
      draw.start(seed, number)
      local points, c = some_points(magnitude(-2, 5)), single(magnitude(-6, 6))
      local source = ("return rapid.create { fps = %d, %s } :drag { quadratic = %s } :solve { substeps = %d }"):format(
        fps, columns(points, { "P", "v" }), text(c), pick { 1, 1, 2, 5 })
      compare(source, points, function(p)
        local v = as_vec3(p.v)
        local x = c * v:length() * frames / fps
        local way = x < 1e-5 and v:length() * frames / fps * (1 - x / 2) or math.log(1 + x) / c
        return as_vec3(p.P) + v:normalized() * way
      end, number, faults)
    end
    assert.equal("", table.concat(faults, "\n"))
  end)

  it("of points that slide down a plane are where friction has them", function()
    local faults = {}
    for number = 1, scenes do
      draw.start(seed, number)
      local n, normal, length = direction()
      local points, offset = some_points(1), single(between(-1, 1))
      local g = single(between(1, 30))
      local down = vec3(0, -1, 0) + n * n.y
      local friction = single(down:length() / n.y * draw.random())
      for _, p in ipairs(points) do
        local P = as_vec3(p.P)
        P = P - n * (n:dot(P) - offset / length)
        local v = down:normalized() * between(0, 3)
        for axis, name in ipairs { "x", "y", "z" } do p.P[axis], p.v[axis] = single(P[name]), single(v[name]) end
      end
      local source = ("return rapid.create { fps = %d, %s } :gravity { g = {0, %s, 0} } :collide { bounce = 0, "
        .. "friction = %s, shape = rapid.shape.plane { normal = %s, offset = %s } } :solve { substeps = %d }"):format(
        fps, columns(points, { "P", "v" }), text(-g), text(friction), normal, text(offset), pick { 1, 1, 2, 5 })
      compare(source, points, function(p)
        local t = frames / fps
        local a = g * (down:length() - friction * n.y)
        return as_vec3(p.P) + as_vec3(p.v) * t + down:normalized() * (a * t * t / 2)
      end, number, faults)
    end
    assert.equal("", table.concat(faults, "\n"))
  end)

  it("of balls that bounce on a plane are where parabolas between impacts have them", function()
    local faults, compared = {}, 0
    for number = 1, scenes do
      draw.start(seed, number)
      local n, g, radius = vector(1), vector(3), chance(0.5) and single(between(0, 0.2)) or 0
      n[2], g[2] = single(between(1, 3)), single(-between(5, 15))
      local length = math.sqrt(n[1] ^ 2 + n[2] ^ 2 + n[3] ^ 2)
      local function height(v) return (n[1] * v[1] + n[2] * v[2] + n[3] * v[3]) / length end
      local bounce, offset, points = single(pick { 1, between(0.5, 1) }), single(between(-1, 1)), some_points(2)
      for _, p in ipairs(points) do
        local above = offset / length + radius + between(0.3, 2) - height(p.P)
        for axis = 1, 3 do p.P[axis] = single(p.P[axis] + above * n[axis] / length) end
      end
      local source = ("return rapid.create { fps = %d, %s } :gravity { g = %s } :collide { radius = %s, bounce = %s, "
        .. "shape = rapid.shape.plane { normal = %s, offset = %s } } :solve {}"):format(fps,
        columns(points, { "P", "v" }), list(g), text(radius), text(bounce), list(n), text(offset))
      local set = scene.run(source, { frames = {1 + frames, 1 + frames} })[1 + frames]
      for i, p in ipairs(points) do
        local surface = offset / length + radius
        local along = frames / fps
        local y, v, a, left, slowest = height(p.P) - surface, height(p.v), height(g), along, 1
        while true do
          local hit = (-v - math.sqrt(v * v - 2 * a * y)) / a
          if hit >= left then break end
          v, y, left = -bounce * (v + a * hit), 0, left - hit
          slowest = math.min(slowest, v)
        end
        y = y + v * left + a * left * left / 2
        local off = math.abs(height { set[i].P.x, set[i].P.y, set[i].P.z } - surface - y)
        for axis, name in ipairs { "x", "y", "z" } do -- along the plane only g acts
          local free = p.P[axis] + p.v[axis] * along + g[axis] * along ^ 2 / 2
          local slid = free - n[axis] / length * (height { p.P[1] + p.v[1] * along + g[1] * along ^ 2 / 2,
            p.P[2] + p.v[2] * along + g[2] * along ^ 2 / 2, p.P[3] + p.v[3] * along + g[3] * along ^ 2 / 2 })
          local P = { set[i].P.x, set[i].P.y, set[i].P.z }
          off = math.max(off, math.abs(set[i].P[name] - n[axis] / length * height(P) - slid))
        end
        if slowest > 0.2 then
          compared = compared + 1
          if off > 3e-5 then
            faults[#faults + 1] = ("scene %d: point %d is off by %g m\n%s"):format(number, i - 1, off, source)
          end
        end
      end
    end
    assert.equal("", table.concat(faults, "\n"))
    assert.truthy(compared > 4 * scenes, compared)
  end)
end)
