---@meta rapid
-- The graph language, for editors with the Lua language server. Written by `rapid nodes --annotations`; do not edit.

---Three numbers that do not change.
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
---Returns it with length 1; zero stays zero.
---@return rapid.Vec3
function Vec3:normalized() end
---Interpolates from this (t = 0) to w (t = 1).
---@param w rapid.Vec3
---@param t number
---@return rapid.Vec3
function Vec3:lerp(w, t) end

---A rotation that does not change: q * r turns by r, and then by q.
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
---The shortest way from this (t = 0) to r (t = 1).
---@param r rapid.Quat
---@param t number
---@return rapid.Quat
function Quat:slerp(r, t) end

---@class rapid.StudyDefinition
---@field name string
---@field scene fun(knobs: table): rapid.Node|table<string, rapid.Node>
---@field frames integer[]  the first and the last
---@field sweep table<string, (number|string|boolean)[]>  the values of each knob
---@field lines? string|string[]  the knobs that tell the lines of the plot apart
---@field reference? table|fun(frame: rapid.Frame, knobs: table): table  knobs, or a closed form: { P = {...} }
---@field error? "rms"|"max"|"p95"|"residual"|fun(points: table, reference: table): number  of columns, place by place
---@field error_frames? "all"|"last"
---@field repeat_runs? integer  timed runs of each row, 5 if not given

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
---@field number number  counted from the scene's start
---@field time number    seconds since the start
---@field dt number      seconds to the next frame

---A point's own time, in an action.
---@class rapid.Step
---@field time number    seconds since the start
---@field dt number      seconds of this sub-step
---@field index integer  of the sub-step

---@class rapid.Attribute  each point's own value, from rapid.attr
---@class rapid.Points
local Points = {}
---@param motion rapid.Motion
---@return rapid.Points
function Points:transform(motion) end

---@class rapid.Camera

---@class rapid.Motion  a * b moves by b, and then by a
---@operator mul(rapid.Motion): rapid.Motion

---@class rapid.Mesh
local Mesh = {}
---@param motion rapid.Motion
---@return rapid.Mesh
function Mesh:transform(motion) end
---Distance to the nearest face, metres; in kernels.
---@param P rapid.Vec3
---@return number
function Mesh:distance(P) end
---Direction away from the nearest face; in kernels.
---@param P rapid.Vec3
---@return rapid.Vec3
function Mesh:gradient(P) end
---Velocity of the nearest face, m/s; in kernels.
---@param P rapid.Vec3
---@return rapid.Vec3
function Mesh:velocity(P) end
---The nearest position; with a name, the value of that attribute there; in kernels.
---@param P rapid.Vec3
---@param attribute? string
---@return any
function Mesh:closest(P, attribute) end

---@class rapid.Shape
local Shape = {}
---Signed distance, metres, negative inside.
---@param P rapid.Vec3
---@return number
function Shape:distance(P) end
---Direction out of the shape.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:gradient(P) end
---Velocity of the shape there, m/s.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:velocity(P) end
---The nearest position on the surface; for a level set within its band.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:closest(P) end

---@class rapid.LevelSet: rapid.Shape
local LevelSet = {}
---Writes a .vdb file, in a run.
---@param path string  relative to the current folder
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

---@class rapid.Fog  a volume of a density
local Fog = {}
---The density, trilinear between voxels.
---@param P rapid.Vec3
---@return number
function Fog:sample(P) end
---Writes a .vdb file, in a run.
---@param path string  relative to the current folder
---@param options? { grid?: string }
---@return rapid.Fog
function Fog:write(path, options) end

---@class rapid.Grid  of vectors
local Grid = {}
---Interpolates between voxels.
---@param P rapid.Vec3
---@return rapid.Vec3
function Grid:sample(P) end
---Writes a .vdb file, in a run.
---@param path string  relative to the current folder
---@param options? { grid?: string }
---@return rapid.Grid
function Grid:write(path, options) end

---@class rapid.Curve  lines from place to place
local Curve = {}
---@param motion rapid.Motion|fun(frame: rapid.Frame): rapid.Motion|table<integer, rapid.Motion>
---@return rapid.Curve
function Curve:transform(motion) end

---@class rapid
local rapid = {}
rapid.mesh, rapid.levelset, rapid.grid, rapid.fog, rapid.shape, rapid.points, rapid.math = {}, {}, {}, {}, {}, {}, {}
rapid.curve = {}

---A value that --set can replace.
---@generic T
---@param name string
---@param default T  a number, a boolean, a string or a vec3
---@param doc? string
---@return T
function rapid.param(name, default, doc) end

---Each point's own value of an attribute, for parameters that take it.
---@param name string
---@return rapid.Attribute
function rapid.attr(name) end

---A shape, a mesh or points offered by the program that has opened the scene.
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
---@field name string  of its file, too
---@field doc string
---@field params? table<string, rapid.NodeParameter>
---@field makes? table<string, number|number[]>  attributes that it brings into being, with their value
---@field points? fun(p: rapid.Point, frame: rapid.Frame, params: table)
---@field action? fun(p: rapid.Point, step: rapid.Step, params: table)  inside Solve, at every sub-step
---@field expand? fun(input: rapid.Node, params: table): rapid.Node

---A node written in Lua; its file returns it.
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

---Points at even distances along a curve, with its direction N and the part u of its length.
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

---0 up to lo, 1 from hi on, smooth between.
---@param lo number
---@param hi number
---@param x number
---@return number
function rapid.math.smoothstep(lo, hi, x) end

---A number in [-1, 1] that changes smoothly with position and time.
---@param P rapid.Vec3
---@param time? number
---@param octaves? integer
---@param seed? integer
---@return number
function rapid.math.noise(P, time, octaves, seed) end

---A flow, about 1 long, that neither gathers nor spreads points.
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
---@field position? rapid.Place  its place [vec3, m]
---@field target? rapid.Place  where it looks [vec3, m]
---@field fov? number  vertical angle of view, degrees; 35 without it [number, from 1 to 170]
---@field group? string  a group of points that it frames and follows, in place of the scene [string]

---From where pictures are taken; what it leaves open is fitted.
---@param options? rapid.options.camera_camera
---@return rapid.Camera
function rapid.camera(options) end

---@class rapid.options.curve_from
---@field points rapid.Place[]|rapid.Points|fun(frame: rapid.Frame): rapid.Place[]|rapid.Points  {{x, y, z}, ...} or points, in the order of the curve; or a function of the frame that returns either, always as many [list of vec3, points, or function of the frame, m, required]
---@field closed? boolean  from the last point to the first, too [boolean, default false]

---A curve through places, or one that deforms.
---@param options? rapid.options.curve_from
---@return rapid.Curve
function rapid.curve.from(options) end

