-- :trail: earlier positions of each point, by id, through births and deaths.
local scene = require "testing.scene"

local text = [[
local rapid = require "rapid"
return rapid.create { seed = 5 }
  :emit    { source = rapid.shape.sphere { radius = 1, center = {0, 3, 0} }, rate = 200, velocity = {1, 2, 0},
             spread = 60, life = {0.1, 0.6} }
  :trail   { places = 5 }
  :gravity {}
  :collide { shape = rapid.shape.plane { offset = 2.5 }, bounce = 0.5 }
  :solve   {}]]

describe(":trail", function()
  local result = rapid.run(scene.folder:write("trail.lua", text), { frames = {1, 20} })

  it("stores the positions of all earlier frames, bit-identical", function()
    local long = 0
    for frame = 2, 20 do
      local points = result[frame]
      assert.is_true(#points > 0)
      for i = 1, #points do
        local p = points[i]
        for place = 1, 5 do
          local before = frame - place >= 1 and result[frame - place]:by_id(p.id)
          if before and place < p.trailnum then assert.equal(before.P, p["trail" .. place]) end
          -- The position after the last one of earlier frames is that of the birth.
          if before then assert.is_true(p.trailnum >= math.min(5, place + 1)) end
        end
        if p.trailnum == 5 then long = long + 1 end
      end
    end
    assert.is_true(long > 300)
  end)

  it("begins where the point was born", function()
    local points, newborn = result[12], 0
    for i = 1, #points do
      local p = points[i]
      if not result[11]:by_id(p.id) then
        newborn = newborn + 1
        assert.equal(1, p.trailnum)
        assert.near(1, (p.trail1 - vec3(0, 3, 0)):length(), 1e-6)
      end
    end
    assert.is_true(newborn > 3)
  end)

  it("is the same on any number of threads", function()
    for _, threads in ipairs { 2, 7 } do
      local other = rapid.run(scene.folder:file "trail.lua", { frames = {20, 20}, threads = threads })
      assert.same_points(result[20], other[20])
    end
  end)

  it("refuses lengths that it can't have", function()
    for _, places in ipairs { 0, 257, 2.5 } do
      local message = scene.error(("return rapid.create {} :trail { places = %s } :solve {}"):format(places))
      assert.truthy(message:find("places = " .. places, 1, true), message)
    end
  end)
end)

-- The trail of a point equals its positions in earlier frames of the same result.
local function assert_trails_of(result, first, last, places)
  local long = 0
  for frame = first, last do
    local points = result[frame]
    for i = 1, #points do
      local p = points[i]
      local seen = 0
      while frame - seen > 1 and result[frame - seen - 1]:by_id(p.id) do seen = seen + 1 end
      assert.equal(math.min(places, seen), p.trailnum)
      for place = 1, p.trailnum do assert.equal(result[frame - place]:by_id(p.id).P, p["trail" .. place]) end
      long = long + p.trailnum
    end
  end
  return long
end

describe(":trail where no Solve comes after it", function()
  local emit = [[:emit { source = rapid.shape.sphere { radius = 1 }, rate = 200, velocity = {1, 2, 0}, spread = 60,
    life = {0.1, 0.6} } ]]
  local function run(graph)
    return rapid.run(scene.folder:write("after.lua", 'local rapid = require "rapid"\n' .. graph), { frames = {1, 20} })
  end

  it("keeps the positions of the frames before, through births and deaths", function()
    local chain = "return rapid.create {} " .. emit .. ":gravity {} "
    assert.is_true(assert_trails_of(run(chain .. ":solve {} :trail { places = 5 }"), 1, 20, 5) > 1000)
    assert.is_true(assert_trails_of(run(chain .. ":solve {} :trail { places = 1 }"), 1, 20, 1) > 500)
  end)

  it("does so after a node that kills points, and after a merge", function()
    assert_trails_of(run("return rapid.create {} " .. emit .. [[:solve {}
      :delete { where = function(p) return p.P.x > 0 end } :trail { places = 3 }]]), 1, 20, 3)
    assert_trails_of(run("return rapid.create {} " .. emit .. ":solve {} :merge(rapid.create {} " .. emit ..
      ":solve {}) :trail { places = 3 }"), 1, 20, 3)
  end)

  it("does so after another one, and of points that no Solve moves", function()
    assert_trails_of(run("return rapid.create {} " .. emit .. ":trail { places = 4 } :solve {} :trail {} "
      .. ":trail { places = 2 }"), 1, 20, 2)
    local still = run "return rapid.create { points = rapid.points.from { P = {{1, 2, 3}} } } :trail { places = 3 }"
    assert_trails_of(still, 1, 20, 3)
    local newborn = run("return rapid.create {} " .. emit .. ":trail {}")
    assert_trails_of(newborn, 1, 20, 12)
  end)

  it("has nothing to keep of a set without points", function()
    for _, chain in ipairs { ":solve {} :trail {}", ":trail {} :solve {}", ":trail {}" } do
      assert.equal(0, #run("return rapid.create {} " .. chain)[20])
    end
  end)
end)
