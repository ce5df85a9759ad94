-- Malicious or nonsensical scripts. Every run ends by itself, with a documented status.
--
-- HOSTILE_SCRIPTS is the number of scripts, HOSTILE_STRESSED the number of those that run while Lua collects garbage
-- all the time (a fifth), HOSTILE_SEED the seed of the first.
local command = require "testing.command"
local amount = require "tests.amount"
local library = require "tests.faults.library"
local judged = require "tests.hostile.judged"
local scripts = require "tests.hostile.scripts"

local count = amount.of("HOSTILE_SCRIPTS", 10)
local many_stressed = tonumber(os.getenv "HOSTILE_STRESSED" or math.ceil(count / 5))
local first = tonumber(os.getenv "HOSTILE_SEED" or 1)

-- The time limit applies to each call of a script, of which a run has a few dozen.
local limits = { seconds = 20, arguments = "--script-timeout 0.5 --script-memory 48M" }

-- Lua collects garbage all the time, and each block of memory is followed by a guard page and becomes one when freed.
local stressed = {
  seconds = 60, arguments = "--script-timeout 1 --script-memory 48M", any_address = true,
  environment = { LD_PRELOAD = library, RAPID_STRESS = "collector,guard" },
}

local function try(seeds, how)
  local folder = command.folder()
  for seed = first, first + seeds - 1 do
    local result = judged.run(folder, scripts.make(seed), how)
    assert.is_nil(result.complaint, ("seed %d %s"):format(seed, result.complaint))
  end
end

describe("a hostile script", function()
  it("ends with a status, neither by a signal nor never", function() try(count, limits) end)

  it("touches no memory that is not its own", function() try(many_stressed, stressed) end)

  it("is the same text for the same seed, and mostly a legal program", function()
    local legal = 0
    for seed = 1, 100 do
      assert.equal(scripts.make(seed), scripts.make(seed))
      if loadstring(scripts.make(seed)) then legal = legal + 1 end
    end
    assert.truthy(legal >= 90, legal)
  end)
end)
