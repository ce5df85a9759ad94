-- Runs scenes for tests/host/kernel_modes.lua, in a process that interprets them.
local kernel_modes = require "tests.host.kernel_modes"

it("runs each scene of the list", function()
  for folder in io.lines(os.getenv "SCENES") do
    local file = assert(io.open(folder .. "/interpreted", "wb"))
    file:write((kernel_modes.outcome(folder, { threads = 1 })))
    file:close()
    collectgarbage() -- the collector does not see the memory that a result holds outside of Lua
  end
end)
