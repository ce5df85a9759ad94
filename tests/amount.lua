-- The number of random cases of a test.
--
--   local amount = require "tests.amount"            from the folder of the project
--   local scenes = amount.of("STABILITY_SCENES", 100)
--   if amount.thorough then it("takes long", ...) end
--
-- RAPID_TEST_SCALE multiplies the numbers of all tests. tests/run leaves it at 1, tests/run --thorough sets 10, and 100
-- gives the counts of docs/reliability.md.
local amount = {}

local scale = tonumber(os.getenv "RAPID_TEST_SCALE" or 1)

-- True if this run includes slow tests.
amount.thorough = scale > 1

-- Returns the environment variable `name`, or `quick` times the scale.
function amount.of(name, quick)
  return tonumber(os.getenv(name) or quick * scale)
end

return amount
