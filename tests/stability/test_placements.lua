-- Places every type of node at every position in a chain: before and after an emitter and a Solve, without them, on
-- empty sets, twice, around merges, among parents and children.
--
-- `rapid check` and a run must agree: either both refuse a node with the same message, or the run succeeds, with the
-- same files on one thread, on seven, and without pruning. The suite tries some placements; PLACEMENTS=1300 rapid test
-- tests/stability/test_placements.lua tries all, and PLACEMENT_SEED=7 others.
local amount = require "tests.amount"
local compared_runs = require "tests.stability.compared_runs"
local legal_nodes = require "tests.stability.legal_nodes"
local lehmer = require "tests.lehmer"
local placements = require "tests.stability.placements"

local count = math.min(amount.of("PLACEMENTS", 14), placements.count)
local seed = tonumber(os.getenv "PLACEMENT_SEED") or 1

local run = "rapid run $SCENE -f 1-4 -o {output}.####.csv --quiet "
local check = { name = "check", lines = "rapid check $SCENE", files = false }
local ways = { { name = "one", lines = run .. "--threads 1" }, { name = "seven", lines = run .. "--threads 7" },
  { name = "all", lines = run .. "--keep-all" }, check }

-- Returns a random selection of distinct placement numbers.
local function chosen()
  local draw, numbers = lehmer.new(), {}
  draw.start(seed, 1)
  for number = 1, placements.count do numbers[number] = number end
  for i = 1, count do
    local j = i + draw.below(placements.count - i + 1)
    numbers[i], numbers[j] = numbers[j], numbers[i]
  end
  return { unpack(numbers, 1, count) }
end

describe("a node at any place of a chain", function()
  it(("runs, or is refused by the check (%d of %d placements)"):format(count, placements.count), function()
    local faults, ran = {}, 0
    for _, number in ipairs(chosen()) do
      local text, name, place = placements.at(number)
      local fault, status = compared_runs.fault(compared_runs.scene(text), ways)
      if fault then faults[#faults + 1] = ("%d: :%s %s: %s\n%s"):format(number, name, place, fault, text) end
      if status == 0 then ran = ran + 1 end
    end
    assert.equal("", table.concat(faults, "\n\n"))
    assert.is_true(ran > count / 2)
  end)

  it("has arguments with which it runs, whatever its type", function()
    local never = {}
    for name in pairs(legal_nodes.types) do
      local ran = name == "create"
      for _, number in ipairs(ran and {} or placements.of(name)) do
        local fault, status = compared_runs.fault(compared_runs.scene(placements.at(number)), { check })
        ran = not fault and status == 0
        if ran then break end
      end
      if not ran then never[#never + 1] = name end
    end
    assert.same({}, never)  -- otherwise extend tests/stability/legal_nodes.lua
  end)
end)
