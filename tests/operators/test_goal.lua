-- :goal against its cubic.
local scene = require "testing.scene"

local function run(body, options)
  return scene.run([[
local P, goal, v = {}, {}, {}
for k = 1, 60 do
  P[k], goal[k], v[k] = {k / 10, 0, 1}, {0, k / 7, -2}, {0.1 * k, -3, 1}
end
return rapid.create { fps = 20, points = rapid.points.from { P = P, v = v, goal = goal } }
  ]] .. body, options)
end

local function assert_arrived(points, tolerance)
  for i = 1, #points do
    assert.near(points[i].goal, points[i].P, tolerance)
    assert.near({0, 0, 0}, points[i].v, 20 * tolerance)
  end
end

describe("goal", function()
  it("follows the cubic from the first velocity to rest, at any number of sub-steps", function()
    for _, substeps in ipairs { 1, 7 } do
      local result = run((":goal { to = rapid.attr 'goal', time = 2 } :solve { substeps = %d }"):format(substeps),
        { frames = {1, 60} })
      for f = 2, 41 do
        local u = (f - 1) / 40
        for _, i in ipairs { 1, 17, 60 } do
          local a, p = result[1][i], result[f][i]
          assert.near(a.P + (a.goal - a.P) * (u * u * (3 - 2 * u)) + a.v * (2 * u * (1 - u) ^ 2), p.P, 2e-5)
          assert.near((a.goal - a.P) * (6 * u * (1 - u) / 2) + a.v * ((1 - u) * (1 - 3 * u)), p.v, 2e-4)
        end
      end
      assert_arrived(result[41], 1e-5)
      assert_arrived(result[60], 1e-5)
    end
  end)

  it("arrives whatever was done to the point before, and of any mass", function()
    local result = run([[
:attribute { mass = 3 }
  :points("push", function(p, frame) if frame.time < 1.8 then p.force = p.force + vec3(30, -40, 20) end end)
  :goal { to = rapid.attr "goal", time = 2 } :solve {}]], { frames = {1, 41} })
    local alone = run(":goal { to = rapid.attr 'goal', time = 2 } :solve {}", { frames = {20, 20} })
    assert.is_true((result[20][1].P - alone[20][1].P):length() > 0.05)
    assert_arrived(result[41], 1e-4)
  end)

  it("begins at `start`, ends within a frame, and lets go where it does not hold", function()
    local result = run(":goal { to = rapid.attr 'goal', start = 0.5, time = 0.98, hold = false } " ..
      ":gravity { group = 'late' } :group " ..
      "{ name = 'late', where = function(p) return p.age > 1.49 end } :solve {}", { frames = {1, 41} })
    local a = result[1][5]
    assert.near(a.P + a.v * 0.5, result[11][5].P, 1e-5) -- free until then
    assert_arrived(result[31], 1e-5)
    assert.near(result[31][5].P.y - 9.81 * 0.5 ^ 2 / 2, result[41][5].P.y, 0.3)
    assert.is_true(result[41][5].v.y < -4)
  end)

  it("staggers points: none is late, and not all are there at once", function()
    local result = run(":goal { to = rapid.attr 'goal', time = 1, stagger = 1 } :solve {}", { frames = {1, 41} })
    assert_arrived(result[41], 1e-5)
    local there = 0
    for i = 1, 60 do
      if (result[31][i].P - result[31][i].goal):length() < 1e-4 then there = there + 1 end
    end
    assert.is_true(there > 15 and there < 45)
  end)

  it("counts the time from birth if requested", function()
    local result = scene.run([[
return rapid.create { fps = 20 }
  :emit { source = rapid.points.from { P = {{1, 2, 3}} }, rate = 70, attributes = { goal = {4, 5, 6} } }
  :goal { to = rapid.attr "goal", clock = "age", start = 0.2, time = 0.5 } :solve {}]], { frames = {1, 30} })
    local there = 0
    for i = 1, #result[30] do
      local p = result[30][i]
      if p.age >= 0.75 then
        there = there + 1
        assert.near({4, 5, 6}, p.P, 1e-4)
      elseif p.age < 0.2 then
        assert.near({1, 2, 3}, p.P, 0)
      end
    end
    assert.is_true(there > 40)
  end)

  it("needs a target, and the attribute", function()
    local reported = scene.error("return rapid.create { points = two } :goal { to = rapid.attr 'goal' } :solve {}")
    assert.truthy(reported:find('no attribute "goal"', 1, true), reported)
    reported = scene.error("return rapid.create { points = two } :goal {} :solve {}")
    assert.truthy(reported:find("to is missing", 1, true) or reported:find('"to" is missing', 1, true), reported)
    for to, message in pairs {
      ["rapid.shape.sphere {}"] = 'by = "id": ',
      ["rapid.points.from { P = {} }"] = "there are no points to go to",
      ["rapid.translate(1, 0, 0)"] = "can't be a target; it must be a mesh, a shape, points or rapid.attr",
      ["3"] = "to = 3",
    } do
      reported = scene.error(("return rapid.create { points = two } :goal { to = %s } :solve {}"):format(to))
      assert.truthy(reported:find(message, 1, true), reported)
    end
  end)
end)

