-- birth = function(p, frame): the values that it gives newborn points, once each.
local scene = require "testing.scene"

local function run(more, options)
  return scene.run(([[
return rapid.create { fps = 24, seed = 5 }
  :emit { source = rapid.mesh.grid { size = {2, 2}, divisions = 4 }, attributes = { heat = 0, Cd = {1, 1, 1} }, %s }
  :solve {}]]):format(more), options)
end

describe("a function of the newborn", function()
  it("sets any attribute from any other, at the position and velocity of birth", function()
    local points = run([[count = 500, velocity = {0, 2, 0}, birth = function(p, frame)
      p.heat = p.P.x + 10 * frame.number
      p.Cd = vec3(p.P.x, p.v.y, p.dt)
    end]], { frames = {3, 3} })[3]
    assert.equal(1000, #points)
    local dts = {}
    for i = 1, #points do
      local p = points[i]
      local frame = i <= 500 and 2 or 3
      assert.near(p.P.x + 10 * frame, p.heat, 1e-5)
      assert.near(2, p.Cd.y, 1e-6)
      -- It moves for its own part of the birth frame, and then for whole frames.
      assert.near(2 * (p.Cd.z + (3 - frame) / 24), p.P.y, 1e-6)
      dts[#dts + 1] = p.Cd.z
    end
    assert.is_true(math.max(unpack(dts)) > 0.9 / 24 and math.min(unpack(dts)) < 0.1 / 24)
  end)

  it("is called once for each, and never again", function()
    local result = run("count = 10, birth = function(p) p.heat = p.heat + 1 end", { frames = {2, 6} })
    for frame = 2, 6 do
      assert.equal(10 * (frame - 1), #result[frame])
      assert.equal(1, result[frame]:min "heat")
      assert.equal(1, result[frame]:max "heat")
    end
  end)

  it("draws the point's own numbers, joins groups, and kills", function()
    local points = run([[count = 4000, birth = function(p)
      p.heat = p:rand(1)
      if p.heat < 0.25 then p:join "cold" end
      if p.heat > 0.75 then p:kill() end
    end]], { frames = {2, 2} })[2]
    assert.near(3000, #points, 5 * math.sqrt(4000 * 0.25 * 0.75))
    assert.is_true(points:max "heat" <= 0.75)
    assert.near(1000, #points:group "cold", 5 * math.sqrt(4000 * 0.25 * 0.75))
    for i = 1, #points do assert.equal(points[i].heat < 0.25, points[i]:within "cold") end
  end)

  it("is there for the points of the first frame, and for impulses", function()
    local points = run("impulse = {[1] = 7}, birth = function(p) p.heat = 3 end", { frames = {1, 1} })[1]
    assert.equal(7, #points)
    assert.equal(3, points:min "heat")
  end)

  it("edits points born from points of another chain and of its own", function()
    local result = scene.run([[
local stars = rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {5, 0, 0}}, v = {{0, 1, 0}, {0, 3, 0}} } }
  :solve {}
return rapid.create { fps = 24 }
  :spawn { from = stars, count = 6, attributes = { heat = 0 }, birth = function(p) p.heat = p.v.y + p.parent end }
  :solve {}]], { frames = {2, 2} })[2]
    assert.equal(12, #result)
    for i = 1, #result do
      local right = result[i].P.x > 2
      assert.near(right and 4 or 1, result[i].heat, 1e-5)
    end
  end)

  it("has the same bits on 1, 2 and 7 threads", function()
    local function points(threads)
      return run([[rate = 600000, birth = function(p) p.heat = p:rand(2) * p.P.x; p.v = p.v + vec3(p.heat, 0, 0) end]],
        { frames = {3, 3}, threads = threads })[3]
    end
    local one = points(1)
    assert.is_true(#one > 40000)
    for _, threads in ipairs { 2, 7 } do assert.same_points(one, points(threads)) end
  end)

  it("reports mistakes with the line inside the function", function()
    local function message(more)
      return scene.error(([[
return rapid.create { fps = 24 }
  :emit { source = rapid.mesh.sphere {}, count = 3, %s } :solve {}]]):format(more))
    end
    assert.equal('scene.lua:3: node "emit1": no attribute "heat"; add :attribute{ heat = 0 } before it',
      message "birth = function(p)\n p.heat = 1 end")
    assert.matches("birth = 3 has the wrong type; it must be a moment or function of a point", message "birth = 3", 1,
      true)
    assert.matches('birth = "evn" is unknown; did you mean "even"?', message 'birth = "evn"', 1, true)
  end)
end)
