-- The contents of a file depend only on its own request, not on other files of the run or on pruning.
--
-- For the scenes in graphs and those of its nodes, followed by random graphs, the files of a run with one output must
-- equal those of a run with several, and those of a run without pruning. The suite runs a few scenes; OUTPUT_SCENES=150
-- OUTPUT_SEED=7 rapid test tests/stability/test_outputs.lua runs more.
local amount = require "tests.amount"
local command = require "testing.command"
local compared_runs = require "tests.stability.compared_runs"
local lehmer = require "tests.lehmer"
local random_chains = require "tests.stability.random_chains"

local count = amount.of("OUTPUT_SCENES", 2)
local seed = tonumber(os.getenv "OUTPUT_SEED") or 1

local graphs = {}
for path in command.shell("ls $PWD/graphs/*.lua $PWD/graphs/nodes/*.lua").stdout:gmatch "%S+" do
  graphs[#graphs + 1] = path
end

-- Returns the path of a scene: first those in graphs, in an order that depends on the seed.
local function scene_of(number)
  local draw = lehmer.new()
  draw.start(seed, 1)
  for i = 1, number do
    local j = i + draw.below(math.max(#graphs - i + 1, 1))
    graphs[i], graphs[j] = graphs[j], graphs[i]
  end
  if number <= #graphs then return graphs[number] end
  return compared_runs.scene((random_chains.make(seed, number)))
end

local run = "rapid run $SCENE -f 1-5 --quiet "
local every, named = "-o {output}.####.csv ", "-o named.{output}.####.csv:mass,age,pscale "
local ways = {
  { name = "alone", lines = run .. every .. "\n" .. run .. named },
  { name = "together", lines = run .. every .. named .. "-o aside/more.{output}.####.csv:life,force,birthtime" },
  { name = "all", lines = run .. every .. named .. "--keep-all" },
}

describe("the files of an output", function()
  it(("are the same whatever other files there are (%d scenes of seed %d)"):format(count, seed), function()
    local faults = {}
    for number = 1, count do
      local scene = scene_of(number)
      local fault = compared_runs.fault(scene, ways)
      if fault then faults[#faults + 1] = ("scene %d of seed %d, %s: %s"):format(number, seed, scene, fault) end
    end
    assert.equal("", table.concat(faults, "\n\n"))
  end)
end)
