-- :tumble against its angle of rotation.
local scene = require "testing.scene"

describe("tumble", function()
  it("turns by w, which falls by the drag, at any frame rate", function()
    for _, drag in ipairs { 0, 0.5, 3 } do
      for _, fps in ipairs { 2, 24 } do
        local p = scene.run(([[
return rapid.create { fps = %d, points = rapid.points.from { P = {{0, 0, 0}}, w = {{0, 0, 0.7}} } }
  :tumble { drag = %g } :solve {}]]):format(fps, drag), { frames = {2 * fps + 1, 2 * fps + 1} })[2 * fps + 1][1]
        local angle = drag > 0 and 0.7 * (1 - math.exp(-2 * drag)) / drag or 1.4
        assert.near({math.cos(angle), math.sin(angle), 0}, p.orient:rotate(vec3(1, 0, 0)), 2e-6)
        assert.near({0, 0, 0.7 * math.exp(-2 * drag)}, p.w, 1e-6)
      end
    end
  end)

  it("leaves points that do not turn as they are, and warns if none does", function()
    local result = scene.run("return rapid.create { points = two } :tumble { drag = 1 } :solve {}")
    assert.equal(quat(0, 0, 0, 1), result[3][1].orient)
    assert.near({0, 0, 0}, result[3][1].w, 0)
    assert.match('node "tumble1": turns nothing, because the angular velocity w of all points is 0; give it a speed in '
      .. "degrees per second: :tumble { speed = 360 }", table.concat(result.warnings, "\n"))
    for _, chain in ipairs { ":tumble { speed = 90 }", ":attribute { w = {0, 1, 0} } :tumble {}" } do
      assert.same({}, scene.run("return rapid.create { points = two } " .. chain .. " :solve {}").warnings)
    end
  end)

  it("gives still points its speed, about axes in all directions, and drag slows it for good", function()
    local text = [[return rapid.create { fps = 24, points = rapid.points.grid { size = {10, 10, 10}, spacing = 1 } }
  :tumble { speed = 360, variation = 0.5, drag = %g } :solve {}]]
    local mean, fastest, slowest = vec3(0, 0, 0), 0, math.huge
    local points = scene.run(text:format(0), { frames = {25, 25} })[25]
    for i = 1, #points do
      local w = points[i].w
      mean = mean + w / (w:length() * #points)
      fastest, slowest = math.max(fastest, w:length()), math.min(slowest, w:length())
    end
    assert.truthy(mean:length() < 3 / math.sqrt(#points), mean) -- of random unit vectors: 1 / sqrt(n)
    assert.near(3 * math.pi, fastest, 0.1)
    assert.near(math.pi, slowest, 0.1)
    points = scene.run(text:format(20), { frames = {240, 240} })[240] -- e^-200 is 0 in single precision
    for i = 1, #points, 50 do assert.truthy(points[i].w:length() < 1e-5) end
  end)

  it("stops with stop_at_rest where points rest, and goes on when they move again", function()
    local p = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, w = {{0, 0, 1}} } }
  :points("go", function(p, frame) p.v = vec3(frame.number > 13 and 1 or 0, 0, 0) end)
  :tumble { stop_at_rest = true } :solve {}]], { frames = {13, 25} })
    assert.equal(quat(0, 0, 0, 1), p[13][1].orient)
    assert.near({math.cos(0.5), math.sin(0.5), 0}, p[25][1].orient:rotate(vec3(1, 0, 0)), 1e-5)
  end)
end)
