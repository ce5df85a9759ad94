-- Scenes with mistakes: each is refused with its position, or runs.
--
-- WRONG_SCENES is the number of scenes, WRONG_SEED the seed of the first.
local command = require "testing.command"
local amount = require "tests.amount"
local judged = require "tests.hostile.judged"
local wrong_scenes = require "tests.hostile.wrong_scenes"

local count = amount.of("WRONG_SCENES", 20)
local first = tonumber(os.getenv "WRONG_SEED" or 1)

-- The position is the scene's file with or without a line, a node, or a file that cannot be written.
local function is_placed(message)
  return message:find "scene%.lua:%d+: " or message:find "scene%.lua: " or message:find 'node "' or
    message:find ": can't be "
end

describe("a wrong scene", function()
  it("is an error with its line, its node or its file, or does what it says", function()
    local folder, refused = command.folder(), 0
    for seed = first, first + count - 1 do
      local text, mistakes = wrong_scenes.make(seed)
      local result = judged.run(folder, text, { seconds = 10, arguments = "--script-timeout 2 --script-memory 64M" })
      local what = ("seed %d (%s) "):format(seed, mistakes)
      assert.is_nil(result.complaint, what .. (result.complaint or ""))
      if result.status > 0 then
        refused = refused + 1
        assert.truthy(is_placed(result.stderr), what .. "is told without a place: " .. result.stderr:sub(1, 500))
      end
      if not loadstring(text) then assert.equal(2, result.status, what .. "is no program") end
    end
    -- Some mistakes are legal: a name that the script defines, or another valid number.
    assert.truthy(refused > 0.7 * count, refused)
  end)

  it("is the same text for the same seed", function()
    for seed = 1, 100 do assert.equal(wrong_scenes.make(seed), (wrong_scenes.make(seed))) end
  end)
end)
