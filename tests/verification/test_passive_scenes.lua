-- Random scenes without energy sources (passive_scenes.lua): none gains energy since its start, except for rounding,
-- one per cent, and the energy that the run reports as added by contacts.
--
-- The suite runs some; PASSIVE_SCENES=2000 PASSIVE_SEED=7 rapid test tests/verification runs more, and others. For a
-- scene that gains energy, the simplest one that still does is printed, ready to run.
local scene = require "testing.scene"
local amount = require "tests.amount"
local json = require "dkjson"
local passive_scenes = require "tests.verification.passive_scenes"
local mechanical_energy = require "tests.verification.mechanical_energy"
local simplest = require "tests.verification.simplest"

local scenes = amount.of("PASSIVE_SCENES", 20) -- of each kind
local seed = tonumber(os.getenv "PASSIVE_SEED") or 1
local allowed = 0.01  -- of the largest energy in motion or stored in springs

-- Returns the energy that contacts have added up to a frame, as reported by the run, J.
local function reported(text, frame)
  local run = scene.command("run", text, ("-f 1-%d --quiet --stats stats.json"):format(frame))
  assert(run.status == 0, run.stderr)
  local sum = 0
  for _, one in ipairs(json.decode(scene.folder:read "stats.json").frames) do sum = sum + one.contact_energy.added end
  return sum
end

-- Returns a description of a scene's fault and its size, or nil.
local function fault_of(description)
  local text = passive_scenes.text(description)
  local ok, result = pcall(scene.run, text, { frames = {1, description.frames}, threads = 1 })
  if not ok then return tostring(result), math.huge end
  local part, frame, gain = mechanical_energy.gain(description, result)
  collectgarbage()  -- the collector does not see a result's memory outside of Lua
  if not part or part <= allowed then return end
  local excess = gain - reported(text, frame)
  if excess <= allowed * gain / part then return end
  return ("%.3g J more in frame %d, %.3g of what is in motion or stored, and %.3g J told"):format(gain, frame, part,
    gain - excess), part
end

-- Returns the set of nodes in a scene.
local function nodes_of(description)
  local has = {}
  for _, node in ipairs(description.nodes) do
    has[node.kind] = true
    has.surface_spring = has.surface_spring or node.kind == "spring" and node.radius ~= nil
  end
  return has
end

-- Checks a list of scenes, {seed, number} each, and reports all that gain energy.
local function none_gains(list)
  local faults = {}
  for _, one in ipairs(list) do
    local seed_of, number = unpack(one)
    local description = passive_scenes.scene(seed_of, number)
    local fault = fault_of(description)
    if fault then
      description, fault = simplest(description, fault_of)
      faults[#faults + 1] = ('scene %d of seed %d: %s\nlocal rapid = require "rapid"\n%s'):format(number, seed_of,
        fault, passive_scenes.text(description))
    end
  end
  assert.equal("", table.concat(faults, "\n\n"))
end

-- Returns the first scenes of the seed for which `is_selected` returns true.
local function drawn(is_selected)
  local list, number = {}, 0
  while #list < scenes do
    number = number + 1
    if is_selected(nodes_of(passive_scenes.scene(seed, number))) then list[#list + 1] = {seed, number} end
  end
  return list
end

describe(("random passive scenes (%d of seed %d)"):format(scenes, seed), function()
  it("of rods, bonds and pins gain no energy", function()
    none_gains(drawn(function(has) return not (has.contact or has.spring or has.collide) end))
  end)

  it("of contacts too gain no energy", function()
    none_gains(drawn(function(has) return has.contact and not (has.spring or has.collide) end))
  end)

  it("with springs gain no energy", function()
    none_gains(drawn(function(has) return has.spring and not has.collide end))
  end)

  it("among solids gain no energy", function()
    none_gains(drawn(function(has) return has.collide end))
  end)

  -- Rods without a solution, springs to surfaces next to rods, springs that turn a point several times in a sub-step
  -- between shapes, pins inside shapes, bonds that have turned away from their impulse, springs to surfaces and
  -- compliant rods whose points are moved out of shapes, also several times in one sub-step, points born inside shapes
  -- that they stick to, rods that are corrected next to compliant pins, contacts that contradict rods, points that
  -- `project` moves out of shapes at the end of a frame, points at the centre of the ball that a spring pulls them to,
  -- rods of length 0, points that shapes push out and pins pull back, rods to sleeping points that had a velocity.
  it("that gained on earlier code gain none", function()
    none_gains { {11, 58}, {11, 19}, {11, 480}, {11, 150}, {11, 892}, {11, 113}, {11, 169}, {11, 219}, {11, 249},
      {13, 283}, {13, 538}, {17, 396}, {21, 378}, {21, 474}, {23, 188},
      {104, 454}, {106, 1207}, {109, 88}, {111, 205}, {112, 96}, {116, 1033}, {120, 296}, {120, 365},
      {121, 2591} }
  end)
end)