---@class rapid.options.curve_read
---@field closed? boolean  from the last point to the first, too [boolean, default false]
---@field before? "hold"|"repeat"|"mirror"|"none"  what goes before the first file of a sequence: "hold" (that file), "repeat" (the last ones again), "mirror" (back and forth) or "none" (nothing) [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  and behind the last one [string, one of hold, repeat, mirror, none]
---@field offset? number  by which the files of a sequence come later: frame f has the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads curves from a file of points: the lines of an .obj, or all points.
---@param path string  relative to the graph file; with #### or $F4 in it a file for each frame: a curve that deforms [string, required]
---@param options? rapid.options.curve_read
---@return rapid.Curve
function rapid.curve.read(path, options) end

---@class rapid.options.fog_from_points
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field radius? number|rapid.Attribute  over which a point is spread, at least a voxel; 1.5 voxels when not given [number, m, above 0, takes rapid.attr]
---@field weight? number|rapid.Attribute  what a point counts: the sum of density times volume is that of the weights [number, at least 0, default 1, takes rapid.attr]

---The density of points: their weights by volume.
---@param points rapid.Points  what is spread over the voxels [points, required]
---@param options? rapid.options.fog_from_points
---@return rapid.Fog
function rapid.fog.from_points(points, options) end

---@class rapid.options.fog_read
---@field grid? string  its name; the only fog of floats, when not given [string]
---@field before? "hold"|"repeat"|"mirror"|"none"  what goes before the first file of a sequence: "hold" (that file), "repeat" (the last ones again), "mirror" (back and forth) or "none" (nothing) [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  and behind the last one [string, one of hold, repeat, mirror, none]
---@field offset? number  by which the files of a sequence come later: frame f has the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a fog, in which points are born by density, from a .vdb file.
---@param path string  relative to the graph file; with #### or $F4 in it a sequence, a file for each frame or for some [string, required]
---@param options? rapid.options.fog_read
---@return rapid.Fog
function rapid.fog.read(path, options) end

---@class rapid.options.grid_from
---@field at fun(P: rapid.Vec3): rapid.Vec3  asked at each node of the lattice, once [function of a place, required]
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]
---@field voxel? number  between nodes [number, m, at least 2e-05, default 0.1]

---A grid of vectors by a function of the place.
---@param options? rapid.options.grid_from
---@return rapid.Grid
function rapid.grid.from(options) end

---@class rapid.options.grid_from_points
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field radius? number|rapid.Attribute  over which a point is spread, at least a voxel; 1.5 voxels when not given [number, m, above 0, takes rapid.attr]
---@field weight? number|rapid.Attribute  what a point counts: the sum of density times volume is that of the weights [number, at least 0, default 1, takes rapid.attr]
---@field attribute? string  a vec3 [string, default "v"]

---The mean of a vec3 of points, by their weights.
---@param points rapid.Points  what is spread over the voxels [points, required]
---@param options? rapid.options.grid_from_points
---@return rapid.Grid
function rapid.grid.from_points(points, options) end

---@class rapid.options.grid_read
---@field grid? string  its name; the only grid of vectors, when not given [string]
---@field before? "hold"|"repeat"|"mirror"|"none"  what goes before the first file of a sequence: "hold" (that file), "repeat" (the last ones again), "mirror" (back and forth) or "none" (nothing) [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  and behind the last one [string, one of hold, repeat, mirror, none]
---@field offset? number  by which the files of a sequence come later: frame f has the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a grid of vectors from a .vdb file.
---@param path string  relative to the graph file; with #### or $F4 in it a sequence, a file for each frame or for some [string, required]
---@param options? rapid.options.grid_read
---@return rapid.Grid
function rapid.grid.read(path, options) end

---Writes fogs and grids of vectors to a .vdb file, in a run.
---@param path string  relative to the current folder [string, required]
---@param grids table  { density = fog, v = grid }: their names in the file [table, required]
---@return rapid.Grid
function rapid.grid.write(path, grids) end

---@class rapid.options.levelset_box
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  of the band, on each side of the surface [number, voxels, at least 1.5, default 3]

---A box.
---@param options? rapid.options.levelset_box
---@return rapid.LevelSet
function rapid.levelset.box(options) end

---@class rapid.options.levelset_from_mesh
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  of the band, on each side of the surface [number, voxels, at least 1.5, default 3]

---The distance to a closed mesh; where that moves or deforms, a collider that does.
---@param mesh rapid.Mesh  closed [mesh, required]
---@param options? rapid.options.levelset_from_mesh
---@return rapid.LevelSet
function rapid.levelset.from_mesh(mesh, options) end

---@class rapid.options.levelset_from_points
---@field radius? number|rapid.Attribute  of the balls; the attribute pscale where the points have it [number, m, above 0, takes rapid.attr]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  of the band, on each side of the surface [number, voxels, at least 1.5, default 3]

---The balls around points.
---@param points rapid.Points  their middles [points, required]
---@param options? rapid.options.levelset_from_points
---@return rapid.LevelSet
function rapid.levelset.from_points(points, options) end

---The surface moved along its normal.
---@param metres number  outwards; inwards where below 0 [number, m, required]
---@return rapid.LevelSet
function LevelSet:offset(metres) end

---@class rapid.options.levelset_read
---@field grid? string  its name; the only level set, when not given [string]
---@field before? "hold"|"repeat"|"mirror"|"none"  what goes before the first file of a sequence: "hold" (that file), "repeat" (the last ones again), "mirror" (back and forth) or "none" (nothing) [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  and behind the last one [string, one of hold, repeat, mirror, none]
---@field offset? number  by which the files of a sequence come later: frame f has the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads a level set from a .vdb file, or a sequence.
---@param path string  relative to the graph file; with #### or $F4 in it a sequence, a file for each frame or for some [string, required]
---@param options? rapid.options.levelset_read
---@return rapid.LevelSet
function rapid.levelset.read(path, options) end

---The same surface on voxels of another size.
---@param voxel number  edge of a voxel [number, m, at least 2e-05, required]
---@return rapid.LevelSet
function LevelSet:resample(voxel) end

---@class rapid.options.levelset_smooth
---@field width? integer  of the filter [integer, voxels, from 1 to 64, default 1]
---@field iterations? integer  times that it is applied [integer, from 1 to 1000, default 1]

---Rounds edges and fills creases.
---@param options? rapid.options.levelset_smooth
---@return rapid.LevelSet
function LevelSet:smooth(options) end

---@class rapid.options.levelset_sphere
---@field radius? number  of the sphere [number, m, above 0, default 1]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  of the band, on each side of the surface [number, voxels, at least 1.5, default 3]

---A sphere.
---@param options? rapid.options.levelset_sphere
---@return rapid.LevelSet
function rapid.levelset.sphere(options) end

---@class rapid.options.levelset_torus
---@field radius? number  from the axis to the middle of the tube [number, m, above 0, default 1]
---@field tube? number  radius of the tube [number, m, above 0, default 0.25]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field half_width? number  of the band, on each side of the surface [number, voxels, at least 1.5, default 3]

---A torus about the y axis.
---@param options? rapid.options.levelset_torus
---@return rapid.LevelSet
function rapid.levelset.torus(options) end

---@class rapid.options.mesh_box
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---A box.
---@param options? rapid.options.mesh_box
---@return rapid.Mesh
function rapid.mesh.box(options) end

---@class rapid.options.mesh_from
---@field points any[]  {{x, y, z}, ...} [list, m, required]
---@field faces any[]  {{1, 2, 3}, ...}: places in `points`, from 1 [list, required]
---@field values? table  { Cd = {{r, g, b}, ...}, heat = {...} }: of each of `points`, for what is born on the mesh [table]

---A mesh from a list of places and a list of faces.
---@param options? rapid.options.mesh_from
---@return rapid.Mesh
function rapid.mesh.from(options) end

---@class rapid.options.mesh_grid
---@field size? any[]  edge lengths {x, z} (1, 1) [list, m]
---@field divisions? integer  cells along each edge [integer, from 1 to 4096, default 10]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---A flat grid, facing up.
---@param options? rapid.options.mesh_grid
---@return rapid.Mesh
function rapid.mesh.grid(options) end

---@class rapid.options.mesh_read
---@field before? "hold"|"repeat"|"mirror"|"none"  what goes before the first file of a sequence: "hold" (that file), "repeat" (the last ones again), "mirror" (back and forth) or "none" (nothing) [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  and behind the last one [string, one of hold, repeat, mirror, none]
---@field offset? number  by which the files of a sequence come later: frame f has the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads OBJ, PLY, STL or glTF, or a sequence of such files.
---@param path string  relative to the graph file; with #### or $F4 in it a deforming mesh, a file for each frame [string, required]
---@param options? rapid.options.mesh_read
---@return rapid.Mesh
function rapid.mesh.read(path, options) end

---@class rapid.options.mesh_sphere
---@field radius? number  of the sphere [number, m, above 0, default 1]
---@field divisions? integer  around the equator [integer, from 3 to 4096, default 24]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---A sphere.
---@param options? rapid.options.mesh_sphere
---@return rapid.Mesh
function rapid.mesh.sphere(options) end

---@class rapid.options.mesh_torus
---@field radius? number  from the axis to the middle of the tube [number, m, above 0, default 1]
---@field tube? number  radius of the tube [number, m, above 0, default 0.25]
---@field divisions? integer  around the axis; around the tube as many as make edges of that length [integer, from 3 to 4096, default 24]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---A torus about the y axis.
---@param options? rapid.options.mesh_torus
---@return rapid.Mesh
function rapid.mesh.torus(options) end

---Turns about an axis through the origin.
---@param axis rapid.Place  any length but zero [vec3, required]
---@param degrees number  the angle, by the right-hand rule [number, deg, required]
---@return rapid.Motion
function rapid.rotate(axis, degrees) end

---Scales about the origin.
---@param factor number  of all lengths [number, above 0, required]
---@return rapid.Motion
function rapid.scale(factor) end

---@class rapid.options.points_grid
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field spacing? number  edge of a cell [number, m, above 0, default 0.1]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---Points at the centres of the cells of a box.
---@param options? rapid.options.points_grid
---@return rapid.Points
function rapid.points.grid(options) end

---@class rapid.options.points_read
---@field before? "hold"|"repeat"|"mirror"|"none"  what goes before the first file of a sequence: "hold" (that file), "repeat" (the last ones again), "mirror" (back and forth) or "none" (nothing) [string, one of hold, repeat, mirror, none]
---@field after? "hold"|"repeat"|"mirror"|"none"  and behind the last one [string, one of hold, repeat, mirror, none]
---@field offset? number  by which the files of a sequence come later: frame f has the file f - offset [number, frames, from -1000000000 to 1000000000]

---Reads points from a file that Rapid can write, or a sequence.
---@param path string  relative to the graph file; with #### or $F4 in it a file for each frame, and the result is a function of the frame [string, required]
---@param options? rapid.options.points_read
---@return rapid.Points
function rapid.points.read(path, options) end

---@class rapid.options.shape_box
---@field size? rapid.Place  full edge lengths [vec3, m, default {1, 1, 1}]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---A box.
---@param options? rapid.options.shape_box
---@return rapid.Shape
function rapid.shape.box(options) end

---@class rapid.options.shape_plane
---@field normal? rapid.Place  out of the plane; any length but zero [vec3, default {0, 1, 0}]
---@field offset? number  along the normal [number, m, default 0]

---The points with normal · x = offset; outside is where the normal points.
---@param options? rapid.options.shape_plane
---@return rapid.Shape
function rapid.shape.plane(options) end

---@class rapid.options.shape_sphere
---@field radius? number  of the sphere [number, m, above 0, default 1]
---@field center? rapid.Place  its middle [vec3, m, default {0, 0, 0}]

---A sphere.
---@param options? rapid.options.shape_sphere
---@return rapid.Shape
function rapid.shape.sphere(options) end

---The point that a kernel sees. Other attributes are those that the scene makes.
---@class rapid.Point
---@field P rapid.Vec3  m
---@field v rapid.Vec3  m/s
---@field id integer  read only
---@field dt number  read only: seconds that this point is advanced in this frame
---@field index integer  read only: place in the set, from 1
---@field nage number  read only: age as a part of life: from 0 at birth to 1 at the end
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
---The point's own random number k in [0, 1): the same in every frame, or a new one in each if given the frame.
---@param k number
---@param frame? rapid.Frame|number
---@return number
function Point:rand(k, frame) end

---@class rapid.Node
local Node = {}

---@class rapid.params.action
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field kernel fun(p: rapid.Point, step: rapid.Step)  function(p, step) [function of a point, required]
---@field reads? string|string[]  attributes that the kernel reads under names that it computes [names]
---@field writes? string|string[]  attributes that it assigns under names that it computes [names]
---@field name? string  what the node is called in messages [string]

---Edits the points with a Lua function inside Solve, at every sub-step.
---@overload fun(self: rapid.Node, name: string, kernel: fun(p: rapid.Point, step: rapid.Step)): rapid.Node
---@param params rapid.params.action
---@return rapid.Node
function Node:action(params) end

---@class rapid.params.align
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  of the point, any length but zero [vec3, default {0, 1, 0}]
---@field response? number|fun(frame: rapid.Frame): number  time in which the angle falls to 1/e [number, s, at least 0, default 0]
---@field to? string  a vec3: where the axis is to point [name of an attribute, default "N"]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Turns orient so that an axis points along an attribute.
---@param params? rapid.params.align
---@return rapid.Node
function Node:align(params) end

---@class rapid.params.align_to_velocity
---@field least? number|fun(frame: rapid.Frame): number  slower points keep their orientation [number, m/s, at least 0, default 1e-06]
---@field up? rapid.Place|fun(frame: rapid.Frame): rapid.Place  where the y axis points as far as it can [vec3, default {0, 1, 0}]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Turns orient so that its z axis points along the velocity.
---@param params? rapid.params.align_to_velocity
---@return rapid.Node
function Node:align_to_velocity(params) end

---@class rapid.params.arrive
---@field radius? number|fun(frame: rapid.Frame): number  where they begin to slow down [number, m, at least 1e-06, default 1]
---@field response? number|fun(frame: rapid.Frame): number  time in which other velocity falls to 1/e [number, s, at least 1e-06, default 0.2]
---@field speed? number|fun(frame: rapid.Frame): number  beyond the radius [number, m/s, at least 1e-06, default 1]
---@field target? rapid.Place|fun(frame: rapid.Frame): rapid.Place  where to [vec3, m, default {0, 0, 0}]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Takes points to a place, slowing down before it.
---@param params? rapid.params.arrive
---@return rapid.Node
function Node:arrive(params) end

---@class rapid.params.attract
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field center? rapid.Place|rapid.Attribute|fun(frame: rapid.Frame): rapid.Place  where to [vec3, m, default {0, 0, 0}, takes rapid.attr]
---@field shape? rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  to its surface, in place of center; also a mesh [shape at rest or moving]
---@field strength? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration; negative: away [number, m/s² at 1 m, default 1, takes rapid.attr]
---@field falloff? number|fun(frame: rapid.Frame): number  power of the distance by which it falls [number, default 2]
---@field core? number|fun(frame: rapid.Frame): number  within about this distance it grows no more [number, m, at least 0, default 0]
---@field name? string  what the node is called in messages [string]

---Draws points to a place, or to the surface of a shape.
---@param params? rapid.params.attract
---@return rapid.Node
function Node:attract(params) end

---@class rapid.params.attribute
---@field attributes? table<string, number|rapid.Vec3|string|any[]>|fun(frame: rapid.Frame): table<string, number|rapid.Vec3|string|any[]>  those whose names are parameters of nodes: { name = "" } [attributes]
---@field name? string  what the node is called in messages [string]
---@field [string] number|number[]|rapid.Vec3|string  value of points that have none: a number is a float, {x, y, z} a vec3, a text a string

---Gives attributes to points that do not have them; never overwrites.
---@param params? rapid.params.attribute
---@return rapid.Node
function Node:attribute(params) end

---@class rapid.params.avoid
---@field distance? number|fun(frame: rapid.Frame): number  where it begins to act [number, m, at least 1e-06, default 0.5]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  a shape or a level set [shape at rest or moving, required]
---@field strength? number|fun(frame: rapid.Frame): number  acceleration at the surface [number, m/s², default 10]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Pushes points away from a shape that they come near.
---@param params rapid.params.avoid
---@return rapid.Node
function Node:avoid(params) end

---@class rapid.params.clump
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  of the points; the attribute pscale where they have it, else 0 [number, m, at least 0, takes rapid.attr]
---@field strength? number|fun(frame: rapid.Frame): number  the pull that a bond bears [number, N, at least 0, default 1]
---@field name? string  what the node is called in messages [string]

---Sticks points together that touch, until they are torn apart.
---@param params? rapid.params.clump
---@return rapid.Node
function Node:clump(params) end

---@class rapid.params.collide
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  what the points collide with; a function of the frame may return nil, where there is nothing [shape, required]
---@field transform? rapid.Motion|fun(frame: rapid.Frame): rapid.Motion  moves the shape: a motion, a function of the frame that returns one, or keys by frame [motion]
---@field cut? integer[]|fun(frame: rapid.Frame): integer[]  frames to which the shape jumps: nothing is swept along on the way; found where not given [list of frames]
---@field bounce? number|rapid.Attribute|fun(frame: rapid.Frame): number  restitution: the part of the speed that is kept [number, from 0 to 1, default 0.5, takes rapid.attr]
---@field friction? number|rapid.Attribute|fun(frame: rapid.Frame): number  Coulomb's coefficient [number, at least 0, default 0, takes rapid.attr]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  of the points; the attribute pscale, where that is 0 the radius of contact, else 0 [number, m, at least 0, takes rapid.attr]
---@field method? "continuous"|"backtrack"|"project"|fun(frame: rapid.Frame): "continuous"|"backtrack"|"project"  on the path, at the time of impact; or after the step, by going back or out along the gradient [string, one of continuous, backtrack, project, default "continuous"]
---@field response? "bounce"|"slide"|"stick"|"die"|fun(frame: rapid.Frame): "bounce"|"slide"|"stick"|"die"  slide: without bounce; stick: held by the shape; die: killed [string, one of bounce, slide, stick, die, default "bounce"]
---@field adhesion? number|rapid.Attribute|fun(frame: rapid.Frame): number  what it takes to tear a point off that sticks or slides; where not given, no pull is enough for one that sticks, and any for one that slides [number, m/s², at least 0, takes rapid.attr]
---@field viscosity? number|rapid.Attribute|fun(frame: rapid.Frame): number  at which the surface slows what slides on it [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field record? number|boolean|fun(frame: rapid.Frame): number|boolean  writes contacts at least as fast to the hit attributes: hittotal, hitnum, hitpos, hitnml, hitv, hittime, hitimpulse, hitpath [false or number, m/s, at least 0, default false]
---@field name? string  what the node is called in messages [string]

---Keeps points out of a shape: they bounce, slide and come to rest on it.
---@param params rapid.params.collide
---@return rapid.Node
function Node:collide(params) end

---@class rapid.params.color_by_speed
---@field fast? rapid.Place|fun(frame: rapid.Frame): rapid.Place  colour at high and above, linear RGB [vec3, at least 0, default {1, 0.9, 0.6}]
---@field high? number|fun(frame: rapid.Frame): number  another speed [number, m/s, at least 0, default 5]
---@field low? number|fun(frame: rapid.Frame): number  a speed [number, m/s, at least 0, default 0]
---@field slow? rapid.Place|fun(frame: rapid.Frame): rapid.Place  colour at low and below, linear RGB [vec3, at least 0, default {0.1, 0.2, 0.9}]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Colours points by their speed.
---@param params? rapid.params.color_by_speed
---@return rapid.Node
function Node:color_by_speed(params) end

---@class rapid.params.contact
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  of the points; the attribute pscale where they have it, else 0 [number, m, at least 0, takes rapid.attr]
---@field bounce? number|rapid.Attribute|fun(frame: rapid.Frame): number  restitution; of two points that differ the larger [number, from 0 to 1, default 0, takes rapid.attr]
---@field friction? number|rapid.Attribute|fun(frame: rapid.Frame): number  Coulomb's coefficient; of two points that differ the geometric mean [number, at least 0, default 0, takes rapid.attr]
---@field max_difference? number|fun(frame: rapid.Frame): number  of the radii in one grid; where not given, half of the largest in it [number, m, at least 0]
---@field max_grids? integer|fun(frame: rapid.Frame): integer  the most grids for different radii [integer, from 1 to 254, default 8]
---@field mass_scaling? number|fun(frame: rapid.Frame): number  a point counts as e^mass_scaling times lighter than what it stands on, against gravity: tall stacks hold with few sub-steps, and flow less [number, from 0 to 4, default 0]
---@field record? boolean  writes the forces of contacts, with points and shapes, to the attributes normalforce and frictionforce (N, means over the frame) and contactnum [boolean, default false]
---@field spin? boolean  friction turns points, as solid spheres, by the attributes w (rad/s) and orient [boolean, default false]
---@field rolling? number|rapid.Attribute|fun(frame: rapid.Frame): number  with spin: coefficient of rolling friction, a torque of at most rolling times the normal force and the radius; of two points the geometric mean [number, at least 0, default 0, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Points collide with each other, as spheres: sand, rubble, balls.
---@param params? rapid.params.contact
---@return rapid.Node
function Node:contact(params) end

---@class rapid.params.create
---@field fps? number  frames a second [number, 1/s, above 0, default 24]
---@field start? integer  first frame: the initial state, at time 0 [integer, default 1]
---@field seed? integer  of all random numbers of this simulation [integer, at least 0, default 0]
---@field subframes? integer  times a frame that the whole graph is evaluated, scripts, emitters and colliders included; not the solver's sub-steps [integer, from 1 to 10000, default 1]
---@field points? rapid.Points  initial points; their ids count from 0 [points]
---@field name? string  what the node is called in messages [string]

---Starts a simulation; yields its points as Solve left them at the frame before.
---@param params? rapid.params.create
---@return rapid.Node
function rapid.create(params) end

---@class rapid.params.curve_force
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field curve rapid.Place[]|rapid.Points|rapid.Curve|fun(frame: rapid.Frame): rapid.Place[]|rapid.Points|rapid.Curve  {{x, y, z}, ...} or points, in the order of the curve; or rapid.curve, which may move and deform: points are driven along it at its velocity [list of vec3, points, or curve, m, required]
---@field closed? boolean|fun(frame: rapid.Frame): boolean  from the last point to the first, too [boolean, default false]
---@field speed? number|rapid.Attribute|fun(frame: rapid.Frame): number  along the curve; below 0: backwards [number, m/s, default 1, takes rapid.attr]
---@field pull? number|rapid.Attribute|fun(frame: rapid.Frame): number  towards the curve, a metre of distance [number, 1/s², at least 0, default 10, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  the rate at which points come to the speed [number, 1/s, at least 0, default 3, takes rapid.attr]
---@field radius? number|rapid.Attribute|fun(frame: rapid.Frame): number  the distance at which the force has fallen to 0; without it, it does not fall [number, m, above 0, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Draws points to a curve, and drives them along it.
---@param params rapid.params.curve_force
---@return rapid.Node
function Node:curve_force(params) end

---@class rapid.params.delete
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field where? fun(p: rapid.Point, frame: rapid.Frame): any  says of a point whether it is removed [function of a point]
---@field name? string  what the node is called in messages [string]

---Removes the points of a group, or those for which `where` is true.
---@param params? rapid.params.delete
---@return rapid.Node
function Node:delete(params) end

---@class rapid.params.detail
---@field kernel fun(p: rapid.Point, frame: rapid.Frame)  function(points, frame) [function of the points, required]
---@field name? string  what the node is called in messages [string]

---Runs a Lua function over the whole set of points, once.
---@overload fun(self: rapid.Node, name: string, kernel: fun(p: rapid.Point, frame: rapid.Frame)): rapid.Node
---@param params rapid.params.detail
---@return rapid.Node
function Node:detail(params) end

---@class rapid.params.distance
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field pairs? any[]  {{i, j}, ...}: by place, from 1, in the set that first enters the node [list]
---@field within? number  in place of pairs: all that are as near in the set that first enters the node [number, m, above 0]
---@field rest? number  the distance; where not given, that at first [number, m, at least 0]
---@field compliance? number  stretch by force; 0: rigid [number, m/N, at least 0, default 0]
---@field strain? number  breaks a pair that is longer than its distance by more than this part of it; for springs, as no load stretches a rigid pair [number, above 0]
---@field strength? number  breaks a pair that pulls with more; an impact on a collider or contact counts as a force over its sub-step, so that more sub-steps break more [number, N, above 0]
---@field name? string  what the node is called in messages [string]

---Keeps pairs of points at a distance: rods, ropes, springs.
---@param params? rapid.params.distance
---@return rapid.Node
function Node:distance(params) end

---@class rapid.params.drag
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field linear? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate of the drag that grows with the speed [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field quadratic? number|rapid.Attribute|fun(frame: rapid.Frame): number  of the drag that grows with the square of the speed [number, 1/m, at least 0, default 0, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Slows points down.
---@param params? rapid.params.drag
---@return rapid.Node
function Node:drag(params) end

---@class rapid.params.emit
---@field source rapid.Mesh|rapid.Shape|rapid.Fog|rapid.Curve|rapid.Points|fun(frame: rapid.Frame): rapid.Mesh|rapid.Shape|rapid.Fog|rapid.Curve|rapid.Points  what points are born from [mesh, level set, shape, fog, curve or points, required]
---@field from? "surface"|"volume"|"points"|fun(frame: rapid.Frame): "surface"|"volume"|"points"  where on the source; without it "points" of points, else "surface". A mesh's points are its vertices. With count or impulse points are taken in order, so that as many births as points take each once; with rate at random [string, one of surface, volume, points]
---@field density? string|fun(frame: rapid.Frame): string  an attribute of the source's points, or of a mesh's vertices: births are drawn in proportion to it [string]
---@field source_group? string  of a mesh: only its faces in this group bear [string]
---@field motion? "spline"|"linear"|"none"|fun(frame: rapid.Frame): "spline"|"linear"|"none"  the way of a moving source within a frame: a cubic through the frames around it, a straight line, or none, as if it were where it is at the frame's end, at rest [string, one of spline, linear, none, default "spline"]
---@field alpha? number|fun(frame: rapid.Frame): number  tangents of the spline, as a part of the way over two frames; a half keeps a uniform motion uniform [number, default 0.5]
---@field cut? integer[]|fun(frame: rapid.Frame): integer[]  frames to which the source jumps from the frame before: nothing is born on the way. Where it is not given, a step of 8 times those around it and half the source's size is a jump, and reported [list of frames, from -2147483647 to 2147483647]
---@field inherit_velocity? number|fun(frame: rapid.Frame): number  fraction of the source's velocity that is added [number, default 1]
---@field rate? number|fun(frame: rapid.Frame): number  points born a second [number, 1/s, at least 0]
---@field count? integer|fun(frame: rapid.Frame): integer  points born a frame [integer, at least 0]
---@field impulse? table<integer, number>|fun(frame: rapid.Frame): table<integer, number>  points born in single frames, {[frame] = count}; at the first frame they have not moved yet [numbers by frame, from 0 to 2147483647]
---@field age? number|number[]|rapid.Attribute|fun(frame: rapid.Frame): number|number[]|rapid.Attribute  age at the end of the frame of birth, instead of `birth`; a number, {min, max}, or the source's own attribute, rapid.attr [number, {min, max} or rapid.attr, s, at least 0]
---@field birth? "random"|"begin"|"end"|"even"  at the beginning of the frame's interval, its end, at random, or evenly spaced; or a function(p, frame) that edits each newborn point once, which is born at random [moment or function of a point, one of random, begin, end, even, default "random"]
---@field velocity? rapid.Place|fun(frame: rapid.Frame): rapid.Place  mean direction and size [vec3, m/s, default {0, 0, 0}]
---@field speed? number|number[]|fun(frame: rapid.Frame): number|number[]  along the source's normal N, added to velocity; a number or {min, max} [number or {min, max}, m/s, default 0]
---@field spread? number|fun(frame: rapid.Frame): number  turns velocity and speed together, uniformly in a cone of this half angle [number, deg, from 0 to 180, default 0]
---@field life? number|number[]|fun(frame: rapid.Frame): number|number[]  age at which points die: a number or {min, max}; without it they live for ever [number or {min, max}, s, at least 0]
---@field group? string  the newborn join this group [string]
---@field attributes? table<string, number|rapid.Vec3|string|any[]>|fun(frame: rapid.Frame): table<string, number|rapid.Vec3|string|any[]>  values of the newborn, {heat = 1, Cd = {1, 0.5, 0}}; at random between two, {heat = {1, 2}}, or on a ramp, {Cd = {{0, {1, 0, 0}}, {1, {1, 1, 0}}}}; they replace inherited values [attributes]
---@field name? string  what the node is called in messages [string]

---Bears points from a surface, in a volume, along a curve or at points.
---@param params rapid.params.emit
---@return rapid.Node
function Node:emit(params) end

---@class rapid.params.fade_by_age
---@field attribute? string  a float [name of an attribute, default "pscale"]
---@field first? number|fun(frame: rapid.Frame): number  its value at birth [number, default 1]
---@field hold? number|fun(frame: rapid.Frame): number  part of the life before the fade begins [number, from 0 to 0.999, default 0]
---@field last? number|fun(frame: rapid.Frame): number  its value at death [number, default 0]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Fades an attribute over the life of each point.
---@param params? rapid.params.fade_by_age
---@return rapid.Node
function Node:fade_by_age(params) end

---@class rapid.params.field
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field grid rapid.Grid|fun(frame: rapid.Frame): rapid.Grid  of vectors, by rapid.grid; also a sequence [vector grid, required]
---@field mode? "force"|"velocity"|fun(frame: rapid.Frame): "force"|"velocity"  what the vectors are: forces (N), or velocities (m/s) that points are drawn to [string, one of force, velocity, default "force"]
---@field strength? number|rapid.Attribute|fun(frame: rapid.Frame): number  the vectors are multiplied by it [number, default 1, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  with velocities, the rate at which points come to them; 1 when not given [number, 1/s, at least 0, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Moves points by a grid of vectors: a force, or the velocity of a flow.
---@param params rapid.params.field
---@return rapid.Node
function Node:field(params) end

---@class rapid.params.follow_curve
---@field duration? number|fun(frame: rapid.Frame): number  from the first to the last, each span alike [number, s, at least 1e-06, default 1]
---@field points rapid.Place[]|fun(frame: rapid.Frame): rapid.Place[]  the curve goes through them, at least two [list of vec3, m, required]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Moves points along a curve.
---@param params rapid.params.follow_curve
---@return rapid.Node
function Node:follow_curve(params) end

---@class rapid.params.follow_leader
---@field distance? number|fun(frame: rapid.Frame): number  behind the leader at which the train begins [number, m, at least 0, default 0.5]
---@field leader string|fun(frame: rapid.Frame): string  the group of the leader [string, required]
---@field length? number|fun(frame: rapid.Frame): number  of the train [number, m, at least 0, default 2]
---@field response? number|fun(frame: rapid.Frame): number  time in which the difference falls to 1/e [number, s, at least 1e-06, default 0.2]
---@field speed? number|fun(frame: rapid.Frame): number  greatest [number, m/s, at least 1e-06, default 5]
---@field time? number|fun(frame: rapid.Frame): number  in which they close up [number, s, at least 1e-06, default 0.5]
---@field width? number|fun(frame: rapid.Frame): number  of the train, to each side [number, m, at least 0, default 0.5]
---@field name? string  what the node is called in messages [string]

---Has points follow one that leads them.
---@param params rapid.params.follow_leader
---@return rapid.Node
function Node:follow_leader(params) end

---@class rapid.params.goal
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field to rapid.Mesh|rapid.Shape|rapid.Points|rapid.Attribute|fun(frame: rapid.Frame): rapid.Mesh|rapid.Shape|rapid.Points|rapid.Attribute  a mesh, a shape or points, at rest or moving; or rapid.attr "NAME", a vec3 of each point's own [mesh, shape, points or rapid.attr, required]
---@field by? "id"|"nearest"|"random"  which place a point gets: by its id (a point's, or a mesh's vertex), at random, or the nearest: of points one that is free [string, one of id, nearest, random, default "id"]
---@field start? number|fun(frame: rapid.Frame): number  when the way begins [number, s, default 0]
---@field time? number|fun(frame: rapid.Frame): number  that each point takes [number, s, at least 1e-06, default 1]
---@field stagger? number|fun(frame: rapid.Frame): number  each begins by up to this later, at random [number, s, at least 0, default 0]
---@field clock? "scene"|"age"  what start is counted by [string, one of scene, age, default "scene"]
---@field hold? boolean|fun(frame: rapid.Frame): boolean  points stay at their places afterwards [boolean, default true]
---@field name? string  what the node is called in messages [string]

---Takes points to places of their own in a given time.
---@param params rapid.params.goal
---@return rapid.Node
function Node:goal(params) end

---@class rapid.params.gravity
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field g? rapid.Place|fun(frame: rapid.Frame): rapid.Place  acceleration [vec3, m/s², default {0, -9.81, 0}]
---@field name? string  what the node is called in messages [string]

---Accelerates all points alike.
---@param params? rapid.params.gravity
---@return rapid.Node
function Node:gravity(params) end

---@class rapid.params.group
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field name string  name of the group that is made [string, required]
---@field where? fun(p: rapid.Point, frame: rapid.Frame): any  says of a point whether it is in the group; without it all points are [function of a point]

---Puts the points for which `where` is true into a group, in each frame.
---@param params rapid.params.group
---@return rapid.Node
function Node:group(params) end

---@class rapid.params.group_by_bounds
---@field into string  the group [name of a group, required]
---@field max? rapid.Place|fun(frame: rapid.Frame): rapid.Place  greatest corner of the box [vec3, m, default {1, 1, 1}]
---@field min? rapid.Place|fun(frame: rapid.Frame): rapid.Place  least corner of the box; on its faces is in it [vec3, m, default {-1, -1, -1}]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Puts the points in a box into a group, and takes the others out of it.
---@param params rapid.params.group_by_bounds
---@return rapid.Node
function Node:group_by_bounds(params) end

---@class rapid.params.group_by_shape
---@field distance? number|fun(frame: rapid.Frame): number  how far from the surface is in; negative is deep inside [number, m, default 0]
---@field into string  the group [name of a group, required]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  a shape or a level set [shape at rest or moving, required]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Puts the points in or near a shape into a group, and takes the others out of it.
---@param params rapid.params.group_by_shape
---@return rapid.Node
function Node:group_by_shape(params) end

---@class rapid.params.impact_spin
---@field grip? number|fun(frame: rapid.Frame): number  part of the way to rolling at each contact [number, from 0 to 1, default 1]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Sets points turning that have hit a shape.
---@param params? rapid.params.impact_spin
---@return rapid.Node
function Node:impact_spin(params) end

---@class rapid.params.interact
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field radius number|fun(frame: rapid.Frame): number  within which points are neighbours [number, m, above 0, required]
---@field separation? number|rapid.Attribute|fun(frame: rapid.Frame): number  drives them apart, most where they touch [number, m/s², at least 0, default 0, takes rapid.attr]
---@field cohesion? number|rapid.Attribute|fun(frame: rapid.Frame): number  draws them together, most at half the radius [number, m/s², at least 0, default 0, takes rapid.attr]
---@field alignment? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which their velocities become equal [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  rate at which they stop approaching and parting; what turns about them goes on [number, 1/s, at least 0, default 0, takes rapid.attr]
---@field avoidance? number|rapid.Attribute|fun(frame: rapid.Frame): number  turns them aside from those that they would come too near to [number, m/s², at least 0, default 0, takes rapid.attr]
---@field foresight? number|fun(frame: rapid.Frame): number  how far ahead they look for that [number, s, above 0, default 1]
---@field clearance? number|fun(frame: rapid.Frame): number  at which they pass each other; half the radius, where it is not given [number, m, above 0]
---@field view? number|fun(frame: rapid.Frame): number  the angle about their velocity within which they see others [number, deg, from 0 to 360, default 360]
---@field most? integer|fun(frame: rapid.Frame): integer  neighbours that each heeds, the nearest of those that it sees; 0: all [integer, from 0 to 1000000000, default 0]
---@field name? string  what the node is called in messages [string]

---Moves points by their neighbours: apart, together, in step, without haste, aside.
---@param params rapid.params.interact
---@return rapid.Node
function Node:interact(params) end

---@class rapid.params.jitter
---@field strength? number|fun(frame: rapid.Frame): number  root mean square speed gained in a second [number, m/s, at least 0, default 1]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Kicks points in random directions.
---@param params? rapid.params.jitter
---@return rapid.Node
function Node:jitter(params) end

---@class rapid.params.kill_slow
---@field age? number|fun(frame: rapid.Frame): number  younger points stay [number, s, at least 0, default 0]
---@field speed? number|fun(frame: rapid.Frame): number  slower points go [number, m/s, at least 0, default 0.05]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Removes points that move too slowly.
---@param params? rapid.params.kill_slow
---@return rapid.Node
function Node:kill_slow(params) end

---@class rapid.params.lift
---@field cooling? number|fun(frame: rapid.Frame): number  time in which heat falls to 1/e [number, s, at least 0.001, default 0.5]
---@field strength? number|fun(frame: rapid.Frame): number  acceleration at a heat of 1 [number, m/s², at least 0, default 1]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Raises points by their heat, and cools them.
---@param params? rapid.params.lift
---@return rapid.Node
function Node:lift(params) end

---@class rapid.params.limit_speed
---@field max? number|fun(frame: rapid.Frame): number  greatest speed [number, m/s, at least 0, default inf]
---@field min? number|fun(frame: rapid.Frame): number  least speed of a moving point [number, m/s, at least 0, default 0]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Holds the speed of points between two bounds.
---@param params? rapid.params.limit_speed
---@return rapid.Node
function Node:limit_speed(params) end

---@class rapid.params.look_ahead
---@field clearance? number|fun(frame: rapid.Frame): number  from the surface at which they pass [number, m, at least 0, default 0.1]
---@field shape rapid.Shape|fun(frame: rapid.Frame): rapid.Shape  a shape or a level set [shape at rest or moving, required]
---@field strength? number|fun(frame: rapid.Frame): number  greatest acceleration [number, m/s², at least 0, default 20]
---@field time? number|fun(frame: rapid.Frame): number  how far ahead they see [number, s, at least 1e-06, default 1]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Turns points aside before they hit a shape.
---@param params rapid.params.look_ahead
---@return rapid.Node
function Node:look_ahead(params) end

---@class rapid.params.merge
---@field name? string  what the node is called in messages [string]

---Joins the points of several chains; what comes by several is taken once.
---@param ... rapid.Node|rapid.params.merge
---@return rapid.Node
function Node:merge(...) end

---@class rapid.params.picture
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field blend? "over"|"add"|fun(frame: rapid.Frame): "over"|"add"  "add": points shine, add their light, and cast no shadow [string, one of over, add, default "over"]
---@field shutter? number|fun(frame: rapid.Frame): number  part of the frame for which the picture is exposed: what moves leaves a streak [number, from 0 to 1, default 0]
---@field camera? rapid.Camera|table<integer, rapid.Camera>|fun(frame: rapid.Frame): rapid.Camera|table<integer, rapid.Camera>  rapid.camera, a function of the frame that returns one, or keys; without it, fitted to the scene [camera]
---@field emitters? boolean|fun(frame: rapid.Frame): boolean  whether shapes that bear points are shown [boolean, default true]
---@field colliders? boolean|fun(frame: rapid.Frame): boolean  whether colliders and planes are shown [boolean, default true]
---@field grid? boolean|fun(frame: rapid.Frame): boolean  whether lines are drawn on the ground, unless a plane is the ground [boolean, default true]
---@field name? string  what the node is called in messages [string]

---Says how points look in pictures; they stay as they are.
---@param params? rapid.params.picture
---@return rapid.Node
function Node:picture(params) end

---@class rapid.params.pin
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field target? rapid.Place|rapid.Attribute|rapid.Shape|fun(frame: rapid.Frame): rapid.Place|rapid.Attribute|rapid.Shape  a place, rapid.attr "NAME" for each point's own, or a shape or mesh that moves or deforms, and carries them; where not given, where each point is first pinned [vec3, attribute or moving shape, m]
---@field transform? rapid.Motion|fun(frame: rapid.Frame): rapid.Motion  carries the points: a motion, a function of the frame that returns one, or keys by frame [motion]
---@field compliance? number  give by force; 0: rigid [number, m/N, at least 0, default 0]
---@field name? string  what the node is called in messages [string]

---Holds points where they are, at a place, or on a body that moves.
---@param params? rapid.params.pin
---@return rapid.Node
function Node:pin(params) end

---@class rapid.params.points
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field kernel fun(p: rapid.Point, frame: rapid.Frame)  function(p, frame) [function of a point, required]
---@field reads? string|string[]  attributes that the kernel reads under names that it computes [names]
---@field writes? string|string[]  attributes that it assigns under names that it computes [names]
---@field name? string  what the node is called in messages [string]

---Edits the points with a Lua function, one by one, in parallel.
---@overload fun(self: rapid.Node, name: string, kernel: fun(p: rapid.Point, frame: rapid.Frame)): rapid.Node
---@param params rapid.params.points
---@return rapid.Node
function Node:points(params) end

---@class rapid.params.ramp
---@field from? string  the attribute that is looked up [name of an attribute, default "age"]
---@field keys? any[]|fun(frame: rapid.Frame): any[]  {value of from, value of to}, rising [ramp, default {{0, {1, 1, 1}}, {1, {0, 0, 0}}}]
---@field to? string  the attribute that is written [name of an attribute, default "Cd"]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Draws an attribute from another by way of keys.
---@param params? rapid.params.ramp
---@return rapid.Node
function Node:ramp(params) end

---@class rapid.params.randomize
---@field attribute? string  a float [name of an attribute, default "pscale"]
---@field bias? number|fun(frame: rapid.Frame): number  1: all values alike [number, at least 0.001, default 1]
---@field max? number|fun(frame: rapid.Frame): number  greatest value [number, default 1]
---@field min? number|fun(frame: rapid.Frame): number  least value [number, default 0]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Gives each point its own random value of an attribute.
---@param params? rapid.params.randomize
---@return rapid.Node
function Node:randomize(params) end

---@class rapid.params.rasterize
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field file string  pattern of the .vdb file: #### is the frame; it has the grid density, and one for each attribute [string, required]
---@field voxel? number  edge of a voxel [number, m, at least 2e-05, default 0.1]
---@field radius? number|rapid.Attribute  over which a point is spread, at least a voxel; 1.5 voxels when not given [number, m, above 0, takes rapid.attr]
---@field weight? number|rapid.Attribute  what a point counts: the sum of density times volume is that of the weights [number, at least 0, default 1, takes rapid.attr]
---@field attributes? string|string[]  vectors of which a grid has the mean of the points around, by their weights; {"v"} when not given [names]
---@field name? string  what the node is called in messages [string]

---Writes the points as they are here as volumes, and passes them on.
---@param params rapid.params.rasterize
---@return rapid.Node
function Node:rasterize(params) end

---@class rapid.params.solve
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field substeps? integer|fun(frame: rapid.Frame): integer  steps a frame [integer, from 1 to 1048576, default 1]
---@field iterations? integer|fun(frame: rapid.Frame): integer  of the constraints, a sub-step [integer, from 1 to 10000, default 1]
---@field sleep? number|fun(frame: rapid.Frame): number  at rest, after which points with constraints sleep until something acts on them; math.huge: never [number, s, above 0, default 0.25]
---@field tolerance? number|fun(frame: rapid.Frame): number  each point takes as many sub-steps, twice as many and so on, as its own estimated error needs [number, m a frame, above 0]
---@field max_substeps? integer|fun(frame: rapid.Frame): integer  the most, with a tolerance [integer, from 1 to 1048576, default 64]
---@field name? string  what the node is called in messages [string]

---Advances the points by one frame: forces, motion, collision.
---@param params? rapid.params.solve
---@return rapid.Node
function Node:solve(params) end

---@class rapid.params.spawn
---@field from rapid.Node  the node whose points are parents [node, required]
---@field source_group? string  only parents in this group bear [string]
---@field on? string|fun(p: rapid.Point, frame: rapid.Frame): any  births at an event, count of each (1), not all the time: "hit", "death", "birth", when a comparison of an attribute with a number ("age > 0.5", "P.y < 0") begins to hold, or a function of a point begins to be true [event or function of a point]
---@field min_speed? number|fun(frame: rapid.Frame): number  with on = "hit": the least speed of approach [number, m/s, at least 0]
---@field rate? number|rapid.Attribute|fun(frame: rapid.Frame): number|rapid.Attribute  points born a second by each parent [number or rapid.attr, 1/s, at least 0]
---@field count? integer|rapid.Attribute|fun(frame: rapid.Frame): integer|rapid.Attribute  points born by each parent, a frame or an event [integer or rapid.attr, at least 0]
---@field limit? number|fun(frame: rapid.Frame): number  the most births of one parent [number, at least 0]
---@field birth? "random"|"begin"|"end"|"even"  at the beginning of the frame's interval, its end, at random, or evenly spaced; or a function(p, frame) that edits each newborn point once, which is born at random [moment or function of a point, one of random, begin, end, even, default "random"]
---@field velocity? rapid.Place|fun(frame: rapid.Frame): rapid.Place  mean direction and size [vec3, m/s, default {0, 0, 0}]
---@field speed? number|number[]|fun(frame: rapid.Frame): number|number[]  along N: the normal at a hit, else the parent's attribute, else its way, added to velocity; a number or {min, max} [number or {min, max}, m/s, default 0]
---@field spread? number|fun(frame: rapid.Frame): number  turns velocity and speed together, uniformly in a cone of this half angle [number, deg, from 0 to 180, default 0]
---@field life? number|number[]|fun(frame: rapid.Frame): number|number[]  age at which points die: a number or {min, max}; without it they live for ever [number or {min, max}, s, at least 0]
---@field group? string  the newborn join this group [string]
---@field attributes? table<string, number|rapid.Vec3|string|any[]>|fun(frame: rapid.Frame): table<string, number|rapid.Vec3|string|any[]>  values of the newborn, {heat = 1, Cd = {1, 0.5, 0}}; at random between two, {heat = {1, 2}}, or on a ramp, {Cd = {{0, {1, 0, 0}}, {1, {1, 1, 0}}}}; they replace inherited values [attributes]
---@field inherit? string|string[]|fun(frame: rapid.Frame): string|string[]  names of attributes that the newborn have of their parents [names]
---@field inherit_velocity? number|fun(frame: rapid.Frame): number  fraction of the parent's velocity at the birth that is added [number, default 1]
---@field split? boolean|fun(frame: rapid.Frame): boolean  those that are born together share the parent's mass and volume [boolean, default false]
---@field kill_parent? boolean|fun(frame: rapid.Frame): boolean  with on: a point that has borne is removed [boolean, default false]
---@field name? string  what the node is called in messages [string]

---Bears points from those of another node, all the time or at events.
---@param params rapid.params.spawn
---@return rapid.Node
function Node:spawn(params) end

---@class rapid.params.spin
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  of the world, any length but zero [vec3, default {0, 1, 0}]
---@field rate? number|fun(frame: rapid.Frame): number  how fast [number, deg/s, default 360]
---@field variation? number|fun(frame: rapid.Frame): number  part of the rate by which points differ from it [number, at least 0, default 0]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Turns orient about an axis.
---@param params? rapid.params.spin
---@return rapid.Node
function Node:spin(params) end

---@class rapid.params.spring
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field target? rapid.Place|rapid.Attribute|rapid.Shape|fun(frame: rapid.Frame): rapid.Place|rapid.Attribute|rapid.Shape  a place, rapid.attr "NAME" for each point's own, or a shape [vec3, attribute or shape at rest or moving, m, default {0, 0, 0}]
---@field stiffness? number|rapid.Attribute|fun(frame: rapid.Frame): number  force a metre [number, N/m, at least 0, default 1, takes rapid.attr]
---@field damping? number|rapid.Attribute|fun(frame: rapid.Frame): number  force by speed [number, N s/m, at least 0, default 0, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Holds points with a spring to a place or to a shape.
---@param params? rapid.params.spring
---@return rapid.Node
function Node:spring(params) end

---@class rapid.params.swirl
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  axis of rotation, any length but zero [vec3, default {0, 1, 0}]
---@field center? rapid.Place|fun(frame: rapid.Frame): rapid.Place  a place on the axis [vec3, m, default {0, 0, 0}]
---@field strength? number|fun(frame: rapid.Frame): number  acceleration at 1 m from the axis [number, 1/s², default 1]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Turns points about an axis.
---@param params? rapid.params.swirl
---@return rapid.Node
function Node:swirl(params) end

---@class rapid.params.torque
---@field inertia? number|fun(frame: rapid.Frame): number  moment of inertia; 0: of a solid sphere [number, kg m², at least 0, default 0]
---@field torque? rapid.Place|fun(frame: rapid.Frame): rapid.Place  about its own direction [vec3, N m, default {0, 0, 0}]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Speeds up the turning of points.
---@param params? rapid.params.torque
---@return rapid.Node
function Node:torque(params) end

---@class rapid.params.trail
---@field places? integer  frames that a trail is long [integer, from 1 to 256, default 12]
---@field name? string  what the node is called in messages [string]

---Keeps the last places of each point: trail1 is that of a frame ago, and so on.
---@param params? rapid.params.trail
---@return rapid.Node
function Node:trail(params) end

---@class rapid.params.transfer
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field source rapid.Mesh  at rest, moving or deforming [mesh, required]
---@field attributes? string|string[]  names of the mesh's attributes, of vertices, corners or faces; all of them where none are given [names]
---@field distance? number|fun(frame: rapid.Frame): number  points that are farther away keep what they have [number, m, at least 0, default inf]
---@field name? string  what the node is called in messages [string]

---Gives points the attributes of the nearest place of a mesh.
---@param params rapid.params.transfer
---@return rapid.Node
function Node:transfer(params) end

---@class rapid.params.tumble
---@field drag? number|fun(frame: rapid.Frame): number  rate at which w falls [number, 1/s, at least 0, default 0]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Turns orient by each point's own angular velocity w.
---@param params? rapid.params.tumble
---@return rapid.Node
function Node:tumble(params) end

---@class rapid.params.turbulence
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field amplitude? number|rapid.Attribute|fun(frame: rapid.Frame): number  root mean square acceleration [number, m/s², default 1, takes rapid.attr]
---@field size? number|fun(frame: rapid.Frame): number  of the largest swirls [number, m, above 0, default 1]
---@field speed? number|fun(frame: rapid.Frame): number  how fast the field changes [number, 1/s, at least 0, default 0]
---@field octaves? integer|fun(frame: rapid.Frame): integer  each with swirls half as large and half as strong [integer, from 1 to 16, default 3]
---@field seed? integer|fun(frame: rapid.Frame): integer  of the field [integer, at least 0, default 0]
---@field name? string  what the node is called in messages [string]

---Pushes points along the swirls of a random field.
---@param params? rapid.params.turbulence
---@return rapid.Node
function Node:turbulence(params) end

---@class rapid.params.vortex
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field center? rapid.Place|rapid.Attribute|fun(frame: rapid.Frame): rapid.Place  a place on the axis [vec3, m, default {0, 0, 0}, takes rapid.attr]
---@field axis? rapid.Place|fun(frame: rapid.Frame): rapid.Place  its direction, any length but zero [vec3, default {0, 1, 0}]
---@field strength? number|rapid.Attribute|fun(frame: rapid.Frame): number  acceleration, counterclockwise [number, m/s², default 1, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Drives points around an axis.
---@param params? rapid.params.vortex
---@return rapid.Node
function Node:vortex(params) end

---@class rapid.params.wander
---@field change? number|fun(frame: rapid.Frame): number  how often in a second it becomes another [number, 1/s, at least 0, default 0.5]
---@field octaves? integer|fun(frame: rapid.Frame): integer  sizes of eddies, each half the one before [integer, from 1 to 16, default 2]
---@field response? number|fun(frame: rapid.Frame): number  time in which the difference falls to 1/e [number, s, at least 1e-06, default 0.2]
---@field seed? integer|fun(frame: rapid.Frame): integer  chooses the flow [integer, at least 0, default 0]
---@field size? number|fun(frame: rapid.Frame): number  of its largest eddies [number, m, at least 1e-06, default 1]
---@field speed? number|fun(frame: rapid.Frame): number  root mean square speed of the flow [number, m/s, at least 0, default 1]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Carries points along a turbulent flow.
---@param params? rapid.params.wander
---@return rapid.Node
function Node:wander(params) end

---@class rapid.params.wind
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field velocity? rapid.Place|rapid.Attribute|fun(frame: rapid.Frame): rapid.Place  of the air [vec3, m/s, default {0, 0, 0}, takes rapid.attr]
---@field drag? number|rapid.Attribute|fun(frame: rapid.Frame): number  the rate at which points come to its velocity [number, 1/s, at least 0, default 1, takes rapid.attr]
---@field name? string  what the node is called in messages [string]

---Takes points along with the air.
---@param params? rapid.params.wind
---@return rapid.Node
function Node:wind(params) end

---@class rapid.params.wrap
---@field max? rapid.Place|fun(frame: rapid.Frame): rapid.Place  greatest corner of the box, above min on each axis [vec3, m, default {1, 1, 1}]
---@field min? rapid.Place|fun(frame: rapid.Frame): rapid.Place  least corner of the box [vec3, m, default {-1, -1, -1}]
---@field group? string  acts on this group only [string]
---@field name? string  what the node is called in messages [string]

---Brings points that leave a box back on its other side.
---@param params? rapid.params.wrap
---@return rapid.Node
function Node:wrap(params) end

---@class rapid.params.write
---@field group? string|fun(frame: rapid.Frame): string  acts on this group only [string]
---@field file string|fun(frame: rapid.Frame): string  pattern of the file: #### is the frame [string, required]
---@field attributes? string|string[]  those that are written besides P, v and id; without it all are [names]
---@field name? string  what the node is called in messages [string]

---Writes the points as they are here, and passes them on.
---@param params rapid.params.write
---@return rapid.Node
function Node:write(params) end

return rapid
