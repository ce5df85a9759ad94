-- Annotations of the graph language that no node or maker declaration provides: values, kernels, rapid.math.
--
-- `rapid nodes --annotations` writes lua/rapid.d.lua from the next line on. It replaces --@makers with the functions of
-- all makers except those declared here, --@point_fields with a point's attributes, and --@nodes with the nodes.
---@meta rapid
-- The graph language, for editors with the Lua language server. Written by `rapid nodes --annotations`; do not edit.

---An immutable vector of three numbers.
---@class rapid.Vec3
---@field x number
---@field y number
---@field z number
---@operator add(rapid.Vec3): rapid.Vec3
---@operator sub(rapid.Vec3): rapid.Vec3
---@operator mul(number|rapid.Vec3): rapid.Vec3
---@operator div(number|rapid.Vec3): rapid.Vec3
---@operator unm: rapid.Vec3
local Vec3 = {}
---@param w rapid.Vec3
---@return number
function Vec3:dot(w) end
---@param w rapid.Vec3
---@return rapid.Vec3
function Vec3:cross(w) end
---@return number
function Vec3:length() end
---Returns the vector with length 1; zero stays zero.
---@return rapid.Vec3
function Vec3:normalized() end
---Interpolates from this vector (t = 0) to w (t = 1).
---@param w rapid.Vec3
---@param t number
---@return rapid.Vec3
function Vec3:lerp(w, t) end

---An immutable rotation; q * r turns by r, then by q.
---@class rapid.Quat
---@field x number
---@field y number
---@field z number
---@field w number
---@operator mul(rapid.Quat): rapid.Quat
local Quat = {}
---@param v rapid.Vec3
---@return rapid.Vec3
function Quat:rotate(v) end
---@return rapid.Quat
function Quat:inverse() end
---@return number
function Quat:length() end
---@return rapid.Quat
function Quat:normalized() end
---Interpolates from this rotation (t = 0) to r (t = 1) along the shortest path.
---@param r rapid.Quat
---@param t number
---@return rapid.Quat
function Quat:slerp(r, t) end

---@class rapid.StudyDefinition
---@field name string
---@field scene fun(knobs: table): rapid.Node|table<string, rapid.Node>
---@field frames integer[]  {first, last}
---@field sweep table<string, (number|string|boolean)[]>  the values of each knob
---@field lines? string|string[]  the knobs that distinguish the lines of the plot
---@field reference? table|fun(frame: rapid.Frame, knobs: table): table  knobs, or a closed form { P = {...} }
---@field error? "rms"|"max"|"p95"|"residual"|fun(points: table, reference: table): number  a norm, or a function of columns
---@field error_frames? "all"|"last"
---@field repeat_runs? integer  number of timed runs per row; the default is 5

---Defines a study, which `rapid study` runs. The file of the study returns it.
---@param definition rapid.StudyDefinition
---@return table
function rapid.study(definition) end

---@overload fun(list: number[]): rapid.Vec3
---@param x number
---@param y number
---@param z number
---@return rapid.Vec3
function vec3(x, y, z) end

---@param x number
---@param y number
---@param z number
---@param w number
---@return rapid.Quat
function quat(x, y, z, w) end

---@alias rapid.Place rapid.Vec3|number[]

---@class rapid.Frame
---@field number number  number of the frame
---@field time number    seconds since the start frame
---@field dt number      length of the frame in seconds

---The substep of an action, in the point's own time.
---@class rapid.Step
---@field time number    seconds since the start frame
---@field dt number      length of the substep in seconds
---@field index integer  number of the substep

---@class rapid.Attribute  an attribute of each point, from rapid.attr
---@class rapid.Points
local Points = {}
---@param motion rapid.Motion
---@return rapid.Points
function Points:transform(motion) end

---@class rapid.Camera

---@class rapid.Motion  a * b moves by b, then by a
---@operator mul(rapid.Motion): rapid.Motion

---@class rapid.Mesh
local Mesh = {}
---@param motion rapid.Motion
---@return rapid.Mesh
function Mesh:transform(motion) end
---Returns the distance to the nearest face in metres; in kernels.
---@param P rapid.Vec3
---@return number
function Mesh:distance(P) end
---Returns the direction away from the nearest face; in kernels.
---@param P rapid.Vec3
---@return rapid.Vec3
function Mesh:gradient(P) end
---Returns the velocity of the nearest face in m/s; in kernels.
---@param P rapid.Vec3
---@return rapid.Vec3
function Mesh:velocity(P) end
---Returns the nearest position, or with a name the value of that attribute there; in kernels.
---@param P rapid.Vec3
---@param attribute? string
---@return any
function Mesh:closest(P, attribute) end

---@class rapid.Shape
local Shape = {}
---Returns the signed distance in metres, negative inside.
---@param P rapid.Vec3
---@return number
function Shape:distance(P) end
---Returns the direction out of the shape.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:gradient(P) end
---Returns the velocity of the shape at this position in m/s.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:velocity(P) end
---Returns the nearest position on the surface; for a level set within its band.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:closest(P) end

---@class rapid.LevelSet: rapid.Shape
local LevelSet = {}
---Writes a .vdb file, in a run.
---@param path string  path, relative to the current folder
---@param options? { grid?: string }
---@return rapid.LevelSet
function LevelSet:write(path, options) end
---@param other rapid.LevelSet
---@return rapid.LevelSet
function LevelSet:union(other) end
---@param other rapid.LevelSet
---@return rapid.LevelSet
function LevelSet:intersect(other) end
---@param other rapid.LevelSet
---@return rapid.LevelSet
function LevelSet:subtract(other) end

