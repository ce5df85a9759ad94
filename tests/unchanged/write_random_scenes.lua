-- Writes the random scenes of tests/stability to files. tests/unchanged/run runs it, with the folder in
-- UNCHANGED_FOLDER and the number of scenes in UNCHANGED_COUNT.
local random_scenes = require "tests.stability.random_scenes"

local folder = assert(os.getenv "UNCHANGED_FOLDER")
local count = tonumber(os.getenv "UNCHANGED_COUNT")
local seed = 1

local function write(name, text)
  local file = assert(io.open(folder .. "/" .. name, "wb"))
  file:write('local rapid = require "rapid"\n', text, "\n")
  file:close()
end

describe("random scenes", function()
  it("are written", function()
    for number = 1, count do
      random_scenes.start(seed, number)
      write(("%03d.lua"):format(number), random_scenes.text())
    end
    for number = 1, count / 20 do
      random_scenes.start(seed, number)
      write(("chunks_%02d.lua"):format(number), random_scenes.chunks())
    end
  end)
end)
