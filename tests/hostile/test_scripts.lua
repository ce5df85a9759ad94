-- Scripts that mean harm, or nonsense: whatever they do, a run ends by itself, with a status of its own.
--
-- HOSTILE_SCRIPTS is how many are tried, HOSTILE_SEED the first one's seed.
local command = require "testing.command"
local scripts = require "tests.hostile.scripts"

local count = tonumber(os.getenv "HOSTILE_SCRIPTS" or 100)
local first = tonumber(os.getenv "HOSTILE_SEED" or 1)

-- The limit of time is for each stretch of script, of which a run has a few dozen.
local limits = "--script-timeout 0.5 --script-memory 48M --memory 1G --threads 2"

describe("a hostile script", function()
  it("ends with a status, neither by a signal nor never", function()
    local folder = command.folder()
    for seed = first, first + count - 1 do
      local text = scripts.make(seed)
      folder:write("scene.lua", text)
      local result = command.shell('timeout -k 1 20 "$RAPID" run scene.lua -f 1-3 --quiet ' .. limits,
        { cwd = folder.path })
      local what = ("seed %d ended with %d: %s"):format(seed, result.status, result.stderr:sub(1, 500))
      assert.truthy(result.status <= 2, what)
      if result.status > 0 then assert.truthy(#result.stderr > 0 and #result.stderr < 10000, what) end
    end
  end)

  it("is the same text for the same seed, and mostly a legal program", function()
    local legal = 0
    for seed = 1, 100 do
      assert.equal(scripts.make(seed), scripts.make(seed))
      if loadstring(scripts.make(seed)) then legal = legal + 1 end
    end
    assert.truthy(legal >= 90, legal)
  end)
end)
