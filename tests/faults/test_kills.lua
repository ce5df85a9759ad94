-- Runs that are killed at any moment, alone and while others run: only complete files remain.
--
--   RAPID_KILLS=1000 rapid test tests/faults/test_kills.lua      number of kills (20)
local command = require "testing.command"
local amount = require "tests.amount"

local kills = amount.of("RAPID_KILLS", 20)

local scene = [[
local rapid = require "rapid"
local ball = rapid.levelset.sphere { radius = 0.5, voxel = 0.05 }
ball:write("out/ball.vdb")
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.05 } } :gravity {} :solve {}
]]

-- Compares every file of out/ with that of a complete run, and counts hidden files.
local functions = [[
run() { "$RAPID" run scene.lua --quiet -f 1-12 -o out/a.####.ply -o out/b.####.csv -o out/c.####.vdb; }
compare() {
  for file in out/*; do
    [ -e "$file" ] || continue
    # A level set's file has an identifier of its own before its 57th byte.
    [ "$file" = out/ball.vdb ] && skip=57 || skip=0
    cmp -s -i $skip "$file" "whole/${file#out/}" || echo "$file is not whole after $1"
  done
}
hidden() { ls -A out | grep -c '^\.' || true; }
mkdir out
run || exit 1
mv out whole
mkdir out
]]

local function shell(script)
  local folder = command.folder()
  folder:write("scene.lua", scene)
  local result = command.shell(functions .. script, { cwd = folder.path })
  assert.equal(0, result.status, result.stderr)
  return result.stdout
end

describe("a run that is killed", function()
  it("leaves whole files, and the next removes what else it left", function()
    local script = {}
    for i = 1, kills do
      -- From the start of the process until about its end.
      script[i] = ("timeout -s KILL %.3f setpriv --pdeathsig KILL \"$RAPID\" run scene.lua --quiet -f 1-12 " ..
        "-o out/a.####.ply -o out/b.####.csv -o out/c.####.vdb\ncompare 'kill %d'\n"):format(
        0.02 + 0.6 * (i * 0.618034 % 1), i)
    end
    local said = shell(table.concat(script) .. "run || exit 1\ncompare 'the last run'\nhidden\n")
    assert.equal("0\n", said)
  end)
end)

describe("two runs into one folder", function()
  it("do not meet, under the same names", function()
    assert.equal("0\n", shell [[
for i in 1 2 3; do
  run & one=$!
  run & two=$!
  wait $one || echo "the first failed"
  wait $two || echo "the second failed"
  compare "round $i"
done
hidden
]])
  end)
end)
