-- sleep, as scenes meet it: a heap that rests stays as it is, to the bit, and what comes to it wakes it.
local scene = require "testing.scene"

-- 100 grains of 0.1 m on a floor, by what stands after :contact.
local function heap(more, solve)
  return ([[
local function rising(frame)
  return rapid.translate(0, 0.25 * (math.max(0, frame.number - 96) / 24) ^ 2, 0)
end
local function landing(frame)
  return rapid.translate(0, math.max(0, 96 - frame.number) / 24 * 2, 0)
end
return rapid.create { fps = 24, seed = 1,
    points = rapid.points.grid { size = {1.3, 1, 1.3}, spacing = 0.26, center = {0, 0.7, 0} } }
  :attribute { pscale = 0.1 }
  :points ("shake", function(p, frame)
      if frame.number == 2 then p.v = vec3(p:rand(1) - 0.5, 0, p:rand(2) - 0.5) end
    end)
  :gravity {} :contact { friction = 0.5 } %s :solve { substeps = 8, %s }]]):format(more, solve or "")
end

local floor = ":collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.6 }"

local function same(a, b)
  for i = 1, #a do
    if a[i].P ~= b[i].P or a[i].v ~= b[i].v then return false end
  end
  return true
end

describe("sleep", function()
  it("leaves a heap that rests as it is, and out of what is written", function()
    local result = scene.run(heap(floor), { frames = {96, 144} })
    for f = 97, 144 do assert.is_true(same(result[96], result[f]), f) end
    assert.equal(vec3(0, 0, 0), result[144]:max("v"))
    assert.is_falsy(pcall(function() return result[144][1].still end))
  end)

  it("can be left out", function()
    local result = scene.run(heap(floor, "sleep = math.huge"), { frames = {96, 97} })
    assert.is_falsy(same(result[96], result[97]))
  end)

  it("ends where a floor begins to rise, and the heap goes with it", function()
    local result = scene.run(heap [[:collide { shape = rapid.shape.plane {}, transform = rising, bounce = 0,
      friction = 0.6 }]], { frames = {96, 120} })
    for i = 1, #result[120] do
      assert.near(result[96][i].P.y + 0.25, result[120][i].P.y, 0.02)
      assert.near(0.5, result[120][i].v.y, 0.05)
    end
  end)

  it("ends where a floor rises more slowly than what counts as still", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.1, 0}}, pscale = {0.1} } }
  :gravity {} :contact {}
  :collide { shape = rapid.shape.plane {}, transform = function(frame)
      return rapid.translate(0, 0.001 * math.max(0, frame.number - 24) / 24, 0)
    end, bounce = 0 }
  :solve { substeps = 8 }]], { frames = {24, 24 + 240} })
    for f = 24, 24 + 240, 24 do
      assert.near(0.1 + 0.001 * (f - 24) / 24, result[f][1].P.y, 0.0011) -- a hundredth of its radius, and rounding
    end
  end)

  it("ends where a shape comes down on it", function()
    local result = scene.run(heap(floor .. [[
      :collide { shape = rapid.shape.sphere { radius = 0.6, center = {0, 0.6, 0} },
      transform = landing, bounce = 0 }]]), { frames = {60, 97} })
    local moved = 0
    for i = 1, #result[97] do
      local P = result[97][i].P
      assert.truthy((P - vec3(0, 0.6, 0)):length() > 0.7 - 1e-3)
      if (P - result[60][i].P):length() > 0.05 then moved = moved + 1 end
    end
    assert.truthy(moved > 20, moved)
  end)
end)