-- Nine points to six positions, with the positions of frame 4 at 0.3 s.
local function to_points(by, more)
  return scene.run(([[
local P, Q = {}, {}
for k = 1, 9 do P[k] = {k, 0, 0} end
for k = 1, 6 do Q[k] = {0, k, 0} end
return rapid.create { fps = 10, points = rapid.points.from { P = P } }
  :goal { to = rapid.points.from { P = Q } %s, by = "%s", time = 0.3 } :solve {}]]):format(more or "", by),
    { frames = {1, 6} })
end

describe("goal, to points", function()
  it("by id: the point of its id, and again from the first", function()
    local result = to_points "id"
    for i = 1, 9 do
      for _, f in ipairs { 4, 6 } do
        assert.near({0, (i - 1) % 6 + 1, 0}, result[f][i].P, 1e-5)
        assert.near({0, 0, 0}, result[f][i].v, 1e-4)
      end
    end
  end)

  it("by id: uses the ids of the target points", function()
    scene.folder:write("places.csv", "id,Px,Py,Pz\n1,5,5,5\n0,6,6,6\n")
    local result = scene.run([[
return rapid.create { fps = 10, points = two } :goal { to = rapid.points.read "places.csv", time = 0.1 } :solve {}]])
    assert.near({6, 6, 6}, result[2][1].P, 1e-5)
    assert.near({5, 5, 5}, result[2][2].P, 1e-5)
  end)

  it("at random: shuffled, each as often", function()
    local points, moved, sum = to_points "random"[4], 0, 0
    for i = 1, 6 do
      local k = points[i].P.y
      if math.abs(k - i) > 0.5 then moved = moved + 1 end
      sum = sum + 10 ^ math.floor(k + 0.5)
    end
    assert.is_true(moved > 0)
    assert.equal(1111110, sum)
  end)

  it("by the nearest: each by id the nearest that is free, and all again when all are taken", function()
    local text = [[
local random, Q = rapid.points.grid { size = {1, 1, 1}, spacing = 0.14 }, {}
for k = 1, 90 do Q[k] = {(k * 0.6180339) % 1, (k * 0.7548776) % 1, (k * 0.5698402) % 1} end
return rapid.create { fps = 10, points = random }
  :goal { to = rapid.points.from { P = Q }, by = "nearest", time = 0.5 } :solve {}]]
    local result = scene.run(text, { frames = {1, 6} })
    local P, there, free = result[1], result[6], {}
    assert.is_true(#P > 250)
    for i = 1, #P do
      if #free == 0 then
        for k = 1, 90 do
          free[k] = { k = k, P = vec3((k * 0.6180339) % 1, (k * 0.7548776) % 1, (k * 0.5698402) % 1) }
        end
      end
      local best, least = 1, math.huge
      for k, place in ipairs(free) do
        local d = (place.P - P[i].P):length()
        if d < least - 1e-7 then best, least = k, d end
      end
      assert.near(free[best].P, there[i].P, 1e-5)
      assert.equal(free[best].k - 1, there[i].goalnum)
      table.remove(free, best)
    end
  end)

  it("by the nearest: a point keeps its target, and later ones take free targets or those of dead points", function()
    local result = scene.run([[
local places = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}} }
return rapid.create { fps = 10 }
  :emit { source = rapid.points.from { P = {{0.1, 1, 0}} }, birth = "end", impulse = { [2] = 1, [4] = 1, [6] = 1 } }
  :delete { where = function(p, frame) return frame.number == 6 and p.id == 0 end }
  :goal { to = places, by = "nearest", time = 5 } :solve {}]], { frames = {1, 8} })
    assert.equal(0, result[3]:by_id(0).goalnum)
    assert.equal(0, result[5]:by_id(0).goalnum)
    assert.equal(1, result[5]:by_id(1).goalnum)
    assert.equal(0, result[8]:by_id(2).goalnum)
    assert.equal(1, result[8]:by_id(1).goalnum)
  end)

  it("that move, by a motion or as a function of the frame, and arrives where they are then", function()
    local result = to_points("id", ":transform(function(frame) return rapid.translate(frame.time, 0, 0) end)")
    for i = 1, 9 do assert.near({0.3, (i - 1) % 6 + 1, 0}, result[4][i].P, 1e-5) end
    for i = 1, 9 do assert.near({0.5, (i - 1) % 6 + 1, 0}, result[6][i].P, 1e-5) end
    result = scene.run([[
return rapid.create { fps = 10, points = two }
  :goal { to = function(frame) return rapid.points.from { P = {{frame.time, 2, 0}} } end, time = 0.1 } :solve {}]])
    for i = 1, 2 do assert.near({0.2, 2, 0}, result[3][i].P, 1e-5) end
  end)
