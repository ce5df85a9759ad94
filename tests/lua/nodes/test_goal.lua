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
      local result = run((":goal { time = 2 } :solve { substeps = %d }"):format(substeps), { frames = {1, 60} })
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
  :goal { time = 2 } :solve {}]], { frames = {1, 41} })
    local alone = run(":goal { time = 2 } :solve {}", { frames = {20, 20} })
    assert.is_true((result[20][1].P - alone[20][1].P):length() > 0.05)
    assert_arrived(result[41], 1e-4)
  end)

  it("begins at `start`, ends within a frame, and lets go where it does not hold", function()
    local result = run(":goal { start = 0.5, time = 0.98, hold = false } :gravity { group = 'late' } :group " ..
      "{ name = 'late', where = function(p) return p.age > 1.49 end } :solve {}", { frames = {1, 41} })
    local a = result[1][5]
    assert.near(a.P + a.v * 0.5, result[11][5].P, 1e-5) -- free until then
    assert_arrived(result[31], 1e-5)
    assert.near(result[31][5].P.y - 9.81 * 0.5 ^ 2 / 2, result[41][5].P.y, 0.3)
    assert.is_true(result[41][5].v.y < -4)
  end)

  it("staggers points: none is late, and not all are there at once", function()
    local result = run(":goal { time = 1, stagger = 1 } :solve {}", { frames = {1, 41} })
    assert_arrived(result[41], 1e-5)
    local there = 0
    for i = 1, 60 do
      if (result[31][i].P - result[31][i].goal):length() < 1e-4 then there = there + 1 end
    end
    assert.is_true(there > 15 and there < 45)
  end)

  it("counts from birth where it is told to", function()
    local result = scene.run([[
return rapid.create { fps = 20 }
  :emit { source = rapid.points.from { P = {{1, 2, 3}} }, rate = 70, attributes = { goal = {4, 5, 6} } }
  :goal { clock = "age", start = 0.2, time = 0.5 } :solve {}]], { frames = {1, 30} })
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

  it("needs the attribute", function()
    assert.truthy(scene.error("return rapid.create { points = two } :goal {} :solve {}")
      :find('no attribute "goal"', 1, true))
  end)
end)
