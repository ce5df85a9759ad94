-- The host runs this first in each of its states. It makes the environment of graph code and returns the functions that
-- the host calls.
--
-- The chunk is called with the host's native functions and returns a table of entry points.
local native = ...

require("elementary").replace(native.math_functions1, native.math_functions2, math)

local bytecode = require "bytecode"
local describe = require "describe"
local detail = require "detail"
local engine_errors = require "engine_errors"
local kernel = require "kernel"
local power_operator = require "power_operator"
local sandbox = require "sandbox"
local language = require "rapid"
local numeric = require "numeric"
local ramp = require "ramp"
local shape = require "shape"
local shared_state = require "shared_state"
local study = require "study"
local attribute_strings = require "text"
local vector = require "vec3"
local ffi = require "ffi"

-- Runs the body of a file. The position of a tail call that ends it is stored for errors, as it leaves no stack frame.
local function run(chunk, name, ...)
  if native.keeps_state then native.add_code(name:gsub("^@", ""), bytecode.code_of(chunk)) end
  return native.run(chunk, (name:gsub("^@", "")), bytecode.tail_call_line(chunk), ...)
end

-- Rapid's own modules are not on the search path of graph code, which loads files next to the graph or on RAPID_PATH.
local env, loaded, load_text = sandbox.make(native, run)
string.dump = nil -- no copy and no method of strings may reach it

local loading = {} -- nodes whose files are running

local function load_node(name)
  local text, where = native.read_node(name)
  if not text then return nil end
  if loading[name] then
    error(("%s uses the node %q instead of defining it; rename the file, because it hides the node")
      :format(where:gsub("^@", ""), name), 0)
  end
  local chunk, message = load_text(text, where)
  if not chunk then error(message, 0) end
  loading[name] = true
  local definition = run(chunk, where)
  loading[name] = nil
  if type(definition) ~= "table" or definition.name ~= name then
    error(("%s does not return rapid.node{ name = %q, ... }"):format(where:gsub("^@", ""), name), 0)
  end
  return definition
end

-- Loops are compiled early, before the functions that they call count as hot. The limits leave room for large kernels.
-- Without -narrow compiled code would use integers where the interpreter does not: a loop's -0 would become 0, and
-- bit.tobit(x + 1) would become tobit(x) + 1.
jit.opt.start("-narrow", "hotloop=4", "maxtrace=8000", "maxrecord=16000", "maxirconst=2000", "maxmcode=16384")

ffi.cdef(native.chunk_header)
local shapes = shape.make(native)
local strings = attribute_strings.make(native)
local engine = kernel.prepare(native.rand, shapes.pointer_of, native.point_names, strings)

local studies = study.make(native, vector)
local rapid = language.make(native, load_node, numeric.make(native.noise, native.curl_noise), shapes, studies)
loaded.rapid = rapid
env.vec3, env.quat = vector.make, vector.make_quat

local run_detail = detail.make(native.detail, engine.rand, native.point_names, strings)

local entry = {}

local definition -- the definition of the study file that was run

-- Runs the graph and returns its result: a node, or a table of nodes by name. With knobs the file is a study,
-- and the graph is that of its scene; with an empty table of knobs there is no graph.
function entry.run(text, name, knobs)
  local chunk, message = load_text(text, name)
  if not chunk then error(message, 0) end
  -- Interpreted: a graph's body runs once, and compilation changes the bytecode that bytecode.lua reads.
  jit.off()
  local result = run(chunk, name)
  definition = studies.definition_of(result)
  if definition and not knobs then error("this is a study; run it with: rapid study " .. name:sub(2), 0) end
  if not knobs then return result end
  if not definition then error("the file returns no study; end it with: return rapid.study { ... }", 0) end
  if next(knobs) then return run(definition.scene, name, knobs) end
end

function entry.loaded()
  collectgarbage() -- a finalizer that runs while a trace is recorded ends the recording
  jit.on()
end

function entry.load_node(name)
  return load_node(name) ~= nil
end

function entry.analyse(f, of_a_point)
  return bytecode.analyse(f, env, of_a_point, native.point_names)
