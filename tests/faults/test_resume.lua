-- Runs with --cache that are killed at any moment and resumed on another number of threads. In the end each scene has
-- the files and the statistics of an uninterrupted run.
--
--   RAPID_RESUMES=20 rapid test tests/faults/test_resume.lua      kills per scene (0.2: every fifth)
--   RAPID_RESUME_SCENES=pile,drop                                 only these scenes
local amount = require "tests.amount"
local command = require "testing.command"
local lehmer = require "tests.lehmer"
local statistics = require "tests.same_statistics"

local kills = amount.of("RAPID_RESUMES", 0.2)
local only = os.getenv "RAPID_RESUME_SCENES"
local random = lehmer.new(tonumber(os.getenv "RAPID_RESUME_SEED" or 7))

local frames = 16
local root = command.binary():match "^(.*)/build/[^/]*/bin/[^/]*$"

local every = kills < 1 and math.floor(1 / kills + 0.5) or 1
kills = math.max(kills, 1)

local scenes, number = {}, 0
for path in io.popen(("ls %s/graphs/*.lua"):format(command.quoted(root))):lines() do
  local name = path:match "([^/]*)%.lua$"
  if not only or ("," .. only .. ","):find("," .. name .. ",", 1, true) then
    if number % every == 0 then scenes[#scenes + 1] = { name, path } end
    number = number + 1
  end
end

local script = [[
outputs="-o DIR/{output}.####.bgeo -o DIR/{output}.####.png --size 64x36 --events DIR/events.bgeo"
run() {
  folder=$1; shift
  $limit "$RAPID" run "$SCENE" -f 1-$FRAMES $(echo "$outputs" | sed "s|DIR|$folder|g") "$@" >said 2>&1
}
began=$(date +%s%N)
run whole --threads 1 --stats whole.json || { cat said; exit 1; }
took=$((($(date +%s%N) - began) / 1000000))
killed=0 runs=0
while [ $killed -lt $KILLS ]; do
  runs=$((runs + 1))
  set -- $WAITS; part=$1; shift; WAITS=$*
  limit="timeout -s KILL $(awk "BEGIN { print $took * $part / 1000 }")"
  run out --cache cache --cache-every 3 --threads $((runs % 3 + 1)) --stats out.json
  case $? in
    137) killed=$((killed + 1)) ;;
    0) rm -rf cache out ;;  # it was done: from the start again
    *) cat said; exit 1 ;;
  esac
done
limit=
run out --cache cache --cache-every 3 --threads 2 --stats out.json || { cat said; exit 1; }
diff -rq whole out || exit 1
grep "damaged\|it is left out" said
echo "$killed kills"
]]

describe("a run that is killed and picked up", function()
  for _, scene in ipairs(scenes) do
    it("has the files and the statistics of one that was not: " .. scene[1], function()
      local folder = command.folder()
      local waits = {}
      -- A fraction of a run's time; the first runs make most of the progress.
      for k = 1, 20 * kills do waits[k] = ("%.3f"):format(random.between(0.05, 0.95)) end
      local result = command.shell(script, { cwd = folder.path, environment = {
        SCENE = scene[2], FRAMES = tostring(frames), KILLS = tostring(kills), WAITS = table.concat(waits, " ") } })
      assert.equal("", result.stderr)
      assert.equal(kills .. " kills\n", result.stdout)
      assert.same(statistics.of(folder:read "whole.json"), statistics.of(folder:read "out.json"))
    end)
  end
end)
