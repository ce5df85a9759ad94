-- What a file holds depends on what it asks for alone: neither on other files of the run nor on what is left out.
--
-- For the scenes of graphs and of its nodes, and for random graphs behind them, the files of a run with one output are
-- those of a run with several, and those of a run that leaves nothing out. In the suite a few scenes are run;
-- OUTPUT_SCENES=150 OUTPUT_SEED=7 rapid test tests/stability/test_outputs.lua runs more.
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

-- The path of a scene: those of graphs first, in an order that the seed gives.
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