end

function entry.remembers(f)
  return bytecode.remembers(f, env, native.cache_setting)
end

entry.fingerprint = bytecode.fingerprint
entry.engine_errors = engine_errors(native.memory_limit_text, native.output_setting)

-- Returns a function that runs the kernel f and compares the state that all points share before and after some of its
-- calls: the first, the second, the fourth, and so on. Raises an error if the kernel has changed it.
local function watched(f, runner, of_a_point)
  local calls = 0
  return function(...)
    calls = calls + 1
    local before = bit.band(calls, calls - 1) == 0 and shared_state.walk(f, env)
    if not before then return runner(...) end
    local a, b = runner(...)
    local name = shared_state.difference(before, shared_state.walk(f, env))
    if name ~= nil then
      error(("the kernel changes a value that all points share (%s); %s"):format(describe.name(name),
        bytecode.to_remember(of_a_point)), 0)
    end
    return a, b
  end
end
jit.off(watched) -- it makes a function, which LuaJIT does not compile

function entry.runner(f, layout, memory)
  local runner, set_params, translate = engine.runner(f, layout, memory)
  return watched(f, runner, true), set_params, translate
end

-- Returns the userdata that a function reaches, or nil if it reaches too many values.
function entry.objects_of(f)
  local objects, walked = {}, shared_state.walk(f, env)
  if not walked then return nil end
  for place = 1, walked.count do
    local value = walked.values[place]
    if type(value) == "userdata" then objects[#objects + 1] = value end
  end
  return objects
end

-- Moving shapes differ in each step.
entry.forget_moving_shapes = shapes.forget_moving

local details_of = {} -- run_detail() by function

-- Runs a :detail function; random: points to the key of the node's random numbers.
function entry.detail(f, number, time, dt, params, size, random, details)
  local key = ffi.cast("const uint64_t*", random)[0]
  local runner = details_of[f] or watched(f, run_detail, false)
  details_of[f] = runner
  return runner(f, engine.frame(number, time, dt, details), params, size, key, details)
end

function entry.study()
  return studies.describe(definition)
end

-- Evaluates a study's closed form at a frame, for the knobs of a row.
function entry.reference(number, time, dt, knobs)
  return definition.reference(engine.frame(number, time, dt), knobs)
end

function entry.study_error(points, reference)
  return studies.error_of(definition, points, reference)
end

-- Reports to the host each trace that the compiler gives up.
function entry.watch_traces()
  local vmdef = require "jit.vmdef"
  local info = require("jit.util").funcinfo
  jit.attach(function(what, _, f, pc, reason, argument)
    -- Loading a string ends a trace that is being recorded. That trace does not belong to a kernel.
    if what ~= "abort" or f == power_operator.rewrite then return end
    local place = info(f, pc)
    if type(reason) == "number" then
      if type(argument) == "function" then argument = info(argument).loc or "a native function" end
      reason = vmdef.traceerr[reason]:format(argument):gsub("bytecode (%d+)", function(op)
        return "bytecode " .. vmdef.bcnames:sub(op * 6 + 1, op * 6 + 6):gsub("%s", "")
      end)
    end
    native.trace_aborted(("%s:%d: %s"):format((place.source or "native"):gsub("^[@=]", ""), place.currentline or 0,
      tostring(reason)))
  end, "trace")
end

-- Evaluates a parameter that is a function of the frame.
function entry.call(f, number, time, dt)
  return f(engine.frame(number, time, dt))
end

-- Returns x, y, z of a vec3; nothing for any other cdata.
function entry.unpack_vec3(value)
  if ffi.istype(vector.type, value) then return value.x, value.y, value.z end
end

function entry.make_vec3(x, y, z)
  return vector.type(x, y, z)
end

entry.make_ramp = ramp.make

-- Never compiles these functions. Each is called once per pass or frame, which is not worth a trace, and with
-- jit.attach a trace event in a function that C calls directly ends the process (LuaJIT 2.1 of 2022).
for _, f in pairs(entry) do
  if type(f) == "function" then jit.off(f) end
end

return entry
