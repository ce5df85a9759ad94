-- Sleep in scenes: a heap at rest stays bit-identical, and points that reach it wake it.
local scene = require "testing.scene"

-- 100 grains of 0.1 m on a floor; `more` follows :contact.
local function heap(more, solve)
  return ([[
local function rising(frame)
  return rapid.translate(0, 0.25 * (math.max(0, frame.number - 96) / 24) ^ 2, 0)
end
local function landing(frame)
  return rapid.translate(0, math.max(0, 96 - frame.number) / 24 * 2, 0)
end
return rapid.create { fps = 24, seed = 2,
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

-- A net of 36 knots in air that hangs on pins at its corners, by frames; `with` replaces defaults.
local function net(with, last)
  local text = [[
local places = {}
for i = 0, 5 do for j = 0, 5 do places[#places + 1] = {0.09 * i, 0, 0.09 * j} end end
local corners = { [0] = true, [5] = true, [30] = true, [35] = true }
return rapid.create { fps = 24, points = rapid.points.from { P = places } }
  :points ("script", function(p, frame) SCRIPT end)
  :gravity {} :drag { linear = 4 } :wind { velocity = WIND, drag = 1 } :distance { within = 0.1, rest = 0.1 }
  :group { name = "corner", where = function(p, frame) return corners[p.id] and HELD end }
  :pin { group = "corner", PIN } :solve { substeps = 8 }]]
  local default = { SCRIPT = "", WIND = "{0, 0, 0}", HELD = "true", PIN = "" }
  text = text:gsub("%u%u+", function(name) return with[name] or default[name] end)
  return scene.run(text, { frames = {1, last} })
end

describe("sleep", function()
  it("leaves a heap at rest unchanged, and the column out of the output", function()
    local result = scene.run(heap(floor), { frames = {96, 144} })
    for f = 97, 144 do assert.is_true(same(result[96], result[f]), f) end
    assert.equal(vec3(0, 0, 0), result[144]:max("v"))
    assert.is_falsy(pcall(function() return result[144][1].still end))
  end)

  it("can be left out", function()
    local result = scene.run(heap(floor, "sleep = math.huge"), { frames = {96, 97} })
    assert.is_falsy(same(result[96], result[97]))
  end)

  it("ends where a floor begins to rise, and the heap rises with it", function()
    local result = scene.run(heap [[:collide { shape = rapid.shape.plane {}, transform = rising, bounce = 0,
      friction = 0.6 }]], { frames = {96, 120} })
    for i = 1, #result[120] do
      assert.near(result[96][i].P.y + 0.25, result[120][i].P.y, 0.02)
      assert.near(0.5, result[120][i].v.y, 0.05)
    end
  end)

  it("ends where a floor rises more slowly than a still point may move", function()
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

describe("sleep of linked points", function()
  -- Asserts that the net sleeps at frame 300. Returns its largest motion in the 24 frames after that, and the result.
  local function moved(with)
    local result = net(with, 324)
    for f = 276, 300 do
      assert.equal(vec3(0, 0, 0), result[f]:max("v"), f)
      assert.is_true(same(result[276], result[f]), f)
    end
    local most = 0
    for i = 1, 36 do most = math.max(most, (result[324][i].P - result[300][i].P):length()) end
    return most, result
  end

  it("comes to a net on pins that hangs in balance, and lasts", function()
    local still, result = moved {}
    assert.equal(0, still)
    local low = 0
    for i = 1, 36 do low = math.min(low, result[300][i].P.y) end
    assert.truthy(low < -0.05, low)
    for _, i in ipairs { 0, 5, 30, 35 } do assert.equal(0, result[300][i + 1].P.y) end
    -- It hangs symmetrically, as it would without sleep.
    for i = 0, 5 do
      for j = 0, 5 do
        assert.near(result[300][6 * i + j + 1].P.y, result[300][6 * (5 - i) + j + 1].P.y, 1e-3)
        assert.near(result[300][6 * i + j + 1].P.y, result[300][6 * j + i + 1].P.y, 1e-3)
      end
    end
  end)

  it("ends when wind rises", function()
    assert.truthy(moved { WIND = "function(frame) return {frame.number > 300 and 2 or 0, 0, 0} end" } > 0.01)
  end)

  it("ends when its pins move", function()
    local most, result = moved {
      PIN = "transform = function(frame) return rapid.translate(0.01 * math.max(0, frame.number - 300), 0, 0) end" }
    assert.near(0.24, result[324][1].P.x - result[300][1].P.x, 1e-5)
    assert.truthy(most > 0.23, most)
  end)

  it("ends when a pin lets go", function()
    local _, result = moved { HELD = "(p.id ~= 0 or frame.number <= 300)" }
    assert.truthy(result[324][1].P.y < -0.1, result[324][1].P.y)
    assert.equal(0, result[324][6].P.y)
  end)

  it("ends for all of it when a script moves one of its points", function()
    local _, result = moved { SCRIPT = "if p.id == 14 and frame.number == 301 then p.P = p.P + vec3(0, 0.05, 0) end" }
    for i = 1, 36 do
      if i ~= 1 and i ~= 6 and i ~= 31 and i ~= 36 then assert.truthy(result[302][i].v:length() > 0, i) end
    end
  end)

  it("ends when the target of a spring moves", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}} } }
  :gravity {} :drag { linear = 5 }
  :pin { target = function(frame) return {frame.number > 100 and 1 or 0, 0, 0} end, compliance = 1e-3 }
  :solve { substeps = 8 }]], { frames = {1, 200} })
    for f = 90, 100 do assert.equal(vec3(0, 0, 0), result[f][1].v, f) end
    assert.near({0, -9.81e-3, 0}, result[100][1].P, 1e-5)
    assert.near({1, -9.81e-3, 0}, result[200][1].P, 1e-5)
  end)

  it("ends when a bond no longer bears what hangs from it", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, -0.2, 0}}, pscale = {0.1, 0.1} } }
  :gravity {} :clump { strength = function(frame) return frame.number > 48 and 8 or 12 end }
  :group { name = "top", where = function(p) return p.id == 0 end } :pin { group = "top" }
  :solve { substeps = 8 }]], { frames = {1, 72} })
    for f = 36, 48 do assert.is_true(same(result[36], result[f]), f) end
    assert.near(-0.2, result[48][2].P.y, 1e-4)
    assert.truthy(result[72][2].P.y < -4, result[72][2].P.y)
  end)

  it("comes to a heap of clumps", function()
    local result = scene.run(heap(floor .. " :clump { strength = 20 }"), { frames = {276, 300} })
    for f = 277, 300 do assert.is_true(same(result[276], result[f]), f) end
    assert.equal(vec3(0, 0, 0), result[300]:max("v"))
  end)
