-- Makes rapid.host return the objects of Blender, which the add-on has written as files. The add-on puts a table
-- `inputs` above this text: { NAME = { kind = "mesh", path = PATTERN, changes = BOOLEAN } }, or `listed`, a string that
-- is printed before the name of each object that the scene requests.
local rapid = require "rapid"

-- The faces of a mesh may differ from frame to frame. rapid.host then returns a function of the frame.
local from_mesh = rapid.levelset.from_mesh
function rapid.levelset.from_mesh(mesh, options)
  if type(mesh) ~= "function" then return from_mesh(mesh, options) end
  return function(frame) return from_mesh(mesh(frame), options) end
end

local read = { mesh = rapid.mesh.read, points = rapid.points.read, curve = rapid.curve.read }

function rapid.host(name)
  if listed then
    print(listed .. tostring(name))
    if inputs[name] == "points" then return rapid.points.from { P = { { 0, 0, 0 }, { 0, 1, 0 } } } end
    if inputs[name] == "curve" then return rapid.curve.from { points = { { 0, 0, 0 }, { 0, 1, 0 } } } end
    return rapid.mesh.box {}
  end
  local input = inputs[name]
  if not input then
    error(("rapid.host %q: no object of Blender is chosen for it; choose one under Inputs"):format(tostring(name)), 2)
  end
  if not input.changes then return read[input.kind](input.path) end
  return function(frame) return read[input.kind]((input.path:gsub("####", ("%04d"):format(frame.number)))) end
end

return rapid
