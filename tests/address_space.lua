-- A line of the shell that limits the address space of the command that comes next, in KiB; empty where the command
-- can't start so: one with the address sanitizer maps terabytes.
local command = require "testing.command"

local can_be_limited

return function(kib)
  if can_be_limited == nil then
    local result = command.shell('ulimit -v 4194304; exec "$RAPID" --version')
    can_be_limited = result.status == 0
  end
  return can_be_limited and ("ulimit -v %d;"):format(kib) or ""
end
