-- Rapid's replacements for LuaJIT's own messages. Only this table knows how LuaJIT words them.
--
-- full_stack: the stack is full when the error is raised, and leaves no room for a trace. is_memory: memory ran out.
-- The strings of `endings` are appended to LuaJIT messages that end with their key.

local function added(text, remedy) return { message = ("%s; %s"):format(text, remedy) } end

local no_clock = "a script has no clock and no environment variables; use frame.time, and rapid.param for values"
local no_time = "the time is frame.time, in function(frame) ... end"
local no_chance = "math.random does not exist, because each run would differ; use p:rand(k), which is the same in " ..
  "every run"

-- memory_limit: the message for a state that exceeds its memory limit. output: the program's name for the setting of
-- output files.
return function(memory_limit, output)
  local no_files = ("a script can't open files; rapid.points.read and rapid.mesh.read read files, :write and %s " ..
    "write them")
    :format(output)
  return {
    ["not enough memory"] = { message = memory_limit, is_memory = true },
    -- Functions for Lua turn their exceptions into errors: this one found no memory for that.
    ["C++ exception"] = { message = "C++ exception", is_memory = true },
    ["stack overflow"] = { message = "stack overflow: a function calls itself endlessly", full_stack = true },
    -- `p.v.x = 1`
    ["attempt to write to constant location"] = {
      message = "a component of a vector or a field of the frame can't be assigned; make a new vec3: p.v = vec3(1, " ..
        "p.v.y, p.v.z)",
    },
    ["attempt to index global 'io' (a nil value)"] = added("attempt to index global 'io' (a nil value)", no_files),
    ["attempt to index global 'os' (a nil value)"] = added("attempt to index global 'os' (a nil value)", no_clock),
    ["attempt to index global 'rapid' (a nil value)"] =
      added("attempt to index global 'rapid' (a nil value)", 'begin the file with: local rapid = require "rapid"'),
    ["attempt to perform arithmetic on global 'time' (a nil value)"] =
      added("attempt to perform arithmetic on global 'time' (a nil value)", no_time),
    ["attempt to index global 'frame' (a nil value)"] =
      added("attempt to index global 'frame' (a nil value)", no_time),
    ["attempt to call field 'random' (a nil value)"] =
      added("attempt to call field 'random' (a nil value)", no_chance),
    endings = {
      ["(number expected, got nil)"] = "a name that does not exist is nil; " .. no_time,
      ["(number expected, got cdata)"] = "the frame, a point and a vec3 are not numbers; use frame.time, p.age or v.x",
    },
  }
end
