-- The module `rapid` of script-level tests: runs scenes, and shows the points of their frames.
--
--   local result = rapid.run("graphs/sparks.lua", { frames = {1, 48}, set = { rate = 1000 } })
--   result[48]                 the points of a frame: of the output main, or of the only output
--   result:frames()            iterates: frame, points
--   result:output "smoke"      the frames of another output
--   result.warnings            a list of messages
--   result.trace_aborts        messages on traces that LuaJIT gave up, after { watch_traces = true }; such kernels
--                              process one point at a time
--   result.no_lanes            messages on kernels that always do so, with reasons, after { watch_lanes = true }
--   #points, points[1].P, points:by_id(7).heat, points:min "P", points:mean "v", points:group "hot"
local vector = require "vec3"
local ffi = require "ffi"

return function(native)
  local rapid = {}

  -- Returns a value from its components.
  local function value_of(x, y, z, w)
    if w then return vector.quat(x, y, z, w) end
    if z then return vector.make(x, y, z) end
    return x
  end

  -- A point: its attributes by name, and its groups.
  local point_methods = {}
  function point_methods:within(group)
    return native.within(self[1], self[2], group)
  end
  local point_metatable = {
    __index = function(self, name)
      return point_methods[name] or value_of(native.value(rawget(self, 1), rawget(self, 2), name))
    end,
    __newindex = function() error("the points of a result can't be changed", 2) end,
    __tostring = function(self) return ("point %d of %s"):format(rawget(self, 2), native.source(rawget(self, 1))) end,
  }

  local points_methods = {}
  function points_methods:by_id(id)
    local place = native.place_of(self, id)
    return place and self[place]
  end
  function points_methods:min(name) return value_of(native.reduce(self, name, "min")) end
  function points_methods:max(name) return value_of(native.reduce(self, name, "max")) end
  function points_methods:mean(name) return value_of(native.reduce(self, name, "mean")) end
  function points_methods:group(name) return native.group(self, name) end
  function points_methods:names() return native.names(self) end
  function points_methods:groups() return native.group_names(self) end

  native.points_metatable.__index = function(self, key)
    if type(key) ~= "number" then return points_methods[key] end
    if key < 1 or key > native.size(self) or key % 1 ~= 0 then return nil end
    return setmetatable({ self, key }, point_metatable)
  end
  native.points_metatable.__tostring = function(self)
    return ("%d points of %s"):format(native.size(self), native.source(self))
  end

  -- The frames of one output.
  local result_methods = {}
  local result_metatable = {}
  function result_metatable.__index(self, key)
    if type(key) ~= "number" then return result_methods[key] end
    local run = rawget(self, "run")
    if not self.output_name then
      error(("the scene has several outputs, and none is called main; choose one: result:output %q")
        :format(self.outputs[1]), 2)
    end
    local points = run.frames[self.output_name][key]
    if not points then error(("frame %s was not run; frames %d to %d were"):format(key, run.first, run.last), 2) end
    return points
  end

  local function result_of(run, output_name)
    return setmetatable({
      run = run, output_name = output_name or false, outputs = run.outputs, warnings = run.warnings,
      trace_aborts = run.trace_aborts,
      no_lanes = run.no_lanes,
    }, result_metatable)
  end

  function result_methods:frames()
    local frame = self.run.first - 1
    return function()
      frame = frame + 1
      if frame <= self.run.last then return frame, self[frame] end
    end
  end

  function result_methods:output(name)
    if not self.run.frames[name] then
      error(("the scene has no output %q; it has %s"):format(name, table.concat(self.outputs, ", ")), 2)
    end
    return result_of(self.run, name)
  end

  -- Formats a value as --set takes it on the command line.
  local function setting(name, value)
    if type(value) == "number" then return ("%.17g"):format(value) end
    if type(value) == "boolean" or type(value) == "string" then return tostring(value) end
    local ok, v = pcall(vector.make, value)
    if ffi.istype(vector.type, value) then ok, v = true, value end
    if ok then return ("%.17g,%.17g,%.17g"):format(v.x, v.y, v.z) end
    error(("set: %s is a %s; it must be a number, a boolean, a string or a vec3"):format(name, type(value)), 3)
  end

  local known_options = { frames = true, set = true, seed = true, threads = true, script_timeout = true,
    check_declarations = true, watch_lanes = true, watch_traces = true }

  local function whole(name, value, least)
    if type(value) ~= "number" or value % 1 ~= 0 or (least and value < least) then
      error(("rapid.run: %s = %s; it must be a whole number%s"):format(name, tostring(value),
        least and (", at least " .. least) or ""), 3)
    end
    return value
  end

  -- Runs the frames of a scene from its first to frames[2] and stores those from frames[1]. Raises the error that
  -- `rapid run` would print.
  function rapid.run(path, options)
    options = options or {}
    if type(path) ~= "string" then error("rapid.run needs the path of a graph", 2) end
    for name in pairs(options) do
      if not known_options[name] then
        error(("rapid.run: unknown option %q; it must be frames, set, seed, threads, script_timeout, "
          .. "check_declarations, watch_traces or watch_lanes"):format(tostring(name)), 2)
      end
    end
    local frames = options.frames
    if type(frames) ~= "table" or #frames ~= 2 then
      error("rapid.run: frames is missing; give the first and the last: { frames = {1, 48} }", 2)
    end
    local run = { first = whole("frames", frames[1]), last = whole("frames", frames[2]), outputs = {} }
    if run.last < run.first then
      error(("rapid.run: frames = {%d, %d} ends before it begins"):format(run.first, run.last), 2)
    end

    local set = {}
    for name, value in pairs(options.set or {}) do set[name] = setting(name, value) end
    local ok, found, warnings, trace_aborts, no_lanes = pcall(native.run, path, {
      first = run.first,
      last = run.last,
      seed = options.seed and whole("seed", options.seed, 0),
      threads = options.threads and whole("threads", options.threads, 0),
      script_timeout = options.script_timeout,
      check_declarations = options.check_declarations == true,
      watch_traces = options.watch_traces == true,
      watch_lanes = options.watch_lanes == true,
      set = set,
    })
    if not ok then error(found, 0) end
    run.frames, run.warnings = found, warnings
    if options.watch_traces then run.trace_aborts = trace_aborts end
    if options.watch_lanes then run.no_lanes = no_lanes end
    for name in pairs(found) do table.insert(run.outputs, name) end
    table.sort(run.outputs)
    return result_of(run, found.main and "main" or #run.outputs == 1 and run.outputs[1])
  end

  return rapid
end
