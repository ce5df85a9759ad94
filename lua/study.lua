-- rapid.study: error and run time of one scene at many settings of its knobs.
--
-- A study file returns rapid.study{ ... }. The command runs the file once for its description, then once more, in a
-- fresh session, for each choice of the knobs: the graph is then the one that study.scene returns.
local describe = require "describe"

local function names_of(map)
  local names = {}
  for name in pairs(map) do names[#names + 1] = name end
  table.sort(names)
  return names
end

local fields = { name = true, scene = true, frames = true, sweep = true, lines = true, reference = true, error = true,
  error_frames = true, repeat_runs = true }
local norms = { rms = true, max = true, p95 = true, residual = true }

local shown = describe.value

-- native: the host's functions; vector: lua/vec3.lua.
local function make(native, vector)
  local definitions = setmetatable({}, { __mode = "k" }) -- keyed by the table that rapid.study returned

  local function is_knob(value)
    return type(value) == "string" or type(value) == "boolean"
      or type(value) == "number" and value == value and math.abs(value) < math.huge
  end

  -- Raises an error. The host adds the position of the graph code that called.
  local function wrong(...)
    error("rapid.study: " .. string.format(...), 0)
  end

  local function check(definition)
    if type(definition) ~= "table" then wrong("it needs a table, not %s", shown(definition)) end
    for name in pairs(definition) do
      if not fields[name] then
        wrong("unknown field %s%s", shown(name), native.did_you_mean(tostring(name), names_of(fields)))
      end
    end
    local function expect(ok, name, what)
      if not ok then wrong("%s = %s; it must be %s", name, shown(definition[name]), what) end
    end
    expect(type(definition.name) == "string" and definition.name ~= "", "name", "a string that is not empty")
    expect(type(definition.scene) == "function", "scene", "a function of the knobs that returns a node")
    local frames = definition.frames
    expect(type(frames) == "table" and #frames == 2, "frames", "the first and the last: {1, 48}")
    for _, frame in ipairs(frames) do
      if type(frame) ~= "number" or frame % 1 ~= 0 then wrong("frames: %s is not a whole number", shown(frame)) end
    end
    if frames[2] <= frames[1] then wrong("frames = {%d, %d}; the last must come after the first", unpack(frames)) end
    expect(type(definition.sweep) == "table" and next(definition.sweep) ~= nil, "sweep",
      "lists of values by knob: { substeps = {1, 2, 4} }")
    for knob, values in pairs(definition.sweep) do
      if type(knob) ~= "string" then wrong("sweep: the knob %s is not a name", shown(knob)) end
      if type(values) ~= "table" or #values == 0 then wrong("sweep: %s must be a list of values", knob) end
      for _, value in ipairs(values) do
        if not is_knob(value) then
          wrong("sweep: %s contains %s; values must be finite numbers, strings or booleans", knob, shown(value))
        end
      end
    end
    local norm, reference = definition.error, definition.reference
    expect(norm == nil or type(norm) == "function" or norms[norm], "error",
      '"rms", "max", "p95", "residual" or a function(points, reference)')
    if norm == "residual" then
      expect(reference == nil, "reference", "removed: a residual needs no reference")
    else
      expect(type(reference) == "function" or type(reference) == "table" and next(reference) ~= nil, "reference",
        "a function of the frame that returns { P = {...} }, or knobs: { substeps = 512 }")
    end
    if type(reference) == "table" then
      for knob, value in pairs(reference) do
        if not is_knob(value) then wrong("reference: %s = %s; it must be a number, a string or a boolean", knob,
          shown(value)) end
      end
    end
    local over = definition.error_frames
    expect(over == nil or over == "all" or over == "last", "error_frames", '"all" or "last"')
    local runs = definition.repeat_runs
    expect(runs == nil or type(runs) == "number" and runs >= 1 and runs <= 100000 and runs % 1 == 0,
      "repeat_runs", "a whole number, at least 1 and at most 100000")
    local lines = definition.lines
    expect(lines == nil or type(lines) == "string" or type(lines) == "table", "lines",
      "the name of a knob, or a list of them")
  end

  local function define(definition)
    check(definition)
    local study = {}
    definitions[study] = definition
    return study
  end

  -- Returns the description that the command needs before it runs a scene. Missing fields have the host's defaults.
  local function describe_study(definition)
    local own = type(definition.error) == "function"
    local lines = definition.lines
    return {
      name = definition.name,
      sweep = definition.sweep,
      lines = type(lines) == "string" and { lines } or lines or {},
      frames = { definition.frames[1], definition.frames[2] },
      reference = type(definition.reference) == "table" and definition.reference or nil,
      error = own and "own" or definition.error,
      error_frames = definition.error_frames,
      repeat_runs = definition.repeat_runs,
    }
  end

  -- Returns the values of a flat column, of `width` numbers each.
  local function column_of(flat, width)
    if width == 1 then return flat end
    local values = {}
    for i = 1, #flat, width do
      values[#values + 1] = width == 3 and vector.type(flat[i], flat[i + 1], flat[i + 2])
        or vector.make_quat(flat[i], flat[i + 1], flat[i + 2], flat[i + 3])
    end
    return values
  end

  -- columns: { { name, width, flat numbers }, ... }
  local function points_of(columns)
    local points = {}
    for _, column in ipairs(columns) do points[column[1]] = column_of(column[3], column[2]) end
    return points
  end

  local function error_of(definition, points, reference)
    local value = definition.error(points_of(points), points_of(reference))
    if type(value) ~= "number" then error(("the study's error is %s; it must be a number"):format(shown(value)), 0) end
    return value
  end

  return {
    define = define,
    definition_of = function(value) return definitions[value] end,
    describe = describe_study,
    error_of = error_of,
  }
end

return { make = make }
