-- Random scenes, stiff and extreme (random_scenes.lua makes them).
--
-- A scene runs to its end with points that are finite, the same bits on any number of threads, or ends with an error
-- that names its node; nothing else, and not after minutes. In the suite a few are run; STABILITY_SCENES=10000
-- STABILITY_SEED=7 rapid test tests/stability runs more, and others. A scene that fails is shown whole, with its number
-- and seed.
local scene = require "testing.scene"
local amount = require "tests.amount"
local random_scenes = require "tests.stability.random_scenes"

local scenes = amount.of("STABILITY_SCENES", 100)
local seed = tonumber(os.getenv "STABILITY_SEED") or 1
-- s of all processors for one scene. The usual one takes 0.01; half of this, 4,800 points that are bound each to all
-- others, in 16 sub-steps.
local slowest = 60

local random, pick, magnitude = random_scenes.random, random_scenes.pick, random_scenes.magnitude
local vector, head = random_scenes.vector, random_scenes.head

local function not_finite(result)
  for frame, set in result:frames() do
    for i = 1, #set do
      for _, what in ipairs { "P", "v" } do
        local x = set[i][what]
        if x ~= x or x:length() >= math.huge then
          return ("%s of point %d in frame %d is %s"):format(what, i, frame, x)
        end
      end
    end
  end
end

-- What is wrong with a scene, nil where nothing is; and its result where it ran.
local function fault_of(text, options)
  local began = os.clock()
  local ok, result = pcall(scene.run, text, options)
  local seconds = os.clock() - began
  if seconds > slowest then return ("it took %.1f s"):format(seconds) end
  if ok then return not_finite(result), result end
  if not result:match '^%S+:%d+: node "[%w_]+": .' then return "an error without its place: " .. result end
end

-- Goes through so many scenes; fault_of_scene(): what is wrong with one, and its text. All that are wrong are told.
local function each(count, fault_of_scene)
  local faults = {}
  for number = 1, count do
    random_scenes.start(seed, number)
    local fault, text = fault_of_scene()
    collectgarbage() -- of what a result holds outside of Lua the collector sees nothing
    if fault then faults[#faults + 1] = ("scene %d of seed %d: %s\n%s"):format(number, seed, fault, text) end
  end
  assert.equal("", table.concat(faults, "\n\n"))
end

describe("random scenes", function()
  it(("end finite, or with an error that names the node (%d of seed %d)"):format(scenes, seed), function()
    each(scenes, function()
      local text = random_scenes.text()
      return fault_of(text, { frames = {1, 6} }), text
    end)
  end)

  it("have the same bits on 1, 2 and 7 threads", function()
    each(math.ceil(scenes / 20), function()
      local text = random_scenes.chunks()
      local fault, one = fault_of(text, { frames = {1, 3}, threads = 1 })
      for _, threads in ipairs(one and { 2, 7 } or {}) do
        local many = scene.run(text, { frames = {3, 3}, threads = threads })
        local same, difference = pcall(assert.same_points, one[3], many[3])
        fault = fault or not same and ("on %d threads: %s"):format(threads, tostring(difference)) or nil
      end
      return fault, text
    end)
  end)
end)

-- What only takes energy never leaves a point with more: of a spring, of gravity, of the motion.
describe("random scenes that only lose energy", function()
  local function energy(p, k, g) return k / 2 * p.P:dot(p.P) + g * p.P.y + p.v:dot(p.v) / 2 end

  -- scale: of the terms that the energy is a difference of.
  local function gained(result, k, g, scale)
    local before = energy(result[1][1], k, g)
    for frame = 2, 9 do
      local now = energy(result[frame][1], k, g)
      if now > before + 1e-5 * math.max(scale, before) or now ~= now then
        return ("%g J/kg, then %g"):format(before, now)
      end
    end
  end

  it("of springs and drags have no more than at first, whatever their stiffness", function()
    each(scenes, function()
      local k, c, q = magnitude(-6, 9), pick { 0, magnitude(-6, 9) }, pick { 0, magnitude(-6, 6) }
      local text = ([[
return rapid.create { fps = %.9g,
  points = rapid.points.from { P = {{%.9g, 0, 0}}, v = {{0, %.9g, 0}} } }
  :spring { stiffness = %.9g, damping = %.9g } :drag { quadratic = %.9g } :solve { substeps = %d }]])
        :format(magnitude(-1, 5), magnitude(-3, 3), magnitude(-3, 4), k, c, q, pick { 1, 4 })
      return gained(scene.run(text, { frames = {1, 9} }), k, 0, 0), text
    end)
  end)

  it("of falls, drags and colliders at rest have no more than at first", function()
    each(scenes, function()
      local g = pick { 0, magnitude(-2, 3) }
      local height, speed = 3 + magnitude(-2, 3), magnitude(-3, 4) -- above all that it may hit
      local solid = pick { "solid",
        ("rapid.shape.sphere { radius = %.9g, center = %s }"):format(random(), vector(-3, 0)),
        ("rapid.shape.box { size = {%.9g, 1, 0.5}, center = %s }"):format(magnitude(-2, 1), vector(-3, 0)) }
      local text = head .. ([[
return rapid.create { fps = %.9g,
  points = rapid.points.from { P = {{0, %.9g, 0}}, v = {{%.9g, %.9g, 0}} } }
  :gravity { g = {0, %.9g, 0} } :drag { linear = %.9g }
  :collide { shape = %s, bounce = %.9g, friction = %.9g } :collide { shape = rapid.shape.plane {}, bounce = %.9g }
  :solve { substeps = %d }]])
        :format(magnitude(0, 4), height, speed, -speed * random(), -g, pick { 0, magnitude(-6, 6) }, solid,
          pick { 0, 1, random() }, pick { 0, random() }, pick { 0, 1, random() }, pick { 1, 4 })
      return gained(scene.run(text, { frames = {1, 9} }), 0, g, g * height + speed ^ 2), text
    end)
  end)
end)
