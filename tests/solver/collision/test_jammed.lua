-- Points between shapes that close in on them: the limit of impacts in a step.
local scene = require "testing.scene"
local json = require "dkjson"

-- A lid moves down onto points on a floor until there is no room for them.
local lid = [[
local lid = rapid.shape.plane { normal = {0, -1, 0}, offset = -1 }
  :transform { [1] = rapid.translate(0, 0, 0), [12] = rapid.translate(0, -0.95, 0) }
return rapid.create { fps = 24, points = rapid.points.from {
    P = {{0, 0.5, 0}, {1, 0.5, 0}, {2, 0.5, 0}, {3, 0.5, 0}}, pscale = {0.05, 0.05, 0.05, 0.05} } }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.5 } :collide { shape = lid, bounce = 0.5 } :solve {}]]

local function statistics(text, frames)
  local result = scene.command("run", text, ("-f %s --stats s.json"):format(frames))
  return json.decode(scene.folder:read "s.json"), result
end

describe("the limit of impacts", function()
  it("ends a jam after two thousand impacts of a point, and reports it", function()
    local stats, result = statistics(lid, "1-24")
    local impacts, limits = 0, 0
    for _, frame in ipairs(stats.frames) do
      assert.is_true(frame.collisions <= 4 * 2010, ("frame %d: %d"):format(frame.frame, frame.collisions))
      impacts, limits = impacts + frame.collisions, limits + frame.contact_limit
    end
    assert.is_true(limits >= 4 and impacts < 4 * 24 * 2010, ("%d, %d"):format(limits, impacts))
    assert.matches("points reached the limit of contacts", result.stdout)
    assert.matches("were stopped for the rest of it", result.stderr)
  end)

  it("leaves jammed points at rest", function()
    local result = scene.run(lid, { frames = {12, 24} })
    for frame = 12, 24 do
      for i = 1, 4 do assert.near(result[12][i].P, result[frame][i].P, 1e-6) end
    end
    for i = 1, 4 do assert.near({i - 1, 0, 0}, result[24][i].P, 0.05) end
  end)

  it("is not met by a fast point that bounces on between walls, two thousand times a step", function()
    -- Between walls 0.11 m apart, with a radius of 0.005 m on each side: a path of 0.1 m.
    local speed = 2000 * 0.1 * 24
    local points = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, v = {{%g, 0, 0}}, pscale = {0.005} } }
  :collide { shape = rapid.shape.plane { normal = {1, 0, 0}, offset = -0.055 }, bounce = 1 }
  :collide { shape = rapid.shape.plane { normal = {-1, 0, 0}, offset = -0.055 }, bounce = 1 } :solve {}]])
      :format(speed), { frames = {3, 3} })[3]
    assert.near(speed, points[1].v:length(), 1e-3 * speed)
  end)
end)
