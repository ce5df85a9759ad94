-- Random numbers that are the same everywhere: Lehmer's generator with the multiplier of Park, Miller and Stockmeyer
-- (1993). Each generator has a state of its own.
--
--   local draw = require "tests.lehmer".new(12345)      from the folder of the project; from 1 to 2147483646
--   draw.random()              in (0, 1)
--   draw.below(n)              a whole number, from 0 to n - 1
--   draw.between(low, high)
--   draw.magnitude(low, high)  10 to a power between two
--   draw.chance(part)          true in this part of the calls
--   draw.pick(list)
--   draw.start(seed, number)   begins again, for the scene of that number
local lehmer = {}

local modulus = 2 ^ 31 - 1

function lehmer.new(state)
  local draw = {}
  local function next_state()
    state = state * 48271 % modulus
    return state
  end
  local function random() return next_state() / modulus end
  draw.random = random
  function draw.below(n) return next_state() % n end
  function draw.between(low, high) return low + (high - low) * random() end
  function draw.magnitude(low, high) return 10 ^ draw.between(low, high) end
  function draw.chance(part) return random() < part end
  function draw.pick(list) return list[math.floor(random() * #list) + 1] end

  -- Seeds and numbers are small and close: the first numbers that they give are alike, and left out.
  function draw.start(seed, number)
    state = (seed * 1000003 + number * 7919) % (modulus - 1) + 1
    for _ = 1, 3 do random() end
  end
  return draw
end

return lehmer
