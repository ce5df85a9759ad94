-- What tests/host/kernel_modes.lua runs in a process whose scenes are interpreted.
local kernel_modes = require "tests.host.kernel_modes"

it("runs each scene of the list", function()
  for folder in io.lines(os.getenv "SCENES") do
    local file = assert(io.open(folder .. "/interpreted", "wb"))
    file:write((kernel_modes.outcome(folder, { threads = 1 })))
    file:close()
    collectgarbage() -- of what a result holds outside of Lua the collector sees nothing
  end
end)
