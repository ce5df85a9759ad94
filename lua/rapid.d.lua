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

---@class rapid.options.camera_camera
---@field position? rapid.Place  position of the camera [vec3, m]
---@field target? rapid.Place  position at the centre of the view [vec3, m]
---@field fov? number  vertical angle of view in degrees; the default is 35 [number, from 1 to 170]
---@field group? string  group of points that the camera frames and follows, instead of the scene [string]

---Returns a camera; missing fields are fitted to the scene.
---@param options? rapid.options.camera_camera
---@return rapid.Camera
function rapid.camera(options) end

---@class rapid.options.curve_from
---@field points rapid.Place[]|rapid.Points|fun(frame: rapid.Frame): rapid.Place[]|rapid.Points  list of positions {{x, y, z}, ...}, points, or a function of the frame that returns either, always with the same number [list of vec3, points, or function of the frame, m, required]
---@field closed? boolean  connects the last point to the first [boolean, default false]

---Returns a curve through positions, which may deform.
---@param options? rapid.options.curve_from
---@return rapid.Curve
function rapid.curve.from(options) end

---@class rapid.options.curve_read
---@field closed? boolean  connects the last point to the first [boolean, default false]
---@field before? "hold"|"repeat"|"mirror"|"none"  data before the first file of a sequence: that file, all files repeated, all files back and forth, or nothing [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  data after the last file of a sequence, as for before [string, one of hold, repeat, mirror, none]
---@field offset? number  delay of the files of a sequence: frame f uses the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads curves from a file of points: the lines of an .obj, or all points.
---@param path string  path, relative to the graph file; with #### or $F4 a file for each frame, for a curve that deforms [string, required]
---@param options? rapid.options.curve_read
---@return rapid.Curve
function rapid.curve.read(path, options) end

---@class rapid.options.fog_from_points
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field radius? number|rapid.Attribute  radius over which a point is spread, at least a voxel; the default is 1.5 voxels [number, m, above 0, takes rapid.attr]
---@field weight? number|rapid.Attribute  weight of a point; the integral of the density is the sum of the weights [number, at least 0, default 1, takes rapid.attr]

---Returns the density of points: their weights per volume.
---@param points rapid.Points  points that are spread over the voxels [points, required]
---@param options? rapid.options.fog_from_points
---@return rapid.Fog
function rapid.fog.from_points(points, options) end

---@class rapid.options.fog_read
---@field grid? string  name of the grid; the default is the only grid of floats in the file [string]
---@field before? "hold"|"repeat"|"mirror"|"none"  data before the first file of a sequence: that file, all files repeated, all files back and forth, or nothing [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  data after the last file of a sequence, as for before [string, one of hold, repeat, mirror, none]
---@field offset? number  delay of the files of a sequence: frame f uses the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a fog, which emits points by its density, from a .vdb file.
---@param path string  path, relative to the graph file; with #### or $F4 a sequence with a file for each frame or for some [string, required]
---@param options? rapid.options.fog_read
---@return rapid.Fog
function rapid.fog.read(path, options) end

---@class rapid.options.grid_from
---@field at fun(P: rapid.Vec3): rapid.Vec3  function of the position, called once at each node of the lattice [function of a place, required]
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]
---@field voxel? number  distance between nodes [number, m, at least 2e-05, default 0.1]

---Returns a grid of vectors from a function of the position.
---@param options? rapid.options.grid_from
---@return rapid.Grid
function rapid.grid.from(options) end

---@class rapid.options.grid_from_points
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field radius? number|rapid.Attribute  radius over which a point is spread, at least a voxel; the default is 1.5 voxels [number, m, above 0, takes rapid.attr]
---@field weight? number|rapid.Attribute  weight of a point; the integral of the density is the sum of the weights [number, at least 0, default 1, takes rapid.attr]
---@field attribute? string  vec3 attribute [string, default "v"]

---Returns a grid of the weighted mean of a vec3 attribute of points.
---@param points rapid.Points  points that are spread over the voxels [points, required]
---@param options? rapid.options.grid_from_points
---@return rapid.Grid
function rapid.grid.from_points(points, options) end

---@class rapid.options.grid_read
---@field grid? string  name of the grid; the default is the only grid of vectors in the file [string]
---@field before? "hold"|"repeat"|"mirror"|"none"  data before the first file of a sequence: that file, all files repeated, all files back and forth, or nothing [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  data after the last file of a sequence, as for before [string, one of hold, repeat, mirror, none]
---@field offset? number  delay of the files of a sequence: frame f uses the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a grid of vectors from a .vdb file.
---@param path string  path, relative to the graph file; with #### or $F4 a sequence with a file for each frame or for some [string, required]
---@param options? rapid.options.grid_read
---@return rapid.Grid
function rapid.grid.read(path, options) end

---Writes fogs and grids of vectors to a .vdb file, in a run.
---@param path string  path, relative to the current folder [string, required]
---@param grids table  grids by their name in the file, { density = fog, v = grid } [table, required]
---@return rapid.Grid
function rapid.grid.write(path, grids) end

---@class rapid.options.levelset_box
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  width of the band on each side of the surface [number, voxels, at least 1.5, default 3]

---Returns a level set of a box.
---@param options? rapid.options.levelset_box
---@return rapid.LevelSet
function rapid.levelset.box(options) end

---@class rapid.options.levelset_from_mesh
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  width of the band on each side of the surface [number, voxels, at least 1.5, default 3]

---Returns the level set of a closed mesh; a mesh that moves or deforms gives a shape that does.
---@param mesh rapid.Mesh  closed mesh [mesh, required]
---@param options? rapid.options.levelset_from_mesh
---@return rapid.LevelSet
function rapid.levelset.from_mesh(mesh, options) end

---@class rapid.options.levelset_from_points
---@field radius? number|rapid.Attribute  radius of the spheres; the default is the attribute pscale [number, m, above 0, takes rapid.attr]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  width of the band on each side of the surface [number, voxels, at least 1.5, default 3]

---Returns the level set of the union of spheres around points.
---@param points rapid.Points  centres of the spheres [points, required]
---@param options? rapid.options.levelset_from_points
---@return rapid.LevelSet
function rapid.levelset.from_points(points, options) end

---Moves the surface along its normal.
---@param metres number  distance outwards; a negative value moves the surface inwards [number, m, required]
---@return rapid.LevelSet
function LevelSet:offset(metres) end

---@class rapid.options.levelset_read
---@field grid? string  name of the grid; the default is the only level set in the file [string]
---@field before? "hold"|"repeat"|"mirror"|"none"  data before the first file of a sequence: that file, all files repeated, all files back and forth, or nothing [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  data after the last file of a sequence, as for before [string, one of hold, repeat, mirror, none]
---@field offset? number  delay of the files of a sequence: frame f uses the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a level set from a .vdb file, or a sequence of them.
---@param path string  path, relative to the graph file; with #### or $F4 a sequence with a file for each frame or for some [string, required]
---@param options? rapid.options.levelset_read
---@return rapid.LevelSet
function rapid.levelset.read(path, options) end

---Returns the same surface with voxels of another size.
---@param voxel number  edge of a voxel [number, m, at least 2e-05, required]
---@return rapid.LevelSet
function LevelSet:resample(voxel) end

---@class rapid.options.levelset_smooth
---@field width? integer  width of the filter [integer, voxels, from 1 to 64, default 1]
---@field iterations? integer  number of times that the filter is applied [integer, from 1 to 1000, default 1]

---Rounds edges and fills creases.
---@param options? rapid.options.levelset_smooth
---@return rapid.LevelSet
function LevelSet:smooth(options) end

---@class rapid.options.levelset_sphere
---@field radius? number  radius of the sphere [number, m, above 0, default 1]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  width of the band on each side of the surface [number, voxels, at least 1.5, default 3]

---Returns a level set of a sphere.
---@param options? rapid.options.levelset_sphere
---@return rapid.LevelSet
function rapid.levelset.sphere(options) end

---@class rapid.options.levelset_torus
---@field radius? number  distance from the axis to the centre of the tube [number, m, above 0, default 1]
---@field tube? number  radius of the tube [number, m, above 0, default 0.25]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  width of the band on each side of the surface [number, voxels, at least 1.5, default 3]

---Returns a level set of a torus about the y axis.
---@param options? rapid.options.levelset_torus
---@return rapid.LevelSet
function rapid.levelset.torus(options) end

---@class rapid.options.mesh_box
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns a mesh of a box.
---@param options? rapid.options.mesh_box
---@return rapid.Mesh
function rapid.mesh.box(options) end

---@class rapid.options.mesh_from
---@field points any[]  positions {{x, y, z}, ...} [list, m, required]
---@field faces any[]  faces {{1, 2, 3}, ...} of indices in points, from 1 [list, required]
---@field values? table  values at each of points, { Cd = {{r, g, b}, ...}, heat = {...} }, for points that are born on the mesh [table]

---Returns a mesh from a list of positions and a list of faces.
---@param options? rapid.options.mesh_from
---@return rapid.Mesh
function rapid.mesh.from(options) end

---@class rapid.options.mesh_grid
---@field size? any[]  edge lengths {x, z}; the default is {1, 1} [list, m]
---@field divisions? integer  number of cells along each edge [integer, from 1 to 4096, default 10]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns a flat grid that faces up.
---@param options? rapid.options.mesh_grid
---@return rapid.Mesh
function rapid.mesh.grid(options) end

---@class rapid.options.mesh_read
---@field animation? string  the name of an animation of a glTF file, which moves and deforms the mesh from time 0 on; "" is the only one [string]
---@field speed? number  seconds of the animation per second [number]
---@field up? "y"|"z"  the axis of the file that points up: "y" or "z", which becomes y [string, one of y, z, default "y"]
---@field unit? number  one length unit of the file: 0.01 for centimetres [number, m, above 0, default 1]
---@field before? "hold"|"repeat"|"mirror"|"none"  data before the first file of a sequence: that file, all files repeated, all files back and forth, or nothing [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  data after the last file of a sequence, as for before [string, one of hold, repeat, mirror, none]
---@field offset? number  delay of the files of a sequence: frame f uses the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a mesh from OBJ, PLY, STL or glTF, or from a sequence of such files.
---@param path string  path, relative to the graph file; with #### or $F4 a file for each frame, for a mesh that deforms [string, required]
---@param options? rapid.options.mesh_read
---@return rapid.Mesh
function rapid.mesh.read(path, options) end

---@class rapid.options.mesh_sphere
---@field radius? number  radius of the sphere [number, m, above 0, default 1]
---@field divisions? integer  number of divisions around the equator [integer, from 3 to 4096, default 24]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns a mesh of a sphere.
---@param options? rapid.options.mesh_sphere
---@return rapid.Mesh
function rapid.mesh.sphere(options) end

---@class rapid.options.mesh_torus
---@field radius? number  distance from the axis to the centre of the tube [number, m, above 0, default 1]
---@field tube? number  radius of the tube [number, m, above 0, default 0.25]
---@field divisions? integer  number of divisions around the axis; those around the tube get edges of the same length [integer, from 3 to 4096, default 24]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns a mesh of a torus about the y axis.
---@param options? rapid.options.mesh_torus
---@return rapid.Mesh
function rapid.mesh.torus(options) end

---Returns a rotation about an axis through the origin.
---@param axis rapid.Place  axis of any nonzero length [vec3, required]
---@param degrees number  angle by the right-hand rule [number, deg, required]
---@return rapid.Motion
function rapid.rotate(axis, degrees) end

---Returns a scaling about the origin.
---@param factor number  factor of all lengths [number, above 0, required]
---@return rapid.Motion
function rapid.scale(factor) end

---@class rapid.options.points_grid
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field spacing? number  edge of a cell [number, m, above 0, default 0.1]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns points at the centres of the cells of a box.
---@param options? rapid.options.points_grid
---@return rapid.Points
function rapid.points.grid(options) end

---@class rapid.options.points_read
---@field up? "y"|"z"  the axis of the file that points up: "y" or "z", which becomes y [string, one of y, z, default "y"]
---@field unit? number  one length unit of the file: 0.01 for centimetres [number, m, above 0, default 1]
---@field before? "hold"|"repeat"|"mirror"|"none"  data before the first file of a sequence: that file, all files repeated, all files back and forth, or nothing [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  data after the last file of a sequence, as for before [string, one of hold, repeat, mirror, none]
---@field offset? number  delay of the files of a sequence: frame f uses the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads points from a file of any format that Rapid reads, or from a sequence.
---@param path string  path, relative to the graph file; with #### or $F4 a file for each frame, and the result is a function of the frame [string, required]
---@param options? rapid.options.points_read
---@return rapid.Points
function rapid.points.read(path, options) end

---@class rapid.options.shape_box
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns a box.
---@param options? rapid.options.shape_box
---@return rapid.Shape
function rapid.shape.box(options) end

---@class rapid.options.shape_plane
---@field normal? rapid.Place  normal of any nonzero length, which points out of the solid half [vec3, default {0, 1, 0}]
---@field offset? number  distance from the origin along the normal [number, m, default 0]

---Returns a plane, whose normal points outside.
---@param options? rapid.options.shape_plane
---@return rapid.Shape
function rapid.shape.plane(options) end

---@class rapid.options.shape_sphere
---@field radius? number  radius of the sphere [number, m, above 0, default 1]
---@field center? rapid.Place  centre [vec3, m, default {0, 0, 0}]

---Returns a sphere.
---@param options? rapid.options.shape_sphere
---@return rapid.Shape
function rapid.shape.sphere(options) end

---The point of a kernel, with all attributes that the scene makes.
---@class rapid.Point
---@field P rapid.Vec3  m
---@field v rapid.Vec3  m/s
---@field id integer  read only
---@field dt number  read only: time that the point moves in this frame, s
---@field index integer  read only: index in the set, from 1
---@field nage number  read only: age / life: 0 at birth, 1 at death
---@field age number
---@field airresist number
---@field birthtime number
---@field contactnum integer
---@field force rapid.Vec3
---@field frictionforce number
---@field hitimpulse number
---@field hitnml rapid.Vec3
---@field hitnum integer
---@field hitpath integer
---@field hitpos rapid.Vec3
---@field hittime number
---@field hittotal integer
---@field hitv rapid.Vec3
---@field life number
---@field mass number
---@field normalforce number
---@field parent integer
---@field pscale number
---@field targetv rapid.Vec3
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

---@class rapid.params.action
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field kernel fun(p: rapid.Point, step: rapid.Step)  function of a point, function(p, step) [function of a point, required]
---@field reads? string|string[]  attributes that the kernel reads by computed names [names, constant]
---@field writes? string|string[]  attributes that the kernel assigns by computed names [names, constant]
---@field name? string  name of the node in messages [string]

---Runs a Lua function on each point inside Solve, in every substep.
---@overload fun(self: rapid.Node, name: string, kernel: fun(p: rapid.Point, step: rapid.Step)): rapid.Node
---@param params rapid.params.action
---@return rapid.Node
function Node:action(params) end

---@class rapid.params.align
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  axis of the point that is turned, of any nonzero length [vec3, default {0, 1, 0}]
---@field response? number|fun(frame: rapid.Frame): number  time in which the angle falls to 1/e; 0 turns at once [number, s, at least 0, default 0]
---@field to? string  vec3 attribute that gives the target direction [name of an attribute, default "N", constant]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Turns orient so that an axis of each point follows an attribute.
---@param params? rapid.params.align
---@return rapid.Node
function Node:align(params) end

---@class rapid.params.align_to_velocity
---@field least? number|fun(frame: rapid.Frame): number  speed below which a point keeps its orientation [number, m/s, at least 0, default 1e-06]
---@field up? rapid.Place|fun(frame: rapid.Frame): rapid.Place  direction towards which the y axis turns as far as possible [vec3, default {0, 1, 0}]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Turns orient so that the z axis of each point follows its velocity.
---@param params? rapid.params.align_to_velocity
---@return rapid.Node
function Node:align_to_velocity(params) end

---@class rapid.params.arrive
---@field radius? number|fun(frame: rapid.Frame): number  distance from the target at which points begin to slow down [number, m, at least 1e-06, default 1]
---@field response? number|fun(frame: rapid.Frame): number  time in which any other velocity falls to 1/e [number, s, at least 1e-06, default 0.2]
---@field speed? number|fun(frame: rapid.Frame): number  speed outside the radius [number, m/s, at least 1e-06, default 1]
---@field target? rapid.Place|fun(frame: rapid.Frame): rapid.Place  target position [vec3, m, default {0, 0, 0}]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Moves points to a target and slows them down before it.
---@param params? rapid.params.arrive
---@return rapid.Node
function Node:arrive(params) end

---@class rapid.params.attract
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field center? rapid.Place|rapid.Attribute|fun(frame: rapid.Frame): rapid.Place  position that attracts the points [vec3, m, default {0, 0, 0}, takes rapid.attr]
---@field shape? rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  shape or mesh whose surface attracts the points, instead of center [shape at rest or moving]
---@field strength? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration at a distance of 1 m; a negative value repels [number, m/s², default 1, takes rapid.attr]
---@field falloff? number|fun(frame: rapid.Frame): number  power of the distance with which the acceleration decreases [number, default 2]
---@field core? number|fun(frame: rapid.Frame): number  distance below which the acceleration stops growing; give one with a shape, whose pull is unbounded at 0 [number, m, at least 0, default 0]
---@field name? string  name of the node in messages [string]

---Attracts points to a position or to the surface of a shape.
---@param params? rapid.params.attract
---@return rapid.Node
function Node:attract(params) end

---@class rapid.params.attribute
---@field attributes? table<string, number|rapid.Vec3|string|any[]>|fun(frame: rapid.Frame): table<string, number|rapid.Vec3|string|any[]>  values by name, for names that are also parameters of nodes: { name = "" } [attributes]
---@field name? string  name of the node in messages [string]
---@field [string] number|number[]|rapid.Vec3|string  initial value of the attribute: a number, a vec3 {x, y, z}, a quaternion {x, y, z, w} or a string

---Gives attributes to points that do not have them and never overwrites values.
---@param params? rapid.params.attribute
---@return rapid.Node
function Node:attribute(params) end

---@class rapid.params.avoid
---@field distance? number|fun(frame: rapid.Frame): number  distance from the surface at which the push begins [number, m, at least 1e-06, default 0.5]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  shape or level set [shape at rest or moving, required]
---@field strength? number|fun(frame: rapid.Frame): number  acceleration at the surface [number, m/s², default 10]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Pushes points away from a shape that they come near.
---@param params rapid.params.avoid
---@return rapid.Node
function Node:avoid(params) end

---@class rapid.params.clump
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  radius of the points; the default is the attribute pscale, or 0 without it [number, m, at least 0, takes rapid.attr]
---@field strength? number|fun(frame: rapid.Frame): number  pull at which a bond breaks [number, N, at least 0, default 1]
---@field name? string  name of the node in messages [string]

---Bonds touching points until a force tears them apart.
---@param params? rapid.params.clump
---@return rapid.Node
function Node:clump(params) end

---@class rapid.params.collide
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  shape that points collide with; a function of the frame may return nil for no shape [shape, required]
---@field transform? rapid.Motion|fun(frame: rapid.Frame): rapid.Motion  motion of the shape, a function of the frame that returns one, or keys by frame [motion]
---@field cut? integer[]|fun(frame: rapid.Frame): integer[]  frames to which the shape jumps without sweeping points along; by default jumps are detected [list of frames]
---@field bounce? number|rapid.Attribute|fun(frame: rapid.Frame): number  restitution: the fraction of the normal speed that remains after a contact [number, from 0 to 1, default 0.5, takes rapid.attr]
---@field friction? number|rapid.Attribute|fun(frame: rapid.Frame): number  Coulomb coefficient of friction [number, at least 0, default 0, takes rapid.attr]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  collision radius of the points; the default is pscale, or the radius of :contact if pscale is 0 [number, m, at least 0, takes rapid.attr]
---@field method? "continuous"|"backtrack"|"project"|fun(frame: rapid.Frame): "continuous"|"backtrack"|"project"  continuous: contact at the time of impact; backtrack, project: correction after the step, back along the path or out along the gradient [string, one of continuous, backtrack, project, default "continuous"]
---@field response? "bounce"|"slide"|"stick"|"die"|fun(frame: rapid.Frame): "bounce"|"slide"|"stick"|"die"  effect of a contact: the point bounces, slides without a bounce, sticks to the shape, or dies [string, one of bounce, slide, stick, die, default "bounce"]
---@field adhesion? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration that tears points off the surface; the default is infinite for points that stick, 0 for points that slide [number, m/s², at least 0, takes rapid.attr]
---@field viscosity? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which the surface slows down points that slide on it [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field record? number|boolean|fun(frame: rapid.Frame): number|boolean  minimum speed of contacts that are written to the hit attributes (hittotal, hitpos, hitnml, ...), or false [false or number, m/s, at least 0, default false]
---@field name? string  name of the node in messages [string]

---Keeps points out of a shape: they bounce, slide, stick or die on it.
---@param params rapid.params.collide
---@return rapid.Node
function Node:collide(params) end

---@class rapid.params.color_by_speed
---@field fast? rapid.Place|fun(frame: rapid.Frame): rapid.Place  linear RGB colour at the speed high and above [vec3, at least 0, default {1, 0.9, 0.6}]
---@field high? number|fun(frame: rapid.Frame): number  speed of the colour fast [number, m/s, at least 0, default 5]
---@field low? number|fun(frame: rapid.Frame): number  speed of the colour slow [number, m/s, at least 0, default 0]
---@field slow? rapid.Place|fun(frame: rapid.Frame): rapid.Place  linear RGB colour at the speed low and below [vec3, at least 0, default {0.1, 0.2, 0.9}]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Blends the colour of points between two colours by their speed.
---@param params? rapid.params.color_by_speed
---@return rapid.Node
function Node:color_by_speed(params) end

---@class rapid.params.contact
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  radius of the points; the default is the attribute pscale, or 0 without it [number, m, at least 0, takes rapid.attr]
---@field bounce? number|rapid.Attribute|fun(frame: rapid.Frame): number  restitution between points; a pair uses the larger value of its points [number, from 0 to 1, default 0, takes rapid.attr]
---@field friction? number|rapid.Attribute|fun(frame: rapid.Frame): number  Coulomb coefficient of friction; a pair uses the geometric mean of its points [number, at least 0, default 0, takes rapid.attr]
---@field max_difference? number|fun(frame: rapid.Frame): number  largest difference of radii within one search grid; the default is half of the largest radius in it [number, m, at least 0]
---@field max_grids? integer|fun(frame: rapid.Frame): integer  maximum number of search grids for different radii [integer, from 1 to 254, default 8]
---@field mass_scaling? number|fun(frame: rapid.Frame): number  makes a point count as e^mass_scaling times lighter than the one below it, so that tall stacks hold with few substeps [number, from 0 to 4, default 0]
---@field record? boolean  writes contact forces to normalforce and frictionforce (N, mean over the frame), and their number to contactnum [boolean, default false, constant]
---@field spin? boolean  lets friction turn the points as solid spheres, with the attributes w (rad/s) and orient [boolean, default false, constant]
---@field rolling? number|rapid.Attribute|fun(frame: rapid.Frame): number  coefficient of rolling friction, with spin; a pair uses the geometric mean of its points [number, at least 0, default 0, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Makes points collide with each other as spheres: sand, rubble, balls.
---@param params? rapid.params.contact
---@return rapid.Node
function Node:contact(params) end

---@class rapid.params.create
---@field fps? number  frames per second [number, 1/s, above 0, default 24, constant]
---@field start? integer  number of the first frame, which is the initial state at time 0 [integer, default 1, constant]
---@field seed? integer  seed of all random numbers of this simulation [integer, at least 0, default 0, constant]
---@field subframes? integer  evaluations of the whole graph per frame, with scripts, emitters and colliders; not the solver's substeps [integer, from 1 to 10000, default 1, constant]
---@field points? rapid.Points  initial points [points, constant]
---@field name? string  name of the node in messages [string]

---Starts a simulation and returns its points as Solve left them in the previous frame.
---@param params? rapid.params.create
---@return rapid.Node
function rapid.create(params) end

---@class rapid.params.curve_force
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field curve rapid.Place[]|rapid.Points|rapid.Curve|fun(frame: rapid.Frame): rapid.Place[]|rapid.Points|rapid.Curve  list of positions {{x, y, z}, ...}, points, or a rapid.curve, which may move and deform [list of vec3, points, or curve, m, required]
---@field closed? boolean|fun(frame: rapid.Frame): boolean  connects the last point to the first [boolean, default false]
---@field speed? number|rapid.Attribute|fun(frame: rapid.Frame): number  speed along the curve; a negative value drives points backwards [number, m/s, default 1, takes rapid.attr]
---@field pull? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration towards the curve per metre of distance [number, 1/s², at least 0, default 10, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which points reach the speed [number, 1/s, at least 0, default 3, takes rapid.attr]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  distance at which the force has fallen to 0; without it the force does not decrease [number, m, above 0, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Pulls points to a curve and drives them along it.
---@param params rapid.params.curve_force
---@return rapid.Node
function Node:curve_force(params) end

---@class rapid.params.delete
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field where? fun(p: rapid.Point, frame: rapid.Frame): any  function of a point that returns true for points to remove [function of a point]
---@field name? string  name of the node in messages [string]

---Removes the points of a group, or those for which `where` is true.
---@param params? rapid.params.delete
---@return rapid.Node
function Node:delete(params) end

---@class rapid.params.detail
---@field kernel fun(p: rapid.Point, frame: rapid.Frame)  function of the set, function(points, frame) [function of the points, required]
---@field name? string  name of the node in messages [string]

---Runs a Lua function over the whole set of points, once per frame.
---@overload fun(self: rapid.Node, name: string, kernel: fun(p: rapid.Point, frame: rapid.Frame)): rapid.Node
---@param params rapid.params.detail
---@return rapid.Node
function Node:detail(params) end

---@class rapid.params.distance
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field pairs? any[]  pairs {{i, j}, ...} of indices from 1, in the set that first enters the node [list, constant]
---@field within? number  distance up to which points form pairs, in the set that first enters the node; instead of pairs [number, m, above 0, constant]
---@field rest? number  distance of each pair; the default is its initial distance [number, m, at least 0, constant]
---@field compliance? number  stretch per force; 0 makes a rigid rod [number, m/N, at least 0, default 0, constant]
---@field strain? number  breaks a spring that is stretched by more than this fraction of its distance; no load stretches a rod [number, above 0, constant]
---@field strength? number  breaks a pair that pulls with a larger force; an impact counts as a force over its substep, so more substeps break more [number, N, above 0, constant]
---@field collide? boolean  lets the two points of a pair collide; by default they pass through each other, as beads of a rope do [boolean, default false, constant]
---@field name? string  name of the node in messages [string]

---Keeps pairs of points at a distance: rods, ropes, springs.
---@param params? rapid.params.distance
---@return rapid.Node
function Node:distance(params) end

---@class rapid.params.drag
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field linear? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate of the drag that is proportional to the speed [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field quadratic? number|rapid.Attribute|fun(frame: rapid.Frame): number  coefficient of the drag that is proportional to the square of the speed [number, 1/m, at least 0, default 0, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Slows points down by the resistance of still air.
---@param params? rapid.params.drag
---@return rapid.Node
function Node:drag(params) end

---@class rapid.params.emit
---@field source rapid.Mesh|rapid.Shape|rapid.Fog|rapid.Curve|rapid.Points|rapid.Place|fun(frame: rapid.Frame): rapid.Mesh|rapid.Shape|rapid.Fog|rapid.Curve|rapid.Points|rapid.Place  object that emits the points [mesh, level set, shape, fog, curve, points or vec3, required]
---@field from? "surface"|"volume"|"points"|fun(frame: rapid.Frame): "surface"|"volume"|"points"  part of the source that emits; the default is "points" for points, otherwise "surface" (the points of a mesh are its vertices) [string, one of surface, volume, points]
---@field density? string|fun(frame: rapid.Frame): string  attribute of the source's points, or of a mesh's vertices or faces; births are distributed in proportion to it [string]
---@field source_group? string  group of a mesh's faces; only these emit [string, constant]
---@field motion? "spline"|"linear"|"none"|fun(frame: rapid.Frame): "spline"|"linear"|"none"  path of a moving source within a frame: a cubic spline, a straight line, or none (at rest at the frame's end) [string, one of spline, linear, none, default "spline"]
---@field alpha? number|fun(frame: rapid.Frame): number  tangents of the spline as a fraction of the path over two frames; 0.5 keeps a uniform motion uniform [number, default 0.5]
---@field cut? integer[]|fun(frame: rapid.Frame): integer[]  frames to which the source jumps, without births in between; by default large jumps are detected and reported [list of frames, from -2147483647 to 2147483647]
---@field inherit_velocity? number|fun(frame: rapid.Frame): number  fraction of the source's velocity that is added [number, default 1]
---@field rate? number|fun(frame: rapid.Frame): number  births per second [number, 1/s, at least 0]
---@field count? integer|fun(frame: rapid.Frame): integer  births per frame [integer, at least 0]
---@field impulse? table<integer, number>|fun(frame: rapid.Frame): table<integer, number>  births in single frames, {[frame] = count}; those of the first frame have not moved yet [numbers by frame, from 0 to 2147483647]
---@field age? number|number[]|rapid.Attribute|fun(frame: rapid.Frame): number|number[]|rapid.Attribute  age at the end of the frame of birth, instead of birth: a number, {min, max}, or an attribute of the source [number, {min, max} or rapid.attr, s, at least 0]
---@field birth? "random"|"begin"|"end"|"even"  time of birth in the frame: at random, at its beginning or end, or evenly spaced; or a function(p, frame) of each newborn point [moment or function of a point, one of random, begin, end, even, default "random"]
---@field velocity? rapid.Place|fun(frame: rapid.Frame): rapid.Place  mean initial velocity [vec3, m/s, default {0, 0, 0}]
---@field speed? number|number[]|fun(frame: rapid.Frame): number|number[]  speed along the source's normal N, added to velocity; a number or {min, max} [number or {min, max}, m/s, default 0]
---@field spread? number|fun(frame: rapid.Frame): number  half angle of the cone in which velocity and speed are turned together, uniformly [number, deg, from 0 to 180, default 0]
---@field life? number|number[]|fun(frame: rapid.Frame): number|number[]  age at which points die: a number or {min, max}; without it points live for ever [number or {min, max}, s, at least 0]
---@field group? string  group that newborn points join [string, constant]
---@field attributes? table<string, number|rapid.Vec3|string|any[]>|fun(frame: rapid.Frame): table<string, number|rapid.Vec3|string|any[]>  values of newborn points instead of inherited ones, {heat = 1}: a value, a ramp, or a range {min, max}, of vectors on a line; for a box, birth = function(p) [attributes]
---@field name? string  name of the node in messages [string]

---Emits points from a surface, a volume, a curve or points.
---@param params rapid.params.emit
---@return rapid.Node
function Node:emit(params) end

---@class rapid.params.fade_by_age
---@field attribute? string  float attribute that is written [name of a number attribute, default "pscale", constant]
---@field first? number|fun(frame: rapid.Frame): number  value at birth; for pscale a radius in metres [number, default 1]
---@field hold? number|fun(frame: rapid.Frame): number  fraction of the life before the change begins [number, from 0 to 0.999, default 0]
---@field last? number|fun(frame: rapid.Frame): number  value at death [number, default 0]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Changes an attribute over the life of each point.
---@param params? rapid.params.fade_by_age
---@return rapid.Node
function Node:fade_by_age(params) end

---@class rapid.params.field
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field grid rapid.Grid|fun(frame: rapid.Frame): rapid.Grid  grid of vectors, or a sequence of them [vector grid, required]
---@field mode? "force"|"velocity"|fun(frame: rapid.Frame): "force"|"velocity"  meaning of the vectors: forces (N), or velocities (m/s) that points approach [string, one of force, velocity, default "force"]
---@field strength? number|rapid.Attribute|fun(frame: rapid.Frame): number  factor of the vectors [number, default 1, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which points reach the velocities, with mode = "velocity"; the default is 1 [number, 1/s, at least 0, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Moves points by a grid of vectors: as a force, or as the velocity of a flow.
---@param params rapid.params.field
---@return rapid.Node
function Node:field(params) end

---@class rapid.params.follow_curve
---@field duration? number|fun(frame: rapid.Frame): number  time from the first position to the last; each span takes the same part of it [number, s, at least 1e-06, default 1]
---@field points rapid.Place[]|fun(frame: rapid.Frame): rapid.Place[]  positions that the curve passes through, at least two [list of vec3, m, required]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Moves points along a curve.
---@param params rapid.params.follow_curve
---@return rapid.Node
function Node:follow_curve(params) end

---@class rapid.params.follow_leader
---@field distance? number|fun(frame: rapid.Frame): number  distance between the leader and the train [number, m, at least 0, default 0.5]
---@field leader string|fun(frame: rapid.Frame): string  group of the leader [string, required]
---@field length? number|fun(frame: rapid.Frame): number  length of the train [number, m, at least 0, default 2]
---@field response? number|fun(frame: rapid.Frame): number  time in which the difference of the velocity falls to 1/e [number, s, at least 1e-06, default 0.2]
---@field speed? number|fun(frame: rapid.Frame): number  maximum speed [number, m/s, at least 1e-06, default 5]
---@field time? number|fun(frame: rapid.Frame): number  time in which points close up to the train [number, s, at least 1e-06, default 0.5]
---@field width? number|fun(frame: rapid.Frame): number  radius of the train [number, m, at least 0, default 0.5]
---@field name? string  name of the node in messages [string]

---Makes points follow a leader.
---@param params rapid.params.follow_leader
---@return rapid.Node
function Node:follow_leader(params) end

---@class rapid.params.goal
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field to rapid.Mesh|rapid.Shape|rapid.Points|rapid.Attribute|fun(frame: rapid.Frame): rapid.Mesh|rapid.Shape|rapid.Points|rapid.Attribute  targets: a mesh, a shape or points, which may move, or a vec3 attribute, rapid.attr "NAME" [mesh, shape, points or rapid.attr, required]
---@field by? "id"|"nearest"|"random"  choice of the target: by the id of a point or vertex, at random, or the nearest (of points, the nearest that is free) [string, one of id, nearest, random, default "id", constant]
---@field start? number|fun(frame: rapid.Frame): number  time at which points begin to move [number, s, default 0]
---@field time? number|fun(frame: rapid.Frame): number  time that each point takes [number, s, at least 1e-06, default 1]
---@field stagger? number|fun(frame: rapid.Frame): number  maximum random delay of a point's start [number, s, at least 0, default 0]
---@field clock? "scene"|"age"  clock of start: the time of the scene, or the age of the point [string, one of scene, age, default "scene", constant]
---@field hold? boolean|fun(frame: rapid.Frame): boolean  keeps points at their targets after they arrive [boolean, default true]
---@field name? string  name of the node in messages [string]

---Moves points to target positions in a given time.
---@param params rapid.params.goal
---@return rapid.Node
function Node:goal(params) end

---@class rapid.params.gravity
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field g? rapid.Place|fun(frame: rapid.Frame): rapid.Place  acceleration [vec3, m/s², default {0, -9.81, 0}]
---@field name? string  name of the node in messages [string]

---Accelerates all points equally.
---@param params? rapid.params.gravity
---@return rapid.Node
function Node:gravity(params) end

---@class rapid.params.group
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field name string  name of the group [string, required, constant]
---@field where? fun(p: rapid.Point, frame: rapid.Frame): any  function of a point that returns true for members; without it all points are members [function of a point]

---Puts the points for which `where` is true into a group, in each frame.
---@param params rapid.params.group
---@return rapid.Node
function Node:group(params) end

---@class rapid.params.group_by_bounds
---@field into string  name of the group [name of a group, required, constant]
---@field max? rapid.Place|fun(frame: rapid.Frame): rapid.Place  upper corner of the box [vec3, m, default {1, 1, 1}]
---@field min? rapid.Place|fun(frame: rapid.Frame): rapid.Place  lower corner of the box; its faces are inside [vec3, m, default {-1, -1, -1}]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Puts the points in a box into a group and removes all others from it.
---@param params rapid.params.group_by_bounds
---@return rapid.Node
function Node:group_by_bounds(params) end

---@class rapid.params.group_by_shape
---@field distance? number|fun(frame: rapid.Frame): number  maximum signed distance of members from the surface; negative values are inside [number, m, default 0]
---@field into string  name of the group [name of a group, required, constant]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  shape or level set [shape at rest or moving, required]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Puts the points in or near a shape into a group and removes all others from it.
---@param params rapid.params.group_by_shape
---@return rapid.Node
function Node:group_by_shape(params) end

---@class rapid.params.impact_spin
---@field grip? number|fun(frame: rapid.Frame): number  fraction of the change to rolling that each contact makes [number, from 0 to 1, default 1]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Makes points spin after they hit a shape.
---@param params? rapid.params.impact_spin
---@return rapid.Node
function Node:impact_spin(params) end

---@class rapid.params.interact
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field radius number|fun(frame: rapid.Frame): number  distance within which points are neighbours [number, m, above 0, required]
---@field separation? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration that separates neighbours, largest where they touch [number, m/s², at least 0, default 0, takes rapid.attr]
---@field cohesion? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration that draws neighbours together, largest at half the radius [number, m/s², at least 0, default 0, takes rapid.attr]
---@field alignment? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which the velocities of neighbours become equal [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which neighbours stop approaching and separating; rotation about each other is not damped [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field avoidance? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration that turns points aside from others that they would pass too closely [number, m/s², at least 0, default 0, takes rapid.attr]
---@field foresight? number|fun(frame: rapid.Frame): number  time for which points look ahead to avoid others [number, s, above 0, default 1]
---@field clearance? number|fun(frame: rapid.Frame): number  distance at which points pass each other; the default is half the radius [number, m, above 0]
---@field view? number|fun(frame: rapid.Frame): number  angle about its velocity in which a point sees others [number, deg, from 0 to 360, default 360]
---@field most? integer|fun(frame: rapid.Frame): integer  number of nearest visible neighbours to which a point reacts; 0 for all [integer, from 0 to 1000000000, default 0]
---@field name? string  name of the node in messages [string]

---Moves points by their neighbours: separation, cohesion, alignment, drag, avoidance.
---@param params rapid.params.interact
---@return rapid.Node
function Node:interact(params) end

---@class rapid.params.jitter
---@field strength? number|fun(frame: rapid.Frame): number  root mean square speed gained in one second [number, m/s, at least 0, default 1]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Kicks points in random directions, in each frame.
---@param params? rapid.params.jitter
---@return rapid.Node
function Node:jitter(params) end

---@class rapid.params.kill_slow
---@field age? number|fun(frame: rapid.Frame): number  age below which points stay [number, s, at least 0, default 0]
---@field speed? number|fun(frame: rapid.Frame): number  speed below which points are removed [number, m/s, at least 0, default 0.05]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Removes points that move too slowly.
---@param params? rapid.params.kill_slow
---@return rapid.Node
function Node:kill_slow(params) end

---@class rapid.params.lift
---@field cooling? number|fun(frame: rapid.Frame): number  time in which the heat falls to 1/e [number, s, at least 0.001, default 0.5]
---@field strength? number|fun(frame: rapid.Frame): number  acceleration at a heat of 1 [number, m/s², at least 0, default 1]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Raises points in proportion to their heat and cools them.
---@param params? rapid.params.lift
---@return rapid.Node
function Node:lift(params) end

---@class rapid.params.limit_speed
---@field max? number|fun(frame: rapid.Frame): number  maximum speed [number, m/s, at least 0, default inf]
---@field min? number|fun(frame: rapid.Frame): number  minimum speed of a moving point [number, m/s, at least 0, default 0]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Keeps the speed of points within a range.
---@param params? rapid.params.limit_speed
---@return rapid.Node
function Node:limit_speed(params) end

---@class rapid.params.look_ahead
---@field clearance? number|fun(frame: rapid.Frame): number  distance from the surface at which points pass [number, m, at least 0, default 0.1]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  shape or level set [shape at rest or moving, required]
---@field strength? number|fun(frame: rapid.Frame): number  maximum acceleration [number, m/s², at least 0, default 20]
---@field time? number|fun(frame: rapid.Frame): number  time for which points look ahead [number, s, at least 1e-06, default 1]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Turns points aside before they hit a shape.
---@param params rapid.params.look_ahead
---@return rapid.Node
function Node:look_ahead(params) end

---@class rapid.params.merge
---@field name? string  name of the node in messages [string]

---Joins the points of several chains; a point that arrives by several chains is taken once.
---@param ... rapid.Node|rapid.params.merge
---@return rapid.Node
function Node:merge(...) end

---@class rapid.params.picture
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field blend? "over"|"add"|fun(frame: rapid.Frame): "over"|"add"  over: nearer points hide others; add: points add their light and cast no shadow [string, one of over, add, default "over"]
---@field draw? "balls"|"cards"|fun(frame: rapid.Frame): "balls"|"cards"  cards: flat discs perpendicular to the y axis of orient, which show how points turn [string, one of balls, cards, default "balls"]
---@field shutter? number|fun(frame: rapid.Frame): number  fraction of the frame for which the picture is exposed, so that moving points leave streaks [number, from 0 to 1, default 0]
---@field camera? rapid.Camera|table<integer, rapid.Camera>|fun(frame: rapid.Frame): rapid.Camera|table<integer, rapid.Camera>  camera made by rapid.camera, a function of the frame that returns one, or keys; by default fitted to the scene [camera]
---@field emitters? boolean|fun(frame: rapid.Frame): boolean  shows the shapes that emit points [boolean, default true]
---@field colliders? boolean|fun(frame: rapid.Frame): boolean  shows the shapes that points collide with [boolean, default true]
---@field grid? boolean|fun(frame: rapid.Frame): boolean  draws lines on the ground, unless a plane of the scene is the ground [boolean, default true]
---@field name? string  name of the node in messages [string]

---Sets how points and shapes look in pictures, without changing any point.
---@param params? rapid.params.picture
---@return rapid.Node
function Node:picture(params) end

---@class rapid.params.pin
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field target? rapid.Place|rapid.Attribute|rapid.Shape|fun(frame: rapid.Frame): rapid.Place|rapid.Attribute|rapid.Shape  position, rapid.attr, or moving shape or mesh that carries the points; the default is where a point is first pinned [vec3, attribute or moving shape, m]
---@field transform? rapid.Motion|fun(frame: rapid.Frame): rapid.Motion  motion that carries the points, a function of the frame that returns one, or keys by frame [motion]
---@field compliance? number  displacement per force; 0 is rigid [number, m/N, at least 0, default 0, constant]
---@field name? string  name of the node in messages [string]

---Holds points at their initial position, at a target, or on a moving body.
---@param params? rapid.params.pin
---@return rapid.Node
function Node:pin(params) end

---@class rapid.params.points
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field kernel fun(p: rapid.Point, frame: rapid.Frame)  function of a point, function(p, frame) [function of a point, required]
---@field reads? string|string[]  attributes that the kernel reads by computed names [names, constant]
---@field writes? string|string[]  attributes that the kernel assigns by computed names [names, constant]
---@field name? string  name of the node in messages [string]

---Runs a Lua function on each point, in parallel.
---@overload fun(self: rapid.Node, name: string, kernel: fun(p: rapid.Point, frame: rapid.Frame)): rapid.Node
---@param params rapid.params.points
---@return rapid.Node
function Node:points(params) end

---@class rapid.params.ramp
---@field from? string  attribute that is looked up, a vec3 by its length [name of an attribute, default "age", constant]
---@field keys? any[]|fun(frame: rapid.Frame): any[]  keys {value of from, value of to}, in rising order [ramp, default {{0, {1, 1, 1}}, {1, {0, 0, 0}}}]
---@field to? string  attribute that is written [name of an attribute, default "Cd", constant]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Computes an attribute from another through a ramp of keys.
---@param params? rapid.params.ramp
---@return rapid.Node
function Node:ramp(params) end

---@class rapid.params.randomize
---@field attribute? string  float attribute that is written [name of a number attribute, default "pscale", constant]
---@field bias? number|fun(frame: rapid.Frame): number  exponent of the distribution: 1 is uniform, larger values favour min [number, at least 0.001, default 1]
---@field max? number|fun(frame: rapid.Frame): number  largest value [number, default 1]
---@field min? number|fun(frame: rapid.Frame): number  smallest value [number, default 0]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Gives each point its own random value of an attribute.
---@param params? rapid.params.randomize
---@return rapid.Node
function Node:randomize(params) end

---@class rapid.params.rasterize
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field file string  pattern of the files, with #### for the frame; a file has the grid density and one grid per attribute [string, required, constant]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1, constant]
---@field radius? number|rapid.Attribute  radius over which a point is spread, at least a voxel; the default is 1.5 voxels [number, m, above 0, takes rapid.attr, constant]
---@field weight? number|rapid.Attribute  weight of a point; the integral of the density is the sum of the weights [number, at least 0, default 1, takes rapid.attr, constant]
---@field attributes? string|string[]  vec3 attributes, each written as a grid of its weighted mean; the default is {"v"} [names, constant]
---@field name? string  name of the node in messages [string]

---Writes the points as volumes to .vdb files and passes them on.
---@param params rapid.params.rasterize
---@return rapid.Node
function Node:rasterize(params) end

---@class rapid.params.solve
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field substeps? integer|fun(frame: rapid.Frame): integer  number of substeps per frame; the default is 1, or with :contact the number that the points need to hold each other, up to max_substeps [integer, from 1 to 1048576]
---@field iterations? integer|fun(frame: rapid.Frame): integer  iterations of the constraints per substep [integer, from 1 to 10000, default 1]
---@field sleep? number|fun(frame: rapid.Frame): number  time at rest after which points with constraints sleep until something acts on them; math.huge for never [number, s, above 0, default 0.25]
---@field tolerance? number|fun(frame: rapid.Frame): number  maximum error per frame; each point takes 1, 2, 4, ... substeps, as its estimated error needs [number, m per frame, above 0]
---@field max_substeps? integer|fun(frame: rapid.Frame): integer  maximum number of substeps, with a tolerance or without substeps [integer, from 1 to 1048576, default 64]
---@field name? string  name of the node in messages [string]

---Advances the points by one frame: forces, motion, collisions, constraints.
---@param params? rapid.params.solve
---@return rapid.Node
function Node:solve(params) end

---@class rapid.params.spawn
---@field from rapid.Node  node whose points are the parents [node, required, constant]
---@field source_group? string  group of the parents that emit [string, constant]
---@field on? string|fun(p: rapid.Point, frame: rapid.Frame): any  event: "hit", "death", "birth", a comparison ("age > 0.5"), or a function of a point; without it births are continuous [event or function of a point]
---@field min_speed? number|fun(frame: rapid.Frame): number  minimum speed of approach, with on = "hit" [number, m/s, at least 0]
---@field rate? number|rapid.Attribute|fun(frame: rapid.Frame): number|rapid.Attribute  births per second of each parent [number or rapid.attr, 1/s, at least 0]
---@field count? integer|rapid.Attribute|fun(frame: rapid.Frame): integer|rapid.Attribute  births of each parent per frame, or per event (1 by default) [integer or rapid.attr, at least 0]
---@field limit? number|fun(frame: rapid.Frame): number  maximum number of births of one parent [number, at least 0]
---@field birth? "random"|"begin"|"end"|"even"  time of birth in the frame: at random, at its beginning or end, or evenly spaced; or a function(p, frame) of each newborn point [moment or function of a point, one of random, begin, end, even, default "random"]
---@field velocity? rapid.Place|fun(frame: rapid.Frame): rapid.Place  mean initial velocity [vec3, m/s, default {0, 0, 0}]
---@field speed? number|number[]|fun(frame: rapid.Frame): number|number[]  speed along N (of a hit, else the parent's N, else its direction of motion), added to velocity; a number or {min, max} [number or {min, max}, m/s, default 0]
---@field spread? number|fun(frame: rapid.Frame): number  half angle of the cone in which velocity and speed are turned together, uniformly [number, deg, from 0 to 180, default 0]
---@field life? number|number[]|fun(frame: rapid.Frame): number|number[]  age at which points die: a number or {min, max}; without it points live for ever [number or {min, max}, s, at least 0]
---@field group? string  group that newborn points join [string, constant]
---@field attributes? table<string, number|rapid.Vec3|string|any[]>|fun(frame: rapid.Frame): table<string, number|rapid.Vec3|string|any[]>  values of newborn points instead of inherited ones, {heat = 1}: a value, a ramp, or a range {min, max}, of vectors on a line; for a box, birth = function(p) [attributes]
---@field inherit? string|string[]|fun(frame: rapid.Frame): string|string[]  names of attributes that newborn points copy from their parent [names]
---@field inherit_velocity? number|fun(frame: rapid.Frame): number  fraction of the parent's velocity that is added [number, default 1]
---@field split? boolean|fun(frame: rapid.Frame): boolean  divides the parent's mass and volume among points that are born together [boolean, default false]
---@field kill_parent? boolean|fun(frame: rapid.Frame): boolean  removes a parent after it has emitted at an event [boolean, default false]
---@field name? string  name of the node in messages [string]

---Emits points from the points of another node, continuously or at events.
---@param params rapid.params.spawn
---@return rapid.Node
function Node:spawn(params) end

---@class rapid.params.spin
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  axis in world space, of any nonzero length [vec3, default {0, 1, 0}]
---@field rate? number|fun(frame: rapid.Frame): number  angular speed [number, deg/s, default 360]
---@field variation? number|fun(frame: rapid.Frame): number  maximum random deviation of a point's rate, as a fraction of it [number, at least 0, default 0]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Turns orient about a fixed axis.
---@param params? rapid.params.spin
---@return rapid.Node
function Node:spin(params) end

---@class rapid.params.spring
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field target? rapid.Place|rapid.Attribute|rapid.Shape|fun(frame: rapid.Frame): rapid.Place|rapid.Attribute|rapid.Shape  position, rapid.attr, or shape to which the spring pulls [vec3, attribute or shape at rest or moving, m, default {0, 0, 0}]
---@field stiffness? number|rapid.Attribute|fun(frame: rapid.Frame): number  force per metre of distance [number, N/m, at least 0, default 1, takes rapid.attr]
---@field damping? number|rapid.Attribute|fun(frame: rapid.Frame): number  force per unit of speed [number, N s/m, at least 0, default 0, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Pulls points to a position or a shape with a spring.
---@param params? rapid.params.spring
---@return rapid.Node
function Node:spring(params) end

---@class rapid.params.swirl
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  axis of rotation, of any nonzero length [vec3, default {0, 1, 0}]
---@field center? rapid.Place|fun(frame: rapid.Frame): rapid.Place  position on the axis [vec3, m, default {0, 0, 0}]
---@field strength? number|fun(frame: rapid.Frame): number  acceleration per metre of distance from the axis [number, 1/s², default 1]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Accelerates points around an axis in proportion to their distance from it.
---@param params? rapid.params.swirl
---@return rapid.Node
function Node:swirl(params) end

---@class rapid.params.torque
---@field inertia? number|fun(frame: rapid.Frame): number  moment of inertia; 0 for that of a solid sphere [number, kg m², at least 0, default 0]
---@field torque? rapid.Place|fun(frame: rapid.Frame): rapid.Place  torque in world space [vec3, N m, default {0, 0, 0}]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Changes the angular velocity w of points by a torque.
---@param params? rapid.params.torque
---@return rapid.Node
function Node:torque(params) end

---@class rapid.params.trail
---@field places? integer  number of frames that are recorded [integer, from 1 to 256, default 12, constant]
---@field name? string  name of the node in messages [string]

---Records the positions of each point in its last frames as trail1, trail2, ...
---@param params? rapid.params.trail
---@return rapid.Node
function Node:trail(params) end

---@class rapid.params.transfer
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field source rapid.Mesh  mesh, which may move or deform [mesh, required, constant]
---@field attributes? string|string[]  names of attributes of the mesh's vertices, corners or faces; the default is all [names, constant]
---@field distance? number|fun(frame: rapid.Frame): number  distance beyond which points keep their values [number, m, at least 0, default inf]
---@field name? string  name of the node in messages [string]

---Gives points the attributes of the nearest position on a mesh.
---@param params rapid.params.transfer
---@return rapid.Node
function Node:transfer(params) end

---@class rapid.params.tumble
---@field drag? number|fun(frame: rapid.Frame): number  rate at which w decreases [number, 1/s, at least 0, default 0]
---@field speed? number|fun(frame: rapid.Frame): number  angular speed of points whose w is 0, about a random axis [number, deg/s, at least 0, default 0]
---@field stop_at_rest? boolean|fun(frame: rapid.Frame): boolean  stops turning points slower than 1 cm/s [boolean, default false]
---@field variation? number|fun(frame: rapid.Frame): number  fraction of the speed by which points differ [number, from 0 to 1, default 0]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Turns orient by the angular velocity w of each point.
---@param params? rapid.params.tumble
---@return rapid.Node
function Node:tumble(params) end

---@class rapid.params.turbulence
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field amplitude? number|rapid.Attribute|fun(frame: rapid.Frame): number  root mean square acceleration [number, m/s², default 1, takes rapid.attr]
---@field size? number|fun(frame: rapid.Frame): number  size of the largest eddies [number, m, above 0, default 1]
---@field speed? number|fun(frame: rapid.Frame): number  rate at which the field changes [number, 1/s, at least 0, default 0]
---@field octaves? integer|fun(frame: rapid.Frame): integer  number of scales, each with eddies half as large and half as strong [integer, from 1 to 16, default 3]
---@field seed? integer|fun(frame: rapid.Frame): integer  seed of the field [integer, at least 0, default 0]
---@field name? string  name of the node in messages [string]

---Accelerates points by a random field of eddies.
---@param params? rapid.params.turbulence
---@return rapid.Node
function Node:turbulence(params) end

---@class rapid.params.vortex
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field center? rapid.Place|rapid.Attribute|fun(frame: rapid.Frame): rapid.Place  position on the axis [vec3, m, default {0, 0, 0}, takes rapid.attr]
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  direction of the axis, of any nonzero length [vec3, default {0, 1, 0}]
---@field strength? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration, counterclockwise about the axis [number, m/s², default 1, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Accelerates points around an axis.
---@param params? rapid.params.vortex
---@return rapid.Node
function Node:vortex(params) end

---@class rapid.params.wander
---@field change? number|fun(frame: rapid.Frame): number  rate at which the flow changes [number, 1/s, at least 0, default 0.5]
---@field octaves? integer|fun(frame: rapid.Frame): integer  number of eddy sizes, each half the previous one [integer, from 1 to 16, default 2]
---@field response? number|fun(frame: rapid.Frame): number  time in which the difference of the velocity falls to 1/e [number, s, at least 1e-06, default 0.2]
---@field seed? integer|fun(frame: rapid.Frame): integer  seed of the flow [integer, at least 0, default 0]
---@field size? number|fun(frame: rapid.Frame): number  size of the largest eddies [number, m, at least 1e-06, default 1]
---@field speed? number|fun(frame: rapid.Frame): number  root mean square speed of the flow [number, m/s, at least 0, default 1]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Carries points along a turbulent flow.
---@param params? rapid.params.wander
---@return rapid.Node
function Node:wander(params) end

---@class rapid.params.wind
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field velocity? rapid.Place|rapid.Attribute|fun(frame: rapid.Frame): rapid.Place  velocity of the air [vec3, m/s, default {0, 0, 0}, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which points reach the velocity of the air [number, 1/s, at least 0, default 1, takes rapid.attr]
---@field name? string  name of the node in messages [string]

---Drags points along with moving air.
---@param params? rapid.params.wind
---@return rapid.Node
function Node:wind(params) end

---@class rapid.params.wrap
---@field max? rapid.Place|fun(frame: rapid.Frame): rapid.Place  upper corner of the box, above min on each axis [vec3, m, default {1, 1, 1}]
---@field min? rapid.Place|fun(frame: rapid.Frame): rapid.Place  lower corner of the box [vec3, m, default {-1, -1, -1}]
---@field group? string  limits the node to the points of this group [string, constant]
---@field name? string  name of the node in messages [string]

---Moves points that leave a box to its opposite side.
---@param params? rapid.params.wrap
---@return rapid.Node
function Node:wrap(params) end

---@class rapid.params.write
---@field group? string|fun(frame: rapid.Frame): string  limits the node to the points of this group [string]
---@field file string|fun(frame: rapid.Frame): string  pattern of the files, with #### for the frame [string, required]
---@field attributes? string|string[]  attributes that are written besides P, v and id; the default is all [names, constant]
---@field name? string  name of the node in messages [string]

---Writes the points to files and passes them on.
---@param params rapid.params.write
---@return rapid.Node
function Node:write(params) end

return rapid
