-- Random scenes of coupled points between moving shapes and pins (driven_scenes.lua).
--
-- If they all move alike and uniformly, the energy in their frame does not grow. If each moves by itself, the
-- energy of the points matches the ledger: the initial energy plus the changes by contacts, pins, rods and drag. The
-- suite runs some; STABILITY_SCENES=1000 STABILITY_SEED=7 rapid test tests/stability runs more, and others. For a
-- failing scene, the simplest one that still fails is printed, ready to run.
local scene = require "testing.scene"
local amount = require "tests.amount"
local json = require "dkjson"
local driven_scenes = require "tests.stability.driven_scenes"
local passive_scenes = require "tests.verification.passive_scenes"
local mechanical_energy = require "tests.verification.mechanical_energy"
local simplest = require "tests.verification.simplest"

local scenes = amount.of("STABILITY_SCENES", 10)
local seed = tonumber(os.getenv "STABILITY_SEED") or 1
local allowed = 0.01  -- of the largest energy in motion or stored in springs


-- Returns the statistics of each frame from --stats.
local function statistics(description)
  local reported = scene.command("run", passive_scenes.text(description),
    ("-f 1-%d --quiet --stats stats.json"):format(description.frames))
  assert(reported.status == 0, reported.stderr)
  return json.decode(scene.folder:read "stats.json").frames
end

-- Returns a function that finds the fault of a scene with fault(description, result). A scene that does not run is at
-- fault, too.
local function fault_of(fault)
  return function(description)
    local ok, result = pcall(scene.run, passive_scenes.text(description), { frames = {1, description.frames},
      threads = 1 })
    if not ok then return tostring(result), math.huge end
    local text, size = fault(description, result)
    collectgarbage()  -- the collector does not see a result's memory outside of Lua
    return text, size
  end
end

-- No bound is known for a scene in which position corrections add energy, as when points overlap at birth or rods
-- contradict shapes. Such a scene is skipped if the run of its equivalent at rest reports added energy beyond its
-- initial energy.
local gains = fault_of(function(description, result)
  local seen, run = driven_scenes.seen(description, result)
  local part, frame, gain = mechanical_energy.gain(seen, run)
  if not part or part <= allowed then return end
  local added = 0
  for _, one in ipairs(statistics(driven_scenes.at_rest(description))) do
    if one.frame <= frame then added = added + one.contact_energy.added end
  end
  if added > allowed * mechanical_energy.of(seen, run)[1].lively then return end
  return ("seen from its shapes, %.3g J more in frame %d, %.3g of what is in motion or stored"):format(gain, frame,
    part), part
end)

local by = { "by_contacts", "by_friction", "by_shapes", "by_rods", "by_pins", "by_drag" }

local is_off = fault_of(function(description, result)
  local energy, reported, lively, rounding = mechanical_energy.of(description, result), 0, 0, 0
  for _, one in ipairs(energy) do lively = math.max(lively, one.lively) end
  for _, one in ipairs(statistics(description)) do
    if one.frame > 1 and not one.ledger then return end  -- nothing couples the points
    for _, name in ipairs(by) do reported = reported + (one.ledger and one.ledger[name] or 0) end
    rounding = rounding + energy[one.frame].rounding
    local off = energy[one.frame].total - energy[1].total - reported
    if math.abs(off) > allowed * lively + rounding then
      return ("in frame %d points have %.3g J more than the ledger says, %.3g of what is in motion or stored"):format(
        one.frame, off, off / lively), math.abs(off) / lively
    end
  end
end)

-- Checks a list of scenes, {seed, number} each, and reports all that fail.
local function none_of(fault, draw, list)
  local faults = {}
  for _, one in ipairs(list) do
    local description = draw(unpack(one))
    if fault(description) then
      local simpler, text = simplest(description, fault)
      faults[#faults + 1] = ('scene %d of seed %d: %s\nlocal rapid = require "rapid"\n%s'):format(one[2], one[1], text,
        passive_scenes.text(simpler))
    end
  end
  assert.equal("", table.concat(faults, "\n\n"))
end

-- Checks the first scenes of the seed for which `is_selected` returns true.
local function none(fault, draw, is_selected)
  local list, number = {}, 0
  while #list < scenes do
    number = number + 1
    if is_selected(draw(seed, number)) then list[#list + 1] = {seed, number} end
  end
  none_of(fault, draw, list)
end

describe(("random scenes of coupled points (%d of seed %d)"):format(scenes, seed), function()
  it("gain no energy among shapes and pins that go along together", function()
    none(gains, driven_scenes.together, function() return true end)
  end)

  -- Skips scenes with `interact` or with points that die, which the ledger does not itemise.
  it("have the energy that the ledger says, among shapes and pins that move", function()
    none(is_off, driven_scenes.apart, function(description)
      for _, node in ipairs(description.nodes) do
        if node.kind == "interact" or node.response == "die" then return false end
      end
      return true
    end)
  end)

  -- Their features: pinned rods next to springs that no sub-step resolves; rods whose points move with a pin; points
  -- backtracked to an accelerating plane; rods and neighbours that stick to shapes; pinned points that shapes pass
  -- through; springs through the centre of a ball; rods on stiff springs next to a box with method `project`; heavy
  -- grains on light ones; rods on springs to a sphere that no sub-step resolves.
  it("that were wrong on earlier code are right", function()
    none_of(gains, driven_scenes.together, {
      {2, 8}, {2, 35}, {118, 80}, {119, 30}, {119, 218}, {120, 283},
      {123, 126}, {125, 200}, {126, 245}, {130, 156}, {131, 198} })
    none_of(is_off, driven_scenes.apart,
      { {2, 30}, {118, 15}, {118, 115}, {118, 303}, {119, 222}, {120, 214}, {120, 251} })
  end)
end)