end)

-- A grain of radius r on a plane that is tilted by 20 degrees, for four seconds; friction relative to the tangent.
local function slope(with)
  local text = [[
local angle, late = math.rad(20), function(frame) return frame.number > 48 end
local normal = { math.sin(angle), math.cos(angle), 0 }
local P = { 7 + R * normal[1], R * normal[2] - 7 * normal[1] / normal[2], 0 }
return rapid.create { fps = 24, points = rapid.points.from { P = {P} } }
  :gravity { g = GRAVITY } :contact { radius = 0.1 }
  :collide { shape = rapid.shape.plane { normal = normal }, radius = R, bounce = BOUNCE,
    friction = FRICTION, response = RESPONSE }
  :solve { substeps = SUBSTEPS }]]
  local default = { R = "0.1", GRAVITY = "{0, -9.81, 0}", BOUNCE = "0", FRICTION = "math.tan(angle) * 1.5",
    RESPONSE = '"bounce"', SUBSTEPS = "1" }
  text = text:gsub("%f[%u]%u+%f[%A]", function(name) return with[name] or default[name] end)
  return scene.run(text, { frames = {1, 97} })
end

describe("what lies on a slope", function()
  local tangent = math.tan(math.rad(20))

  -- Returns the distance that it has slid after frame 48.
  local function slid(with)
    local result = slope(with)
    return (result[97][1].P - result[48][1].P):length(), result
  end

  it("sleeps while friction holds it", function()
    local way, result = slid {}
    assert.equal(0, way)
    assert.equal(vec3(0, 0, 0), result[48][1].v)
  end)

  it("slides when friction goes, whatever its radius", function()
    local expected = 0.5 * 9.81 * math.sin(math.rad(20)) * (49 / 24) ^ 2
    for _, r in ipairs { "0", "1e-3", "0.1" } do
      assert.near(expected, (slid { R = r, FRICTION = "function(f) return late(f) and 0 or 1 end" }), 0.01 * expected)
    end
  end)

  it("slides when gravity turns by a little more than friction holds", function()
    local angle = math.rad(0.5)
    local way = slid { FRICTION = "math.tan(angle) * 1.005",
      GRAVITY = ("function(f) local t = late(f) and %.17g or 0 return {9.81 * math.sin(t), -9.81 * math.cos(t), 0} end")
        :format(angle) }
    local along = 9.81 * (math.sin(math.rad(20) + angle) - 1.005 * tangent * math.cos(math.rad(20) + angle))
    local expected = 0.5 * along * (48.4 / 24) ^ 2 -- gravity turns through frame 49, and suffices at a fifth of it
    assert.truthy(expected > 0.1)
    assert.near(expected, way, 0.02 * expected)
  end)

  it("slides, at any number of sub-steps, where its weight is just more than friction holds", function()
    for _, substeps in ipairs { 1, 4, 16 } do
      for _, part in ipairs { 0.9, 0.98, 0.999, 0.9999 } do
        local _, result = slid { FRICTION = ("math.tan(angle) * %g"):format(part), SUBSTEPS = tostring(substeps) }
        local along = 9.81 * math.sin(math.rad(20)) * (1 - part)
        assert.near(0.5 * along * 16, (result[97][1].P - result[1][1].P):length(), 0.02 * along * 8 + 2e-5)
      end
    end
  end)

  it("is awake for a moment after its shape was given another bounce or response, and stays", function()
    for _, with in ipairs { { BOUNCE = "function(f) return late(f) and 0.5 or 0 end" },
      { RESPONSE = 'function(f) return late(f) and "slide" or "bounce" end' } } do
      assert.near(0, (slid(with)), 1e-6)
    end
  end)
end)
