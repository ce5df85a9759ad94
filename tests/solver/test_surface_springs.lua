-- :spring with a shape as its target: the energy at any stiffness, the path along curved surfaces, its order.
local json = require "dkjson"
local scene = require "testing.scene"
local amount = require "tests.amount"
local lehmer = require "tests.lehmer"

local scenes, seed = amount.of("SPRING_SCENES", 20), tonumber(os.getenv "SPRING_SEED") or 1

local function run(text, last, every)
  local frames = every and {1, last} or {last, last}
  return scene.run(text, { frames = frames })
end

local function list(values) return "{" .. table.concat(values, ", ") .. "}" end
local function vector(x, y, z) return ("{%.9g, %.9g, %.9g}"):format(x, y, z) end

local draw = lehmer.new(20260801)
local function random() return draw.between(-1, 1) end

-- |φ| of the shapes below.
local distances = {
  ["rapid.shape.sphere { radius = 1 }"] = function(P) return P:length() - 1 end,
  ["rapid.shape.box { size = {2, 1, 1.5} }"] = function(P)
    local q = vec3(math.abs(P.x) - 1, math.abs(P.y) - 0.5, math.abs(P.z) - 0.75)
    local out = vec3(math.max(q.x, 0), math.max(q.y, 0), math.max(q.z, 0)):length()
    return out + math.min(math.max(q.x, q.y, q.z), 0)
  end,
  ["rapid.shape.plane { normal = {1, 2, 2}, offset = 0.3 }"] = function(P)
    return (P.x + 2 * P.y + 2 * P.z - 0.3) / 3
  end,
}

-- Returns the kinetic energy plus that of the spring and the field, J/kg.
local function energy(p, distance, k, g)
  return 0.5 * p.v:dot(p.v) + 0.5 * k * distance(p.P) ^ 2 - g * p.P.y
end

