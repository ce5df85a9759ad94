-- Runs a scene in each mode of its kernels, and compares the results bitwise.
--
--   local kernel_modes = require "tests.host.kernel_modes"     from the folder of the project
--   kernel_modes.interpret(folders)          runs scenes in the interpreter; a scene is a folder with a scene.lua
--   kernel_modes.difference(folder, modes)   nil if these modes have the same results, or the same error, as traces
--   kernel_modes.outcome(folder, options)    all values of all frames as text, or the error
--
-- The modes are "lanes", on one thread; "threads", lanes on seven threads; and "interpreted". They are compared with
-- traces, which take one point at a time. No scene can turn the compiler off, so interpreted scenes run in a separate
-- process that reads a copy of Rapid's Lua files with one call removed.
local command = require "testing.command"
local ffi = require "ffi"
local vector = require "vec3"

local kernel_modes = {}

local rapid = require "rapid" -- the module for tests

local frames = {1, 3}

local function text_of(value)
  if type(value) == "number" then return ("%.17g"):format(value) end
  if type(value) == "string" then return ("%q"):format(value) end
  local text = ("%.17g %.17g %.17g"):format(value.x, value.y, value.z)
  return ffi.istype(vector.quat, value) and ("%s %.17g"):format(text, value.w) or text
end

-- Also returns the list of kernels that are not lane programs.
function kernel_modes.outcome(folder, options)
  options.frames = frames
  local ok, result = pcall(rapid.run, folder .. "/scene.lua", options)
  if not ok then return (result:gsub(folder:gsub("%W", "%%%0") .. "/", "")), {} end
  local lines = {}
  for frame, points in result:frames() do
    lines[#lines + 1] = ("frame %d: %d points"):format(frame, #points)
    local names, groups = points:names(), points:groups()
    for k = 1, #points do
      local point = points[k]
      for _, name in ipairs(names) do lines[#lines + 1] = ("%d %s %s"):format(k, name, text_of(point[name])) end
      for _, name in ipairs(groups) do
        lines[#lines + 1] = ("%d within %s %s"):format(k, name, tostring(point:within(name)))
      end
    end
  end
  return table.concat(lines, "\n"), result.no_lanes or {}
end

-- An installation whose Lua files do not turn the compiler on again after the graph is loaded.
local interpreter
local function make_interpreter()
  interpreter = command.folder()
  local made = command.shell([[
set -e
mkdir -p "$AT/bin" "$AT/share/rapid"
cp "$RAPID" "$AT/bin/rapid"
cp -rL "$(dirname "$RAPID")/../share/rapid/lua" "$AT/share/rapid/"]], { environment = { AT = interpreter.path } })
  assert(made.status == 0, made.stderr)
  local path = "share/rapid/lua/host.lua"
  local text, count = interpreter:read(path):gsub("jit%.on%(%)", "")
  assert(count == 1, "lua/host.lua turns the compiler on elsewhere")
  interpreter:write(path, text)
end

-- Runs scenes in the interpreter. The outcome of each is written to the file `interpreted` in its folder.
function kernel_modes.interpret(folders)
  if not interpreter then make_interpreter() end
  local list = interpreter:write("folders", table.concat(folders, "\n") .. "\n")
  local run = command.shell('exec "$AT/bin/rapid" test tests/host/interpreted_scenes.lua',
    { environment = { AT = interpreter.path, SCENES = list } })
  assert(run.status == 0, run.stdout .. run.stderr)
end

-- Returns the first line in which two outcomes differ; nil if they are equal.
local function first_difference(a, b)
  if a == b then return nil end
  local next_a, next_b = a:gmatch "[^\n]+", b:gmatch "[^\n]+"
  local line_a, line_b
  repeat line_a, line_b = next_a(), next_b() until line_a ~= line_b or not line_a
  return ("%s\n  and %s"):format(tostring(line_a), tostring(line_b))
end

-- modes: the names of the modes that are compared with traces. Also returns the list of kernels that are not lane
-- programs, and the outcome.
function kernel_modes.difference(folder, modes)
  local traced = kernel_modes.outcome(folder, { threads = 1, watch_traces = true })
  local no_lanes = {}
  local outcomes = {}
  function outcomes.lanes()
    local text
    text, no_lanes = kernel_modes.outcome(folder, { threads = 1, watch_lanes = true })
    return text
  end
  function outcomes.threads() return (kernel_modes.outcome(folder, { threads = 7 })) end
  function outcomes.interpreted()
    local file = assert(io.open(folder .. "/interpreted", "rb"))
    local text = file:read "*a"
    file:close()
    return text
  end
  for _, mode in ipairs(modes) do
    local found = first_difference(traced, outcomes[mode]())
    if found then return ("traced: %s %s"):format(found, mode), no_lanes end
  end
  return nil, no_lanes, traced
end

return kernel_modes
