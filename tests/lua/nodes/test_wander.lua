-- :wander against its equation, solved by hand over frames.
local scene = require "testing.scene"

describe("wander", function()
  it("brings the velocity to that of the flow, by 1/e in the response time", function()
    local result = scene.run([[
return rapid.create { fps = 5, points = rapid.points.from { P = {{0.3, 1.2, -0.7}}, v = {{4, 0, 0}}, u = {{0, 0, 0}} } }
  :points("flow", function(p, frame) p.u = rapid.math.curl_noise(p.P / 2, frame.time * 0.25, 3, 9) * 1.5 end)
  :wander { speed = 1.5, size = 2, change = 0.25, octaves = 3, response = 0.5, seed = 9 } :solve {}]],
      { frames = {1, 4} })
    for f = 2, 4 do
      local before, p = result[f - 1][1].v, result[f][1]
      assert.near(p.u + (before - p.u) * math.exp(-0.2 / 0.5), p.v, 1e-6)
      assert.is_true(p.u:length() > 0.05)
    end
  end)

  it("keeps a cloud together: its volume does not change", function()
    -- Six corners of an octahedron about each centre. The flow is free of divergence, so its volume is constant.
    local result = scene.run([[
local P, h = {}, 0.002
for k = 0, 9 do
  local c = vec3(k * 1.37, 0.3 * k, -0.61 * k)
  for _, d in ipairs { {h, 0, 0}, {0, h, 0}, {0, 0, h}, {-h, 0, 0}, {0, -h, 0}, {0, 0, -h} } do
    P[#P + 1] = c + vec3(d)
  end
end
return rapid.create { fps = 240, points = rapid.points.from { P = P } }
  :wander { response = 1e-6, change = 0, octaves = 1 } :solve {}]], { frames = {1, 25} })
    local function volume(points, k)
      local function axis(j) return points[6 * k + j].P - points[6 * k + j + 3].P end
      return axis(1):cross(axis(2)):dot(axis(3))
    end
    for k = 0, 9 do
      local before, after = volume(result[1], k), volume(result[25], k)
      assert.near(1, after / before, 0.02)
      assert.is_true((result[25][6 * k + 1].P - result[1][6 * k + 1].P):length() > 0.005)
    end
  end)
end)
