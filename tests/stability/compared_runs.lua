-- Runs a scene in several ways, each as a separate process in a separate folder, and compares the results.
--
--   local compared_runs = require "tests.stability.compared_runs"      from the folder of the project
--   local fault, status = compared_runs.fault(compared_runs.scene(text), {
--     { name = "one", lines = "rapid run $SCENE -f 1-4 -o a.####.csv --threads 1" }, ... })
--
-- A way consists of shell lines and stops at the first one that fails. `fault` is nil if all ways end with the status
-- of the first one and, if that is 0, with the same files, otherwise with the same last message, which must have the
-- form FILE:LINE: node "NAME": MESSAGE. The contents of the folder `aside` are not compared. Fields of a way:
--
--   files     false if it leaves none
--   except    a pattern of files that it lacks
--   is_part   true if it runs parts, in which another point may fail first, and which may be refused
local command = require "testing.command"

local compared_runs = {}

local folder = command.folder()

-- Writes a scene with this text and returns its path.
function compared_runs.scene(text)
  return folder:write("scene.lua", 'local rapid = require "rapid" ' .. text)
end

local function is_error_of_node(message)
  return message:match '^%S+:%d+: node "[%w_]+": .' ~= nil
end

-- Removes the amount of free memory from a message, because it differs between runs.
local function comparable(message) return (message:gsub(", but only %S+ %wiB of %S+ %wiB are free", "")) end

local function outcome_of(way)
  local log = folder:read("ways/" .. way.name .. ".log")
  return {
    status = tonumber(folder:read("ways/" .. way.name .. ".status")), log = log, message = log:match "([^\n]*)\n*$",
    files = folder:read("ways/" .. way.name .. ".files"),
  }
end

local function fault_of(way, outcome, first_way, first)
  if outcome.status > 2 then return ("%s ended with %d: %s"):format(way.name, outcome.status, outcome.log) end
  if outcome.status > 0 and not is_error_of_node(outcome.message) then
    return ("%s: an error without its place: %s"):format(way.name, outcome.log)
  end
  if way.is_part and outcome.status == 2 then return nil end
  local same_message = outcome.status == 0 or way.is_part or comparable(outcome.message) == comparable(first.message)
  if (outcome.status > 0) ~= (first.status > 0) or not same_message then
    return ("%s ended with %d: %s\nand %s with %d: %s"):format(way.name, outcome.status, outcome.log, first_way.name,
      first.status, first.log)
  end
  if first.status == 0 and outcome.files ~= "" then return outcome.files end
end

function compared_runs.fault(scene, ways)
  local script = "rm -rf ways && mkdir ways && cd ways\nexport SCENE=" .. command.quoted(scene) ..
    '\nrapid() { timeout -k 1 120 "$RAPID" "$@"; }\n'
  for _, way in ipairs(ways) do
    script = script .. ("mkdir -p %s/aside\n(cd %s && set -e\n%s\n) >%s.log 2>&1 </dev/null; echo $? >%s.status\n")
      :format(way.name, way.name, way.lines, way.name, way.name)
  end
  for _, way in ipairs(ways) do
    -- OpenVDB gives each volume file a random UUID.
    script = script .. ("diff -rq -x aside -x '*.vdb' -x '%s' %s %s >%s.files\n"):format(way.except or "", ways[1].name,
      way.files == false and ways[1].name or way.name, way.name)
  end
  command.shell(script, { cwd = folder.path })
  local first = outcome_of(ways[1])
  for _, way in ipairs(ways) do
    local fault = fault_of(way, outcome_of(way), ways[1], first)
    if fault then return fault, first.status end
  end
  return nil, first.status
end

return compared_runs
