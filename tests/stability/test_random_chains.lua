-- Random graphs of several chains (random_chains.lua makes them), each run in all ways that must not matter.
--
-- A graph has the same files on one thread, on two and on seven, with nothing left out, with attributes that other
-- files ask for, in two parts that are merged, and after a snapshot; or ends with the same error, which names its node.
-- In the suite some are run; CHAINS=3000 CHAINS_SEED=7 rapid test tests/stability/test_random_chains.lua runs more, and
-- others. A graph that fails is shown whole, with its number and seed.
local amount = require "tests.amount"
local compared_runs = require "tests.stability.compared_runs"
local random_chains = require "tests.stability.random_chains"

local count = amount.of("CHAINS", 30)
local seed = tonumber(os.getenv "CHAINS_SEED") or 1
local first = tonumber(os.getenv "CHAINS_FIRST") or 1

local function ways_of(outputs)
  local run = "rapid run $SCENE -o {output}.####.csv --quiet --memory 1G "
  local part = "rapid run $SCENE -f 1-6 -o {output}.####.csv --quiet --memory 1G --part "
  local merges = ""
  for _, output in ipairs(outputs) do
    merges = merges .. ("\nrapid merge -o %s.####.csv 'aside/%s_part{part}.####.csv' --quiet"):format(output, output)
  end
  return {
    { name = "one", lines = run .. "-f 1-6 --threads 1" },
    { name = "two", lines = run .. "-f 1-6 --threads 2" },
    { name = "seven", lines = run .. "-f 1-6 --threads 7" },
    { name = "all", lines = run .. "-f 1-6 --keep-all" },
    { name = "more", lines = run .. "-f 1-6 -o aside/{output}.####.csv:mass,pscale,age,life,birthtime,own" },
    { name = "resumed", lines = run .. "-f 1-3 --cache aside/cache\n" .. run .. "-f 1-6 --cache aside/cache" },
    { name = "parts", lines = "cd aside\n" .. part .. "1/2\n" .. part .. "2/2\ncd .." .. merges, except = "written*",
      is_part = true },
  }
end

describe("a random graph", function()
  it(("is the same graph in any way that it is run (%d of seed %d)"):format(count, seed), function()
    local faults, ran = {}, 0
    for number = first, first + count - 1 do
      local text, outputs = random_chains.make(seed, number)
      local fault, status = compared_runs.fault(compared_runs.scene(text), ways_of(outputs))
      if fault then faults[#faults + 1] = ("graph %d of seed %d: %s\n%s"):format(number, seed, fault, text) end
      if status == 0 then ran = ran + 1 end
    end
    assert.equal("", table.concat(faults, "\n\n"))
    assert.is_true(ran > count / 2, ran)
  end)
end)