---@class rapid.Fog  a grid of densities
local Fog = {}
---Returns the density, interpolated between voxels.
---@param P rapid.Vec3
---@return number
function Fog:sample(P) end
---Writes a .vdb file, in a run.
---@param path string  path, relative to the current folder
---@param options? { grid?: string }
---@return rapid.Fog
function Fog:write(path, options) end

---@class rapid.Grid  a grid of vectors
local Grid = {}
---Returns the vector, interpolated between voxels.
---@param P rapid.Vec3
---@return rapid.Vec3
function Grid:sample(P) end
---Writes a .vdb file, in a run.
---@param path string  path, relative to the current folder
---@param options? { grid?: string }
---@return rapid.Grid
function Grid:write(path, options) end

---@class rapid.Curve  lines through positions
local Curve = {}
---@param motion rapid.Motion|fun(frame: rapid.Frame): rapid.Motion|table<integer, rapid.Motion>
---@return rapid.Curve
function Curve:transform(motion) end

---@class rapid
local rapid = {}
rapid.mesh, rapid.levelset, rapid.grid, rapid.fog, rapid.shape, rapid.points, rapid.math = {}, {}, {}, {}, {}, {}, {}
rapid.curve = {}

---Returns a value that --set can replace.
---@generic T
---@param name string
---@param default T  a number, a boolean, a string or a vec3
---@param doc? string
---@return T
function rapid.param(name, default, doc) end

---Names an attribute, for parameters that take a value of each point.
---@param name string
---@return rapid.Attribute
function rapid.attr(name) end

---Returns a shape, a mesh or points offered by the program that has opened the scene.
---@param name string
---@return any
function rapid.host(name) end

---@class rapid.NodeParameter
---@field [1] "bool"|"float"|"floats"|"group"|"int"|"ramp"|"read"|"shape"|"string"|"vec3"|"vec3s"|"write"
---@field default? any
---@field required? boolean
---@field min? number
---@field max? number
---@field unit? string
---@field choices? string[]
---@field doc string

---@class rapid.NodeDefinition
---@field name string  name of the node, and of its file
---@field doc string
---@field params? table<string, rapid.NodeParameter>
---@field makes? table<string, number|number[]>  attributes that the node creates, with their initial values
---@field points? fun(p: rapid.Point, frame: rapid.Frame, params: table)
---@field action? fun(p: rapid.Point, step: rapid.Step, params: table)  inside Solve, in every substep
---@field expand? fun(input: rapid.Node, params: table): rapid.Node

---Defines a node; the file of a node returns it.
---@param definition rapid.NodeDefinition
---@return rapid.NodeDefinition
function rapid.node(definition) end

---@param x number
---@param y number
---@param z number
---@return rapid.Motion
function rapid.translate(x, y, z) end

---@param columns table<string, any[]>  { P = {{x, y, z}, ...}, ANY = {...} }
---@return rapid.Points
function rapid.points.from(columns) end

---Returns points at equal distances along a curve, with the direction N and the fraction u of the length.
---@param curve rapid.Place[]
---@param options? { count?: integer, closed?: boolean }
---@return rapid.Points
function rapid.points.along(curve, options) end

---@param x number
---@param lo number
---@param hi number
---@return number
function rapid.math.clamp(x, lo, hi) end

---Maps x from [lo, hi] to [from, to], clamped to its ends.
---@param x number
---@param lo number
---@param hi number
---@param from number
---@param to number
---@return number
function rapid.math.fit(x, lo, hi, from, to) end

---Returns 0 up to lo, 1 from hi on, and a smooth curve between them.
---@param lo number
---@param hi number
---@param x number
---@return number
function rapid.math.smoothstep(lo, hi, x) end

---Returns a number in [-1, 1] that changes smoothly with position and time.
---@param P rapid.Vec3
---@param time? number
---@param octaves? integer
---@param seed? integer
---@return number
function rapid.math.noise(P, time, octaves, seed) end

---Returns the velocity of a flow without divergence, with a magnitude of about 1.
---@param P rapid.Vec3
---@param time? number
---@param octaves? integer
---@param seed? integer
---@return rapid.Vec3
function rapid.math.curl_noise(P, time, octaves, seed) end

---@param axis rapid.Vec3
---@param degrees number
---@return rapid.Quat
function rapid.math.rotation(axis, degrees) end

---@param from rapid.Vec3
---@param to rapid.Vec3
---@return rapid.Quat
function rapid.math.rotation_between(from, to) end
--@makers except levelset.at levelset.combine levelset.write motion.product motion.translate points.from transform

---The point of a kernel, with all attributes that the scene makes.
---@class rapid.Point
--@point_fields
---@field [string] any
local Point = {}
---@param group string
function Point:join(group) end
---@param group string
function Point:leave(group) end
---@param group string
---@return boolean
function Point:within(group) end
---Removes the point when its node ends.
function Point:kill() end
---Returns the point's random number k in [0, 1): the same in every frame, or with `frame` another in each.
---@param k number
---@param frame? rapid.Frame|number
---@return number
function Point:rand(k, frame) end

---@class rapid.Node
local Node = {}
--@nodes

return rapid
