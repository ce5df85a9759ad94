-- The effect of rounding positions to single precision, and the report of it.
local scene = require "testing.scene"
local json = require "dkjson"

-- Returns the positions and the reported rounding of the last frame of a run of these points.
local function run(points, nodes, frames)
  local head = "return rapid.create { fps = 24, points = rapid.points.from { %s } } %s :solve {}"
  local text = head:format(points, nodes)
  local last = scene.run(text, { frames = {frames, frames} })[frames]
  local result = scene.command("run", text, ("-f 1-%d --quiet --stats stats.json"):format(frames))
  assert.equal(0, result.status, result.stderr)
  return last, json.decode(scene.folder:read "stats.json").frames[frames].rounding
end

describe("rounding of positions", function()
  it("is told as what it takes of a drift, whole or in part", function()
    for _, speed in ipairs { 1e-4, 7e-4, 0.01, 0.03 } do
      for _, at in ipairs { 1000, -1000, 5000 } do
        local frames = 241
        local points, reported = run(("P = {{%g, 0, 0}}, v = {{%g, 0, 0}}"):format(at, speed), "", frames)
        local off = math.abs(points[1].P.x - at - speed * (frames - 1) / 24)
        assert.truthy(reported >= 0.99 * off,
          ("%g m/s at %g m: off by %g m, told %g m"):format(speed, at, off, reported))
        assert.truthy(reported <= off + 1e-3,
          ("%g m/s at %g m: off by %g m, told %g m"):format(speed, at, off, reported))
      end
    end
  end)

  it("is told where shapes are met early, far from the origin", function()
    local nodes = ":gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0 }"
    local points, reported = run("P = {{1e6, 3, 0}}", nodes, 48)
    assert.truthy(math.abs(points[1].P.y) <= reported)
    assert.truthy(reported >= 0.2 and reported <= 2, reported)
  end)

  it("is told of coupled points, and small near the origin", function()
    local _, reported = run("P = {{0, 1, 0}, {0.1, 1, 0}}", ":gravity {} :contact { radius = 0.05 }", 24)
    assert.truthy(reported > 0 and reported < 1e-5, reported)
  end)

  it("is noted by check where the scene is so large that it matters", function()
    local function note(points)
      local result = scene.command("check",
        ("return rapid.create { fps = 24, points = rapid.points.from { %s } } :solve {}"):format(points))
      assert.equal(0, result.status, result.stderr)
      return result.stdout:match "rounding positions at[^\n]+"
    end
    assert.match("at 1e%+06 m are 6.2e%-02 m apart", note "P = {{1e6, 0, 0}}")
    assert.match("at 1e%+03 m are 6.1e%-05 m apart", note "P = {{1000, 0, 0}}, v = {{1e-4, 0, 0}}")
    assert.falsy(note "P = {{1000, 0, 0}}, v = {{1, 0, 0}}")
    assert.falsy(note "P = {{1, 0, 0}}, v = {{1e-9, 0, 0}}")
  end)
end)