end)

describe("goal, to a surface", function()
  local function to(shape, by, more)
    return scene.run(([[
return rapid.create { fps = 10, points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.5 } }
  :goal { to = %s, by = "%s", time = 0.4 } %s :solve {}]]):format(shape, by, more or ""), { frames = {1, 6} })
  end

  it("by id: to the vertices of a mesh in their order", function()
    local result = scene.run([[
return rapid.create { fps = 10, points = two }
  :goal { to = rapid.mesh.from { points = {{3, 0, 0}, {0, 4, 0}, {0, 0, 5}}, faces = {{1, 2, 3}} }, time = 0.1 }
  :solve {}]])
    assert.near({3, 0, 0}, result[2][1].P, 1e-5)
    assert.near({0, 4, 0}, result[2][2].P, 1e-5)
  end)

  it("at random: evenly over the surface of a mesh or shape", function()
    for _, shape in ipairs { "rapid.mesh.box { size = {2, 2, 2} }", "rapid.shape.box { size = {2, 2, 2} }" } do
      local points, on = to(shape, "random")[5], 0
      for i = 1, #points do
        local P = points[i].P
        local x, y, z = math.abs(P.x), math.abs(P.y), math.abs(P.z)
        assert.near(1, math.max(x, y, z), 1e-5)
        if P.y > 1 - 1e-5 then on = on + 1 end
      end
      -- A sixth of 216, within four standard deviations.
      assert.near(#points / 6, on, 4 * math.sqrt(#points * 5 / 36))
    end
  end)

  it("by the nearest: straight to it, from outside and inside", function()
    local result = to("rapid.shape.sphere { radius = 0.5, center = {0.03, 0.01, 0.02} }", "nearest")
    local center = vec3(0.03, 0.01, 0.02)
    for i = 1, #result[1] do
      local way = (result[1][i].P - center):normalized()
      assert.near(center + way * 0.5, result[5][i].P, 1e-4)
    end
    result = to("rapid.mesh.box { size = {2, 2, 2} }", "nearest")
    for i = 1, #result[1] do
      local P = result[1][i].P
      if math.max(math.abs(P.x), math.abs(P.y), math.abs(P.z)) > 1 then
        local clamp = function(x) return math.max(-1, math.min(1, x)) end
        assert.near({clamp(P.x), clamp(P.y), clamp(P.z)}, result[5][i].P, 1e-4)
      end
    end
  end)

  it("that moves: each point keeps its position on it", function()
    local moving = ":transform { [1] = rapid.translate(0, 0, 0), " ..
      "[11] = rapid.translate(0, 2, 0) * rapid.rotate({0, 1, 0}, 90) }"
    for _, shape in ipairs { "rapid.mesh.box { size = {2, 2, 2} }", "rapid.shape.box { size = {2, 2, 2} }" } do
      local rest, result = to(shape, "random"), to(shape .. moving, "random")
      for _, f in ipairs { 5, 6 } do
        local turn = math.rad(90) * (f - 1) / 10
        for i = 1, #rest[5] do
          local P, Q = rest[5][i].P, result[f][i].P
          local x, z = math.cos(turn) * P.x + math.sin(turn) * P.z, math.cos(turn) * P.z - math.sin(turn) * P.x
          assert.near({x, P.y + 0.2 * (f - 1), z}, Q, 2e-4)
        end
      end
      for i = 1, #result[6] do -- points that have arrived move with the target, at its velocity
        assert.near((result[6][i].P - result[5][i].P) * 10, result[6][i].v, 1e-4)
        assert.near({0, 0, 0}, result[5][i].v, 1e-4)
      end
    end
  end)

  it("gives the same bits on any number of threads, and goes on from snapshots", function()
    local text = [[
return rapid.create { seed = 4 } :emit { source = rapid.mesh.sphere { radius = 2 }, rate = 20000 }
  :goal { to = rapid.points.grid { size = {1, 1, 1}, spacing = 0.05 }, by = "nearest", time = 0.3, stagger = 0.1 }
  :solve {}]]
    assert.same_points(scene.run(text, { frames = {1, 8}, threads = 1 })[8],
      scene.run(text, { frames = {1, 8}, threads = 3 })[8])
    for _, arguments in ipairs { "-f 1-8 -o whole.####.bgeo", "-f 1-4 --cache c -o part.####.bgeo",
      "-f 1-8 --cache c -o part.####.bgeo" } do
      local result = scene.command("run", text, arguments)
      assert.equal(0, result.status, result.stderr)
    end
    local command = require "testing.command"
    assert.equal(0, command.shell("cmp whole.0008.bgeo part.0008.bgeo", { cwd = scene.folder.path }).status)
  end)

  it("ends the errors of the points that it holds", function()
    local text = [[
return rapid.create { fps = 24, points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2 } }
  :turbulence { amplitude = 8, size = 0.4 } :goal { to = rapid.points.grid { size = {1, 1, 1}, spacing = 0.1 },
    by = "random", start = 1, time = 0.5 } :solve { substeps = %d }]]
    local result = scene.command("run", text:format(1), "-f 1-72 --quiet --stats stats.json")
    assert.equal(0, result.status, result.stderr)
    local frames = require "dkjson".decode(scene.folder:read "stats.json").frames
    local function last(substeps) return scene.run(text:format(substeps), { frames = {72, 72} })[72] end
    local coarse, fine = last(1), last(64)
    local real = 0
    for i = 1, #coarse do real = math.max(real, (coarse[i].P - fine[i].P):length()) end
    local reported = frames[72].error.position_max
    assert.truthy(frames[24].error.position_max > 10 * real) -- before the points have arrived
    assert.truthy(reported < 4 * real and reported > real / 4,
      ("%g m is reported, %g m is true"):format(reported, real))
  end)

  it("follows the clock in a chain without a solve, too", function()
    local result = scene.run([[
return rapid.create { fps = 20, points = rapid.points.from { P = {{0, 0, 0}}, v = {{1, 0, 0}}, goal = {{0, 1, 0}} } }
  :goal { to = rapid.attr "goal", time = 0.2, hold = false }]], { frames = {1, 8} })
    assert.is_true((result[2][1].v - vec3(1, 0, 0)):length() > 0.1)
    assert.near({1, 0, 0}, result[8][1].v, 0)
  end)
end)
