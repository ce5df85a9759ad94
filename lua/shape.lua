-- Queries of shapes, level sets and grids of vectors by kernels and graph code:
--
--   shape:distance(P)    m, negative inside; beyond a level set's band a bound with the right sign
--   shape:gradient(P)    a vec3 out of the shape, of length 1 if the distance is exact; zero if no gradient exists
--   shape:velocity(P)    a vec3, m/s: the velocity of the shape there
--   shape:closest(P)     a vec3, the nearest point of the surface; approximate beyond a level set's band
--   mesh:closest(P, "Cd")  the mesh's attribute at that point: a number or a vec3
--   grid:sample(P)       a vec3, interpolated between voxels; for a fog a number, the density
--
-- Shapes that move or deform, and meshes, can be queried in kernels only, where they are as in the step.
--
-- The host is asked for an object's pointer once; then a table holds it, which compiled traces can read. The pointer of
-- a moving shape is looked up once per chunk. The functions are vararg for the reason given in vec3.lua.
local describe = require "describe"
local ffi = require "ffi"
local vector = require "vec3"

local vec3, istype = vector.type, ffi.istype

-- native.shape(object) returns a shape as light userdata, or nil for any other object, and true if it moves, so that
-- the pointer changes later. native.vector_grid and native.fog do likewise. native.shape_distance,
-- native.shape_velocity, native.vector_grid_sample and native.fog_sample are the query functions.
local function make(native)
  local query = ffi.cast("rapid_shape_distance", native.shape_distance)
  local query_velocity = ffi.cast("rapid_shape_velocity", native.shape_velocity)
  local query_value = ffi.cast("rapid_mesh_value", native.mesh_value)
  local query_grid = ffi.cast("rapid_vector_grid_sample", native.vector_grid_sample)
  local query_fog = ffi.cast("rapid_fog_sample", native.fog_sample)
  local gradient, value = ffi.new "double[3]", ffi.new "double[3]"

  -- Returns the pointer of an object that `find` knows, or false. The second function forgets those that move.
  local function pointers_by(find)
    local pointers = setmetatable({}, { __mode = "k" })
    local moving = {}
    return function(...)
      local object = ...
      local known = pointers[object]
      if known == nil then
        local pointer, moves = find(object)
        known = pointer ~= nil and ffi.cast("const void*", pointer)
        if not moves then
          pointers[object] = known
        elseif known then
          pointers[object] = known
          moving[#moving + 1] = object
        end
      end
      return known
    end, function()
      for place = #moving, 1, -1 do
        pointers[moving[place]] = nil
        moving[place] = nil
      end
    end
  end

  local pointer_of, forget_moving = pointers_by(native.shape)
  local grid_of = pointers_by(native.vector_grid)
  local fog_of = pointers_by(native.fog)
  local mesh_of = pointers_by(native.mesh)

  local function place_shown(P)
    return (type(P) == "number" or P == nil) and tostring(P) or "a " .. type(P)
  end

  local function refuse(what, shape, P)
    if type(shape) ~= "userdata" or not pointer_of(shape) then
      local _, moves = native.shape(shape)
      if moves then
        error(("shape:%s(P) of a moving shape or a mesh can only be called in a kernel"):format(what), 0)
      end
      error(("shape:%s(P) must be called with a colon, not a dot"):format(what), 0)
    end
    error(("shape:%s(P) needs a vec3, not %s"):format(what, place_shown(P)), 0)
  end

  local queries = {}

  function queries.distance(...)
    local shape, P = ...
    local pointer = type(shape) == "userdata" and pointer_of(shape)
    if not pointer or not istype(vec3, P) then refuse("distance", shape, P) end
    local distance = query(pointer, P.x, P.y, P.z, gradient)
    return distance
  end

  function queries.gradient(...)
    local shape, P = ...
    local pointer = type(shape) == "userdata" and pointer_of(shape)
    if not pointer or not istype(vec3, P) then refuse("gradient", shape, P) end
    query(pointer, P.x, P.y, P.z, gradient)
    return (vec3(gradient[0], gradient[1], gradient[2]))
  end

  function queries.velocity(...)
    local shape, P = ...
    local pointer = type(shape) == "userdata" and pointer_of(shape)
    if not pointer or not istype(vec3, P) then refuse("velocity", shape, P) end
    query_velocity(pointer, P.x, P.y, P.z, value)
    return (vec3(value[0], value[1], value[2]))
  end

  function queries.closest(...)
    local shape, P, name = ...
    local pointer = type(shape) == "userdata" and pointer_of(shape)
    if not pointer or not istype(vec3, P) then refuse("closest", shape, P) end
    if name == nil then
      local distance = query(pointer, P.x, P.y, P.z, gradient)
      return (vec3(P.x - distance * gradient[0], P.y - distance * gradient[1], P.z - distance * gradient[2]))
    end
    local mesh = mesh_of(shape)
    if not mesh or type(name) ~= "string" then
      error(("shape:closest(P, NAME) needs the name of an attribute of a mesh, not %s"):format(
        describe.value(name)), 0)
    end
    local numbers = query_value(mesh, pointer, name, P.x, P.y, P.z, value)
    if numbers == 0 then error(("the mesh has no attribute %q"):format(describe.name(name)), 0) end
    if numbers == 1 then
      local number = value[0]
      return number
    end
    return (vec3(value[0], value[1], value[2]))
  end

  local function sample(...)
    local grid, P = ...
    local pointer = type(grid) == "userdata" and grid_of(grid)
    if not pointer then error("grid:sample(P) must be called with a colon, not a dot", 0) end
    if not istype(vec3, P) then error(("grid:sample(P) needs a vec3, not %s"):format(place_shown(P)), 0) end
    query_grid(pointer, P.x, P.y, P.z, value)
    return (vec3(value[0], value[1], value[2]))
  end

  local function sample_fog(...)
    local fog, P = ...
    local pointer = type(fog) == "userdata" and fog_of(fog)
    if not pointer then error("fog:sample(P) must be called with a colon, not a dot", 0) end
    if not istype(vec3, P) then error(("fog:sample(P) needs a vec3, not %s"):format(place_shown(P)), 0) end
    local density = query_fog(pointer, P.x, P.y, P.z)
    return density
  end

  return {
    pointer_of = pointer_of, queries = queries, grid_of = grid_of, sample = sample,
    fog_of = fog_of, sample_fog = sample_fog,
    forget_moving = forget_moving,
  }
end

return { make = make }
