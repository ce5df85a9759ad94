-- Runs a scene that may do anything, and judges how the run ends: with a status of its own, within its time and its
-- memory, and with a message of bounded length that no terminal takes for commands.
--
--   local judged = require "tests.hostile.judged"
--   local result = judged.run(folder, text, { seconds = 10, arguments = "--script-timeout 2" })
--   result.status, result.stderr; result.complaint if it did not end in this way
local address_space = require "tests.address_space"
local command = require "testing.command"

local judged = {}

local max_address_space = 3 * 2 ^ 20 -- KiB: --memory, plus memory that libraries and threads map but never touch
local longest_message = 10000

-- seconds: of processor time, which does not depend on other load. environment: further variables. any_address: true if
-- the address space is unlimited.
function judged.run(folder, text, limits)
  folder:write("scene.lua", text)
  local result = command.shell(('ulimit -t %d; %s timeout -k 1 120 "$RAPID" run scene.lua -f 1-3 --quiet ' ..
    "--memory 1G --threads 2 %s"):format(limits.seconds,
    limits.any_address and "" or address_space(max_address_space), limits.arguments), {
    cwd = folder.path, environment = limits.environment })
  if result.status > 2 then
    result.complaint = "ended with " .. result.status
  elseif result.status > 0 and (#result.stderr == 0 or #result.stderr > longest_message) then
    result.complaint = ("said %d bytes"):format(#result.stderr)
  elseif result.stderr:find "[%z\1-\8\11-\31\127]" then
    result.complaint = "said control characters"
  end
  if result.complaint then result.complaint = result.complaint .. ": " .. result.stderr:sub(1, 500) end
  return result
end

return judged
