-- Random kernels (from random_kernels.lua) have the same bits, or the same error, in lanes on any number of threads,
-- traced and interpreted.
--
-- The suite runs a few. RANDOM_KERNELS=13000 RANDOM_KERNELS_SEED=7 rapid test tests/host/test_random_kernels.lua runs
-- more, and others. A scene that fails is shown with its seed and number, without the statements that its fault does
-- not need.
local amount = require "tests.amount"
local command = require "testing.command"
local kernel_modes = require "tests.host.kernel_modes"
local random_kernels = require "tests.host.random_kernels"
local shrink = require "tests.host.shrink"

local kernels = amount.of("RANDOM_KERNELS", 130)
local seed = tonumber(os.getenv "RANDOM_KERNELS_SEED") or 1
local batch = 50 -- scenes per interpreting process

local function write_scene(folder, made)
  local function write(name, text)
    local file = assert(io.open(("%s/%s.lua"):format(folder, name), "wb"))
    file:write(text)
    file:close()
  end
  write("scene", "local rapid = require \"rapid\"\n" .. random_kernels.text(made))
  for name, text in pairs(random_kernels.modules(made)) do write(name, text) end
end

-- A set of up to 4,096 points is one chunk, which one thread edits.
local function modes_of(made)
  return made.size > 4096 and { "lanes", "threads", "interpreted" } or { "lanes", "interpreted" }
end

-- Returns the smallest scene that has the fault, as text.
local function smallest(folder, made, fault)
  local modes = { fault:match "%w+$" }
  shrink(made, function()
    write_scene(folder, made)
    if modes[1] == "interpreted" then kernel_modes.interpret { folder } end
    local found = kernel_modes.difference(folder, modes)
    fault = found or fault
    return found ~= nil
  end)
  local text = { fault, random_kernels.text(made) }
  for name, module in pairs(random_kernels.modules(made)) do
    text[#text + 1] = ("-- %s.lua:\n%s"):format(name, module)
  end
  return table.concat(text, "\n")
end

describe("random kernels", function()
  it(("have the same bits in lanes, traced and interpreted (%d of seed %d)"):format(kernels, seed), function()
    local made_kernels, in_lanes, errors, number, faults = 0, 0, 0, 0, {}
    while made_kernels < kernels and #faults < 5 do
      local folder, scenes, folders = command.folder(), {}, {}
      while made_kernels < kernels and #scenes < batch do
        number = number + 1
        random_kernels.start(seed, number)
        local made = random_kernels.scene()
        folders[#folders + 1] = folder:file(tostring(number))
        assert.equal(0, os.execute("mkdir " .. command.quoted(folders[#folders])))
        write_scene(folders[#folders], made)
        scenes[#scenes + 1] = { number = number, made = made, folder = folders[#folders] }
        made_kernels = made_kernels + #made.kernels
      end
      kernel_modes.interpret(folders)
      for _, scene in ipairs(scenes) do
        local fault, no_lanes, outcome = kernel_modes.difference(scene.folder, modes_of(scene.made))
        if outcome and outcome:find "^frame" then
          in_lanes = in_lanes + #scene.made.kernels - #no_lanes
        else
          errors = errors + 1
        end
        if fault then
          local text = smallest(scene.folder, scene.made, fault)
          faults[#faults + 1] = ("scene %d of seed %d: %s"):format(scene.number, seed, text)
        end
        collectgarbage() -- the collector does not see the memory that a result holds outside of Lua
      end
    end
    assert.equal("", table.concat(faults, "\n\n"))
    if kernels < 100 then return end
    assert.is_true(in_lanes > 0.3 * made_kernels, "few of the kernels are programs of lanes")
    assert.is_true(errors < 0.3 * number, "many of the scenes end with an error")
  end)
end)