describe("a spring to a shape", function()
  it("keeps the energy of a point that goes along a sphere, and its path, at any stiffness", function()
    for _, k in ipairs { 1e2, 1e4, 1e5, 1e6, 1e7, 1e8 } do
      local result = run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 2, 0}} } }
  :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = %g } :solve {}]]):format(k), 241, true)
      for f = 2, 241 do
        local p = result[f][1]
        local all = energy(p, distances["rapid.shape.sphere { radius = 1 }"], k, 0)
        assert.near(2, all, 2e-3)
      end
      if k >= 1e6 then -- the path is a circle: u t / R, within 1/24 of the squared angle per frame
        local P, angle = result[241][1].P, 20
        assert.near({math.cos(angle), math.sin(angle), 0}, P, 0.01)
      end
    end
  end)

  it("keeps the energy of a point that it pulls through the middle of a ball, at any stiffness", function()
    for _, k in ipairs { 1e2, 1e4, 1e6, 1e8 } do
      local result = run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 3, 0}}, v = {{-1, 0.3, 2}} } }
  :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = %g } :solve {}]]):format(k), 49, true)
      local distance = distances["rapid.shape.sphere { radius = 1 }"]
      local first = energy(result[1][1], distance, k, 0)
      for f = 2, 49 do assert.near(first, energy(result[f][1], distance, k, 0), 1e-4 * first) end
    end
  end)

  it("gives no energy to points anywhere, about shapes with edges, with gravity and damping", function()
    for shape, distance in pairs(distances) do
      for _, case in ipairs { {0, 0}, {-9.81, 0}, {0, 3}, {-9.81, 30} } do
        local g, damping = case[1], case[2]
        local P, v, stiffness = {}, {}, {}
        for i = 1, 200 do
          local speed = 10 ^ (1.5 * random())
          P[i] = vector(1.5 * random(), 1.5 * random(), 1.5 * random())
          v[i] = vector(speed * random(), speed * random(), speed * random())
          stiffness[i] = ("%.9g"):format(10 ^ (4 + 4 * random()))
        end
        local result = run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = %s, v = %s, k = %s } }
  :gravity { g = {0, %g, 0} }
  :spring { target = %s, stiffness = rapid.attr "k", damping = %g } :solve {}]]):format(list(P), list(v),
          list(stiffness), g, shape, damping), 49, true)
        for i = 1, 200 do
          local first = result[1][i]
          local start = energy(first, distance, first.k, g)
          local size = math.abs(start) + 3 * math.abs(g)
          for f = 2, 49 do
            local p = result[f][i]
            -- Positions are rounded to single precision once per frame.
            local ulp = 2 ^ -23 * (math.abs(p.P.x) + math.abs(p.P.y) + math.abs(p.P.z) + 1)
            local rounding = (f - 1) * (ulp * math.sqrt(2 * first.k * size) + first.k * ulp ^ 2)
            local now = energy(p, distance, first.k, g)
            assert.truthy(now <= start + 1e-4 * size + rounding,
              ("%s, k = %g, g = %g, damping %g, frame %d: %.9g of %.9g")
                :format(shape, first.k, g, damping, f, now, start))
          end
        end
      end
    end
  end)

  it("of second order on a curved surface, with drag and gravity", function()
    -- Runge-Kutta of order 4, with a step of 1e-4 s.
    local s, c, g = 60, 1, vec3(0, -9.81, 0)
    local function pull(P, v) return g - v * c - P * (s * (P:length() - 1) / P:length()) end
    local P, v, h = vec3(1.25, 0, 0.25), vec3(0.125, 1, 0.25), 1e-4
    for _ = 1, 10000 do
      local k1, l1 = v, pull(P, v)
      local k2, l2 = v + l1 * (h / 2), pull(P + k1 * (h / 2), v + l1 * (h / 2))
      local k3, l3 = v + l2 * (h / 2), pull(P + k2 * (h / 2), v + l2 * (h / 2))
      local k4, l4 = v + l3 * h, pull(P + k3 * h, v + l3 * h)
      P = P + (k1 + k2 * 2 + k3 * 2 + k4) * (h / 6)
      v = v + (l1 + l2 * 2 + l3 * 2 + l4) * (h / 6)
    end
    local function off(substeps)
      local p = run(([[
return rapid.create { fps = 4, points = rapid.points.from { P = {{1.25, 0, 0.25}}, v = {{0.125, 1, 0.25}} } }
  :gravity {} :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = %g, damping = %g }
  :solve { substeps = %d }]]):format(s, c, substeps), 5)[5][1]
      return (p.P - P):length()
    end
    local before
    for _, substeps in ipairs { 8, 16, 32, 64 } do
      local now = off(substeps)
      if before then assert.near(4, before / now, 0.6) end
      before = now
    end
  end)

  it("is exact on a plane", function()
    for _, k in ipairs { 1e-3, 1, 1e3, 1e7 } do
      local p = run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0.5, 2}}, v = {{3, -1, 2}} } }
  :spring { target = rapid.shape.plane {}, stiffness = %g } :solve {}]]):format(k), 25)[25][1]
      local omega = math.sqrt(k)
      assert.near(4, p.P.x, 4e-6)
      assert.near(4, p.P.z, 4e-6)
      if k <= 1e3 then
        assert.near(0.5 * math.cos(omega) - math.sin(omega) / omega, p.P.y, 1e-5 * (1 + omega) / math.min(omega, 1))
      end
    end
  end)

  it("acts with others, of which the weaker ones give no energy either", function()
    local result = run([[
local P = {}
for i = 1, 20 do P[i] = {math.cos(i), 0.5 * math.sin(3 * i), math.sin(i)} end
return rapid.create { fps = 24, points = rapid.points.from { P = P } }
  :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = 1e5 }
  :spring { target = rapid.shape.plane {}, stiffness = 40 }
  :solve { substeps = 4 }]], 97, true)
    for i = 1, 20 do
      local function all(p)
        return 0.5 * p.v:dot(p.v) + 0.5e5 * (p.P:length() - 1) ^ 2 + 20 * p.P.y ^ 2
      end
      for f = 2, 97 do assert.truthy(all(result[f][i]) <= all(result[1][i]) * 1.001 + 1e-3, f) end
    end
  end)

  it("gives no energy at contacts with a shape that cuts the surface", function()
    local distance = distances["rapid.shape.sphere { radius = 1 }"]
    for _, k in ipairs { 1e2, 1e4, 1e6 } do
      local result = run(([[
return rapid.create { fps = 24, seed = 5, points = rapid.points.grid { size = {1.6, 1.3, 1.6}, spacing = 0.2 } }
  :points("stir", function(p, frame)
      if frame.number == 2 then p.v = vec3(p:rand(1) - 0.5, p:rand(2) - 0.5, p:rand(3) - 0.5) * 4 end
    end)
  :spring { target = rapid.shape.sphere { radius = 1 }, stiffness = %g }
  :collide { shape = rapid.shape.plane { offset = -0.8 }, bounce = 1 }
  :solve { substeps = 2 }]]):format(k), 73, true)
      for i = 1, #result[73] do
        local start = energy(result[1][i], distance, k, 0) + 6 -- for at most 12^(1/2) m/s
        for f = 3, 73 do
          assert.truthy(energy(result[f][i], distance, k, 0) <= start * 1.001, ("k = %g, frame %d"):format(k, f))
        end
      end
    end
  end)

  -- If shapes move uniformly, the energy is relative to them. A constant force does the work F·ΔP in a frame.
  it("gives no energy beside other forces, or by moving uniformly, in random scenes", function()
    local meshes = { ["rapid.mesh.box { size = {2, 1, 1.5} }"] = distances["rapid.shape.box { size = {2, 1, 1.5} }"] }
    local targets = {}
    for _, known in ipairs { distances, meshes } do
      for shape, distance in pairs(known) do targets[#targets + 1] = { shape = shape, distance = distance } end
    end
    table.sort(targets, function(a, b) return a.shape < b.shape end)
    for number = 1, scenes do
      draw.start(seed, number)
      local magnitude, pick, chance = draw.magnitude, draw.pick, draw.chance
      local speed = pick { 0, magnitude(-2, 1) }
      local V = vec3(speed * random(), speed * random(), speed * random())
      local along = speed > 0 and (":transform(function(f) local t = f.time return rapid.translate(%.9g * t, %.9g * t,"
        .. " %.9g * t) end)"):format(V.x, V.y, V.z) or ""
      local springs, nodes = {}, {}
      for k = 1, pick { 1, 1, 2, 3 } do
        local target = pick(targets)
        springs[k] = { k = tonumber(("%.6g"):format(magnitude(0, 8))), distance = target.distance }
        nodes[#nodes + 1] = (":spring { target = %s%s, stiffness = %.9g }"):format(target.shape, along, springs[k].k)
      end
      local g, place = pick { 0, -9.81 }, speed == 0 and chance(0.3) and magnitude(0, 6) or 0
      nodes[#nodes + 1] = (":gravity { g = {0, %.9g, 0} } :spring { stiffness = %.9g }"):format(g, place)
      if chance(0.3) then
        nodes[#nodes + 1] = (":wind { velocity = %s, drag = %.6g }"):format(vector(V.x, V.y, V.z), magnitude(-1, 3))
      end
      if speed == 0 and chance(0.3) then
        nodes[#nodes + 1] = (":drag { quadratic = %.6g }"):format(magnitude(-2, 2))
      end
      local P, v, F, push = {}, {}, {}, pick { 0, magnitude(0, 3) }
      for i = 1, 20 do
        local fast = magnitude(-1.5, 1.5)
        P[i] = vector(1.5 * random(), 1.5 * random(), 1.5 * random())
        v[i] = vector(fast * random() + V.x, fast * random() + V.y, fast * random() + V.z)
        F[i] = vector(push * random(), push * random(), push * random())
      end
      local text = ([[
return rapid.create { fps = 24, points = rapid.points.from { P = %s, v = %s, F = %s } }
  :points("push", function(p) p.force = p.F end)
  %s
  :solve { substeps = %d }]]):format(list(P), list(v), list(F), table.concat(nodes, "\n  "), pick { 1, 1, 2, 4 })
      local result, time = run(text, 25, true), 0
      local function all(p)
        local Q, u = p.P - V * time, p.v - V
        local sum, slack = u:dot(u) / 2 - g * Q.y + place / 2 * Q:dot(Q), 0
        -- Positions and velocities are rounded to single precision.
        local ulp = 2 ^ -23 * (math.abs(p.P.x) + math.abs(p.P.y) + math.abs(p.P.z) + 1)
        local turned = 2 ^ -23 * (math.abs(p.v.x) + math.abs(p.v.y) + math.abs(p.v.z))
        for _, spring in ipairs(springs) do
          local d = spring.distance(Q)
          sum, slack = sum + spring.k / 2 * d ^ 2, slack + spring.k * (math.abs(d) + ulp) * ulp
        end
        return sum, slack + (turned + ulp) * u:length() + place * Q:length() * ulp
      end
      local before, work, most = {}, {}, {}
      for f = 1, 25 do
        time = (f - 1) / 24
        for i = 1, 20 do
          local p = result[f][i]
          local now, slack = all(p)
          local Q = p.P - V * time
          if f == 1 then
            before[i], work[i], most[i] = { E = now, Q = Q, slack = slack }, 0, math.abs(now)
          else
            work[i] = work[i] + p.F:dot(Q - before[i].Q)
            before[i].Q, before[i].slack = Q, before[i].slack + slack
            most[i] = math.max(most[i], math.abs(now), math.abs(work[i]))
            assert.truthy(now <= before[i].E + work[i] + 1e-4 * most[i] + before[i].slack,
              ("scene %d, point %d, frame %d: %.9g of %.9g and %.9g\n%s"):format(number, i, f, now, before[i].E,
                work[i], text))
          end
        end
      end
    end
  end)

  it("is reported as exact if it is", function()
    local function reported(shape)
      local result = scene.command("run", ([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 20, 0}} } }
  :spring { target = %s, stiffness = 1e6 } :solve {}]]):format(shape), "-f 1-6 --stats s.json")
      assert.equal(0, result.status, result.stderr)
      return json.decode(scene.folder:read "s.json").stiff, result.stdout
    end
    local stiff, text = reported "rapid.shape.plane {}"
    assert.same({ "spring1: omega dt = 41.7; treated exactly" }, stiff)
    assert.match("\nresult   all fine\n$", text)
    stiff, text = reported "rapid.shape.sphere { radius = 1 }"
    assert.equal(1, #stiff)
    -- The angle around the center.
    assert.equal("spring1: omega dt = 0.699 at 1 sub-step; estimated error 0.003 m; 4 sub-steps would give 0.001 m",
      stiff[1])
    assert.match("\nlook at  spring1 is stiff: estimated error 3%.1 mm; 4 substeps would give 1%.3 mm\n", text)
  end)
end)

describe("a stiff spring to a moving sphere, beside a plane that bounces with friction", function()
  -- The point swings with Ω d = 1.8e4 m/s. The spring turns it by 160 radians in a substep of a quarter of a frame.
  it("gains no speed from friction that turns the point", function()
    for _, bounce in ipairs { 0, 1 } do
      for _, substeps in ipairs { 1, 4, 16, 32 } do
        local result = run(([[
return rapid.create { points = rapid.points.from { P = {{1.733, 2.805, -0.401}}, mass = {2.9e-4}, pscale = {0.27} } }
  :spring { target = rapid.shape.sphere { radius = 0.87, center = {0, 1.74, 0} }
              :transform(function(f) return rapid.translate(0, 0.52 * math.sin(2.56 * f.time), 0) end),
            stiffness = 7e4 }
  :contact { spin = true } :collide { shape = rapid.shape.plane {}, bounce = %d, friction = 0.5 }
  :solve { substeps = %d }]]):format(bounce, substeps), 30, true)
        for frame = 1, 30 do assert.truthy(result[frame][1].v:length() < 2e4) end
      end
    end
  end)
end)
