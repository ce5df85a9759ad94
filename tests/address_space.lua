-- A shell line that limits the address space of the next command, in KiB. Empty if the command cannot start with a
-- limit: one with the address sanitizer maps terabytes.
local command = require "testing.command"

local can_be_limited

return function(kib)
  if can_be_limited == nil then
    local result = command.shell('ulimit -v 4194304; exec "$RAPID" --version')
    can_be_limited = result.status == 0
  end
  return can_be_limited and ("ulimit -v %d;"):format(kib) or ""
end
