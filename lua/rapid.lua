-- The graph language: the table that `require "rapid"` returns to graph code.
--
-- This file only gathers arguments. The host makes the values, checks them and remembers the positions of the calls.
-- Positional arguments (a path, a mesh, a motion) are turned into named ones.
local ffi = require "ffi"
local vector = require "vec3"
local describe = require "describe"

local function options_of(what, options)
  if options == nil then return {} end
  if type(options) ~= "table" then
    error(("%s needs a table of options, not %s"):format(what, describe.operand(options)), 3)
  end
  local copy = {}
  for name, value in pairs(options) do copy[name] = value end
  return copy
end

local function names_of(map)
  local names = {}
  for name in pairs(map) do names[#names + 1] = name end
  table.sort(names)
  return names
end

-- native: the host's functions; load_node(name): the definition of a Lua node found on the search path, or nil;
-- numeric: the contents of rapid.math; shapes: queries of shapes (lua/shape.lua); studies: lua/study.lua.
local function make(native, load_node, numeric, shapes, studies)
  local rapid = { math = numeric }

  -- Returns a maker with the named positional arguments first.
  local function maker(what, ...)
    local positional = { ... }
    local shown = "rapid." .. what:gsub("^motion%.", "")
    return function(...)
      local options = options_of(shown, (select(#positional + 1, ...)))
      for place, name in ipairs(positional) do
        local value = select(place, ...)
        if value == nil then error(("%s: the %s is missing"):format(shown, name), 2) end
        options[name] = value
      end
      return native.make(what, options)
    end
  end

  -- Returns a reader of a file or, if the path names a sequence, of a function of the frame.
  local function reader(what)
    local read = maker(what, "path")
    return function(...)
      local path, options = ...
      if type(path) ~= "string" or not native.names_frames(path) then return read(...) end
      local requested = options_of("rapid." .. what, options)
      requested.path = path
      return function(frame)
        requested.frame = frame.number
        return (native.make(what, requested))
      end
    end
  end

  rapid.mesh = {
    read = maker("mesh.read", "path"),
    sphere = maker "mesh.sphere",
    box = maker "mesh.box",
    grid = maker "mesh.grid",
    torus = maker "mesh.torus",
    from = maker "mesh.from",
  }
  rapid.levelset = {
    from_mesh = maker("levelset.from_mesh", "mesh"),
    from_points = maker("levelset.from_points", "points"),
    read = maker("levelset.read", "path"),
    sphere = maker "levelset.sphere",
    box = maker "levelset.box",
    torus = maker "levelset.torus",
  }
  -- Evaluates the function at each node of the lattice, z fastest.
  local function grid_from(options)
    options = options_of("rapid.grid.from", options)
    local defaults = native.defaults "grid.from"
    local known = { at = true }
    for name in pairs(defaults) do known[name] = true end
    local function fault(name, what)
      error(("rapid.grid.from: %s = %s; it must be %s"):format(name, describe.value(options[name]), what), 3)
    end
    for name in pairs(options) do
      if not known[name] then
        error(("rapid.grid.from: unknown parameter %q%s"):format(tostring(name),
          native.did_you_mean(tostring(name), names_of(known))), 2)
      end
    end
    for name, value in pairs(defaults) do options[name] = options[name] or value end
    local voxel, at = options.voxel, options.at
    if type(voxel) ~= "number" or voxel ~= voxel or voxel <= 0 then fault("voxel", "above 0 m") end
    if type(at) ~= "function" then fault("at", "a function of a place that returns a vec3") end
    local function place(name, value)
      if type(value) == "table" and #value == 3 then value = vector.make(value[1], value[2], value[3]) end
      if not ffi.istype(vector.type, value) then fault(name, "a vec3 or {x, y, z}") end
      return value
    end
    local size = place("size", options.size)
    local center = place("center", options.center)
    local nodes, origin = {}, center - size * 0.5
    for i, length in ipairs { size.x, size.y, size.z } do
      nodes[i] = math.floor(length / voxel + 1.5)
      if not (length >= 0 and nodes[i] < 2 ^ 15) then fault("size", "at least 0 m, and below 32,768 voxels") end
    end
    local all = nodes[1] * nodes[2] * nodes[3]
    local bytes = 48 * all -- for the list, which grows by halves
    native.require_memory(("rapid.grid.from: %.3g nodes"):format(all), bytes, "give a larger voxel")
    local values, n = {}, 0
    for i = 0, nodes[1] - 1 do
      for j = 0, nodes[2] - 1 do
        for k = 0, nodes[3] - 1 do
          local value = at(origin + vector.make(i, j, k) * voxel)
          if not ffi.istype(vector.type, value) then
            error(("rapid.grid.from: at returns %s; it must return a vec3 everywhere"):format(describe.value(value)), 2)
          end
          values[n + 1], values[n + 2], values[n + 3] = value.x, value.y, value.z
          n = n + 3
        end
      end
    end
    return native.make("grid.from", { at = values, voxel = voxel, origin = origin, nodes = nodes })
  end

  rapid.grid = {
    read = maker("grid.read", "path"),
    from = grid_from,
    from_points = maker("grid.from_points", "points"),
    write = function(path, grids)
      if path == nil then error("rapid.grid.write: the path is missing", 2) end
      return native.make("grid.write", { path = path, grids = options_of("rapid.grid.write", grids) })
    end,
  }
  rapid.fog = { read = maker("fog.read", "path"), from_points = maker("fog.from_points", "points") }
  rapid.curve = { read = maker("curve.read", "path"), from = maker "curve.from" }
  -- Returns points at even distances along a curve, with its direction as N and the fraction of its length as u.
  local function along(curve, options)
    options = options_of("rapid.points.along", options)
    for name in pairs(options) do
      if name ~= "count" and name ~= "closed" then
        error(("rapid.points.along: unknown parameter %q%s"):format(describe.name(name),
          native.did_you_mean(describe.name(name), { "closed", "count" })), 2)
      end
    end
    local count, closed = options.count or 100, options.closed or false
    if type(count) ~= "number" or count % 1 ~= 0 or count < 2 or count > 1e6 then
      error(("rapid.points.along: count = %s; it must be whole, from 2 to 1,000,000"):format(describe.value(count)), 2)
    end
    if type(closed) ~= "boolean" then
      error(("rapid.points.along: closed = %s; it must be true or false"):format(describe.value(closed)), 2)
    end
    local positions = {}
    for k, place in ipairs(type(curve) == "table" and curve or {}) do
      if type(place) == "table" and #place == 3 then place = vector.make(place[1], place[2], place[3]) end
      if not ffi.istype(vector.type, place) then
        error(("rapid.points.along: point %d is %s; it must be a vec3 or {x, y, z}")
          :format(k, describe.value(place)), 2)
      end
      positions[k] = place
    end
    if #positions < 2 then error("rapid.points.along: a curve is a list of at least two points", 2) end
    if closed then positions[#positions + 1] = positions[1] end
    local from = { 0 } -- length up to each position
    for k = 2, #positions do from[k] = from[k - 1] + (positions[k] - positions[k - 1]):length() end
    local whole = from[#from]
    if not (whole > 0 and whole < math.huge) then error("rapid.points.along: the curve has no length", 2) end
    local P, N, u, k = {}, {}, {}, 1
    for i = 1, count do
      local part = (i - 1) / (closed and count or count - 1)
      while k < #positions - 1 and (from[k + 1] <= part * whole or from[k + 1] == from[k]) do k = k + 1 end
      local segment = positions[k + 1] - positions[k]
      P[i] = positions[k] + segment * ((part * whole - from[k]) / (from[k + 1] - from[k]))
      N[i], u[i] = segment:normalized(), part
    end
    return native.make("points.from", { columns = { P = P, N = N, u = u } })
  end

  rapid.shape = {}
  for _, name in ipairs(native.maker_names "shape") do rapid.shape[name] = maker("shape." .. name) end
  rapid.points = {
    read = reader "points.read",
    grid = maker "points.grid",
    along = along,
    from = function(columns)
      if type(columns) ~= "table" then
        error("rapid.points.from needs a table of columns: { P = {{x, y, z}, ...} }", 2)
      end
      return native.make("points.from", { columns = columns })
    end,
  }

  function rapid.translate(x, y, z)
    for k = 1, 3 do
      local part = select(k, x, y, z)
      if type(part) ~= "number" then
        error(("rapid.translate needs three numbers, rapid.translate(x, y, z); one is %s"):format(
          describe.value(part)), 2)
      end
    end
    return native.make("motion.translate", { by = vector.make(x, y, z) })
  end
  rapid.rotate = maker("motion.rotate", "axis", "degrees")
  rapid.scale = maker("motion.scale", "factor")
  rapid.camera = maker "camera"

  function rapid.attr(name)
    return native.attribute(name)
  end

  -- Returns a shape, a mesh or points offered by the program that has opened the scene.
  function rapid.host(name)
    return native.host(name)
  end

  -- Returns a number, a boolean, a string or a vec3 that --set can replace.
  function rapid.param(name, default, doc)
    return native.param(name, default, doc)
  end

  -- Returns a method with positional forms: a name and a kernel.
  local function named_kernel(type_name)
    return function(input, name, kernel)
      if type(name) == "table" and kernel == nil then return native.node(type_name, name, input) end
      if type(name) ~= "string" or type(kernel) ~= "function" then
        error((":%s needs a name and a function, or a table { name = ..., kernel = ... }"):format(type_name), 2)
      end
      return native.node(type_name, { name = name, kernel = kernel }, input)
    end
  end

  local sugar = { points = named_kernel "points", action = named_kernel "action", detail = named_kernel "detail" }

  function sugar.merge(input, ...)
    local inputs, options = { input }, {}
    for place = 1, select("#", ...) do
      local other = select(place, ...)
      if type(other) == "table" then options = other else inputs[#inputs + 1] = other end
    end
    if #inputs < 2 then error(":merge needs another node: a:merge(b)", 2) end
    return native.node("merge", options, unpack(inputs))
  end

  local function call(type_name, options, ...)
    if options ~= nil and type(options) ~= "table" then
      error((":%s needs a table of parameters: :%s{ ... }"):format(type_name, type_name), 3)
    end
    return native.node(type_name, options or {}, ...)
  end

  local methods = {} -- by node type, made when first used
  local definitions = {} -- of Lua nodes

  local function method_of(type_name)
    if methods[type_name] then return methods[type_name] end
    local method = sugar[type_name]
    if not method then
      local definition = definitions[type_name]
      if not native.has_type(type_name) then
        definition = load_node(type_name)
        if definition == nil then native.unknown_type(type_name) end
        definitions[type_name] = definition
      end
      if definition and definition.expand then
        local expand = definition.expand
        method = function(input, options)
          local node = expand(input, native.complete(type_name, options or {}))
          return node -- not a tail call: a node that expands into itself must end, by the size of the stack
        end
      else
        method = function(input, options, ...)
          if select("#", ...) > 0 then
            error((":%s takes only one table of parameters"):format(type_name), 2)
          end
          return call(type_name, options, input)
        end
      end
    end
    methods[type_name] = method
    return method
  end

  function rapid.create(options)
    return call("create", options)
  end

  -- Checks and returns the definition of a node written in Lua, for its file to return.
  function rapid.node(definition)
    if type(definition) ~= "table" then error("rapid.node needs a table", 2) end
    native.define(definition)
    if type(definition.name) == "string" then definitions[definition.name] = definition end
    return definition
  end

  rapid.study = studies.define -- returned by a study file

  -- Methods of objects, by their kind.
  local function transformed(object, motion)
    return native.make("transform", { object = object, motion = motion })
  end
  local function combine_by(how)
    return function(object, other)
      return native.make("levelset.combine", { levelset = object, other = other, how = how })
    end
  end
  -- Returns a tool with one argument of its own, or with options.
  local function tool(name, argument)
    return function(object, value)
      local options = argument and { [argument] = value } or options_of("levelset:" .. name, value)
      options.levelset = object
      return native.make("levelset." .. name, options)
    end
  end
  -- Returns a method that writes a grid under the name of the option `grid`.
  local function write_by(usual)
    return function(object, path, options)
      if path == nil then error("grid:write: the path is missing", 2) end
      local name = options_of("grid:write", options).grid or usual
      if type(name) ~= "string" then
        error(("grid:write: grid = %s; it must be a name"):format(describe.value(name)), 2)
      end
      native.make("grid.write", { path = path, grids = { [name] = object } })
      return object
    end
  end
  local value_methods = {
    ["level set"] = {
      union = combine_by "union",
      intersect = combine_by "intersect",
      subtract = combine_by "subtract",
      offset = tool("offset", "metres"),
      smooth = tool "smooth",
      resample = tool("resample", "voxel"),
      write = function(object, path, options)
        local named = options_of("levelset:write", options)
        named.levelset, named.path = object, path
        native.make("levelset.write", named)
        return object
      end,
    },
    mesh = {},
    ["vector grid"] = { sample = shapes.sample, write = write_by "v" },
    fog = { sample = shapes.sample_fog, write = write_by "density" },
    motion = {},
  }
  for _, kind in ipairs { "shape", "level set", "mesh", "moving mesh", "moving shape", "deforming level set",
    "level set sequence" } do
    value_methods[kind] = value_methods[kind] or {}
    for name, query in pairs(shapes.queries) do value_methods[kind][name] = query end
  end
  for _, kind in ipairs { "mesh", "moving mesh", "level set", "shape", "moving shape", "deforming level set", "points",
    "moving points", "curve", "moving curve" } do
    value_methods[kind] = value_methods[kind] or {}
    value_methods[kind].transform = transformed
  end

  native.set_index(function(...)
    local object, name = ...
    local query = shapes.queries[name] -- first, since traces of kernels can follow it
    if query and shapes.pointer_of(object) then return query end
    if name == "sample" then
      if shapes.grid_of(object) then return shapes.sample end
      if shapes.fog_of(object) then return shapes.sample_fog end
    end
    local kind = native.kind(object)
    if kind == "node" then
      if type(name) ~= "string" then error("call a node's method with a colon: node:type{ ... }", 2) end
      return method_of(name)
    end
    local known = value_methods[kind] or shapes.pointer_of(object) and value_methods.shape or {}
    if known[name] then return known[name] end
    local what = kind:find "points$" and kind .. " have" or kind:find "^[aeiou]" and "an " .. kind .. " has"
      or "a " .. kind .. " has"
    name = describe.name(name)
    error(("%s no %q%s"):format(what, name, native.did_you_mean(name, names_of(known))), 2)
  end, function(a, b)
    return native.make("motion.product", { first = a, second = b })
  end, function(object, frame)
    local kind = native.kind(object)
    if kind ~= "level set sequence" then error(("a %s can't be called"):format(kind), 2) end
    return (native.make("levelset.at", { levelset = object, frame = frame.number }))
  end)

  -- Makes a misspelt name an error of its own, before it is called.
  local function closed(library, what)
    return setmetatable(library, {
      __index = function(_, name)
        name = describe.name(name)
        error(("%s has no %q%s"):format(what, name, native.did_you_mean(name, names_of(library))), 2)
      end,
      __metatable = false,
    })
  end
  for _, name in ipairs { "math", "mesh", "levelset", "grid", "fog", "shape", "points", "curve" } do
    closed(rapid[name], "rapid." .. name)
  end
  return closed(rapid, "rapid")
end

return { make = make }
