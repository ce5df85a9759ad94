-- Finds the simplest scene of passive_scenes that still fails.
--
--   local simplest = require "tests.verification.simplest"
--   scene, fault = simplest(scene, fault_of)
--
-- fault_of(scene) returns a description of the fault and its size, or nil. A simpler scene still counts as failing if
-- its fault has at least a hundredth of the size.
local passive_scenes = require "tests.verification.passive_scenes"

local max_tries = 300

return function(scene, fault_of)
  local fault, size = fault_of(scene)
  local least, tries, found = size / 100, 0, true
  while found and tries < max_tries do
    found = false
    for _, simpler in ipairs(passive_scenes.simpler(scene)) do
      tries = tries + 1
      local other, other_size = fault_of(simpler)
      if other and other_size >= least then
        scene, fault, found = simpler, other, true
        break
      end
    end
  end
  return scene, fault
end
