"""Rapid in Python. It opens and runs scenes in Lua, and gives their points as NumPy arrays without copies.

    import rapid

    scene = rapid.Scene("first.lua", rate=5000)
    for frame in scene.run(1, 96):
        print(frame.number, frame["P"][:, 1].mean())

docs/host.md is the guide. Errors are raised as rapid.Error, with the file, line and node of the scene.
"""
import ctypes
import json
import weakref
from ctypes import byref, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint32, c_uint64, c_void_p

import numpy

from ._library import (Camera, Column, Error, Find, FrameDone, Frames, Int, Int64, Line, Log, MergeProgress, Merged,
                       Mesh as MeshStruct, Node, Options, Outcome, Parameter, Plane, Progress, RunOptions, Statistics,
                       UInt64, Value, call, encoded, from_value, get, library, lines, sized, strings, to_settings, value_of)
from ._interrupt import interruptible
from ._offers import Constraint, Edit, Force, Mesh, Points, Shape, from_numpy, make_offers

__all__ = ["Constraint", "Edit", "Error", "Force", "Frame", "Mesh", "Picture", "Points", "Run", "Scene", "Shape", "Shapes",
           "Snapshot", "from_numpy", "merge_files", "version"]


def version():
    """Returns the library's version, such as "1.0.0"."""
    return library.rapid_version().decode()


__version__ = version()

_types = [numpy.float32, numpy.float32, numpy.int32, numpy.int64, numpy.float32, numpy.uint8, numpy.uint32]
_string = 6


class _Handle:
    """An open handle of the library. It is closed by close(), or when it is garbage-collected."""

    def __init__(self, value, closer):
        self.value = value
        self._close = weakref.finalize(self, _Handle._end, closer, value)

    @staticmethod
    def _end(closer, value):
        try:
            call(closer, value)
        except Error:  # already closed explicitly
            pass

    def close(self):
        self._close()


class _Released:
    value = None


class Picture:
    """The bytes of a .png. A notebook displays them as a picture."""

    def __init__(self, png):
        self.png = png

    def _repr_png_(self):
        return self.png

    def save(self, path):
        with open(path, "wb") as file:
            file.write(self.png)


def _picture(function, *arguments):
    data, size = c_void_p(), c_size_t()
    call(function, *arguments, byref(data), byref(size))
    return Picture(ctypes.string_at(data.value, size.value))


def _camera(position, target, fov):
    def coordinates(of):
        return None if of is None else (c_double * 3)(*of)
    return Camera(coordinates(position), coordinates(target), fov or 0)


class Frame:
    """A computed frame. frame["P"] is an array that shares memory with the run. It does not change while you hold
    it."""

    def __init__(self, handle, scene):
        self._handle, self._scene = _Handle(handle, "frame_release"), scene

    number = property(lambda self: value_of("frame_number", self._handle.value))
    time = property(lambda self: value_of("frame_time", self._handle.value), doc="Seconds since the start.")
    fps = property(lambda self: value_of("frame_fps", self._handle.value))
    size = property(lambda self: value_of("frame_size", self._handle.value), doc="The number of points.")
    outputs = property(lambda self: lines("frame_outputs", self._handle.value))
    columns = property(lambda self: lines("frame_columns", self._handle.value))
    groups = property(lambda self: lines("frame_groups", self._handle.value))
    details = property(lambda self: lines("frame_details", self._handle.value))
    warnings = property(lambda self: lines("frame_warnings", self._handle.value))

    def __len__(self):
        return self.size

    def __contains__(self, name):
        return name in self.columns

    def __iter__(self):
        return iter(self.columns)

    def __getitem__(self, name):
        """Returns a column: shape (points,) for numbers, (points, 3) for vec3, (points, 4) for quaternions. It is
        read-only because the run shares it. A column of strings is copied into an array of str; categories() avoids the
        copy."""
        if name not in self.columns:
            try:
                call("frame_column", self._handle.value, name.encode(), byref(sized(Column)))
            except Error as error:
                raise KeyError(error.message) from None
        return self._array("frame_column", name)

    def column(self, name):
        return self[name]

    def expanded(self, name):
        """Returns a column with a value for each point, even if all points share one value: no stride is 0."""
        return self._array("frame_expanded", name)

    def indices(self, ids):
        """Returns the index in the columns of each id, or 2**32 - 1 if no point has that id."""
        ids = numpy.ascontiguousarray(ids, numpy.int64)
        indices = numpy.empty(len(ids), numpy.uint32)
        call("frame_indices", self._handle.value, ids.ctypes.data_as(ctypes.POINTER(c_int64)), len(ids),
             indices.ctypes.data_as(ctypes.POINTER(c_uint32)))
        return indices

    @staticmethod
    def text_of(token):
        """Returns the string of a token. Within a process, equal strings have equal tokens."""
        return get("frame_text_of", token, c_char_p()).value.decode()

    @staticmethod
    def token_of(text):
        return get("frame_token_of", encoded(text), c_uint32()).value

    def categories(self, name):
        """Returns the sorted distinct strings of a column, and for each point the index of its string in that list."""
        tokens, indices = numpy.unique(self._array("frame_column", name, strings=False), return_inverse=True)
        words = [self.text_of(int(token)) for token in tokens]
        order = sorted(range(len(words)), key=words.__getitem__)
        rank = numpy.empty(len(words), numpy.int32)
        rank[order] = numpy.arange(len(words), dtype=numpy.int32)
        return [words[k] for k in order], rank[indices]

    def group(self, name):
        """Returns a boolean for each point: true if the point is in the group."""
        return self._array("frame_group", name).view(numpy.bool_)

    def detail(self, name):
        """Returns a detail, which is a value of the whole point set: a number or a tuple of three."""
        value = Value()
        call("frame_detail", self._handle.value, name.encode(), byref(value))
        return from_value(value)

    def output(self, name):
        """Returns another output of the same frame, as a Frame."""
        handle = c_void_p()
        call("frame_output", self._handle.value, name.encode(), byref(handle))
        return Frame(handle, self._scene)

    @property
    def statistics(self):
        """The most used figures, such as frame.statistics.penetration_max."""
        return get("frame_statistics", self._handle.value, sized(Statistics))

    @property
    def statistics_json(self):
        """The statistics that `rapid run --stats` writes for a frame, as a dict."""
        return json.loads(get("frame_statistics_json", self._handle.value, c_char_p()).value)

    @property
    def profile_json(self):
        """The frame's time by stage: [{"nodes", "stage", "begin", "seconds", "points", "bytes"}], one entry per
        pass."""
        return json.loads(get("frame_profile_json", self._handle.value, c_char_p()).value)

    def write(self, path):
        """Writes the points to a file. The extension selects the format."""
        call("frame_write", self._handle.value, str(path).encode())

    @staticmethod
    def read(path):
        """Reads the points of a file. Returns a Frame with the number 0. The extension selects the format."""
        handle = c_void_p()
        call("frame_read", str(path).encode(), byref(handle))
        return Frame(handle, None)

    def describe(self):
        """Returns what `rapid info` prints: the number of points, their bounds, the range of each attribute, the
        groups."""
        return json.loads(get("frame_describe", self._handle.value, c_char_p()).value)

    def compare(self, other, tolerance=1e-6):
        """Returns the differences to another frame between points with the same id, as `rapid diff` reports them.
        ["same"] is true if all differences are within the tolerance."""
        if not isinstance(other, Frame):
            raise TypeError(f"the other frame is a {type(other).__name__}; it must be a rapid.Frame")
        text = c_char_p()
        call("frame_compare", self._handle.value, other._handle.value, tolerance, None, byref(text))
        return json.loads(text.value)

    def picture(self, shapes, position=None, target=None, fov=None, width=640, height=360):
        """Returns a Picture of the points among these Shapes. A camera value of None is chosen to fit."""
        if not isinstance(shapes, Shapes):
            raise TypeError(f"the shapes are a {type(shapes).__name__}; they must be rapid.Shapes")
        return _picture("frame_picture", self._handle.value, shapes._handle.value, byref(_camera(position, target, fov)),
                        width, height)

    def show(self, width=640, height=360):
        """Returns a Picture of the points and of the scene's shapes."""
        if self._scene is None:
            raise Error("wrong call", "the frame was read from a file, and has no scene to be shown with")
        return self._scene.picture(self, width, height)

    def release(self):
        """Frees the memory now instead of at garbage collection. Arrays that are still referenced keep theirs."""
        self._handle = _Released

    def _array(self, function, name, strings=True):
        column = sized(Column)
        call(function, self._handle.value, name.encode(), byref(column))
        if column.type == _string and strings:
            different, indices = self.categories(name)
            return numpy.array(different or [""])[indices]
        dtype = numpy.dtype(_types[column.type])
        shape = (column.count,) if column.components == 1 else (column.count, column.components)
        if column.count == 0:
            return numpy.empty(shape, dtype)
        strides = (column.stride,) if column.components == 1 else (column.stride, dtype.itemsize)
        array = numpy.asarray(_Memory(self._handle, column.data, shape, strides, dtype))
        return array


class _Memory:
    """A frame's memory as a NumPy array interface. Arrays reference it, and it references the frame."""

    def __init__(self, frame, address, shape, strides, dtype):
        self._frame = frame
        self.__array_interface__ = {"version": 3, "data": (address, True), "shape": shape, "strides": strides,
                                    "typestr": dtype.str}


class Shapes:
    """The shapes of a scene in a frame. meshes is a list of {"role", "positions", "triangles"}, whose arrays share
    memory with this object. planes is a list of {"normal", "offset"}. The role is "collider" or "emitter"."""

    def __init__(self, handle):
        self._handle = _Handle(handle, "shapes_release")

    @property
    def meshes(self):
        result = []
        for index in range(value_of("shapes_mesh_count", self._handle.value)):
            one = sized(MeshStruct)
            call("shapes_mesh", self._handle.value, index, byref(one))
            result.append({"role": ["collider", "emitter"][one.role],
                           "positions": self._array(one.positions, one.corner_count, numpy.float32),
                           "triangles": self._array(one.triangles, one.triangle_count, numpy.int32)})
        return result

    @property
    def planes(self):
        result = []
        for index in range(value_of("shapes_plane_count", self._handle.value)):
            one = sized(Plane)
            call("shapes_plane", self._handle.value, index, byref(one))
            result.append({"normal": tuple(one.normal), "offset": one.offset})
        return result

    has_camera = property(lambda self: bool(value_of("shapes_has_camera", self._handle.value)),
                          doc="True if the scene sets the camera of its pictures.")
    warnings = property(lambda self: lines("shapes_warnings", self._handle.value))

    def _array(self, address, count, dtype):
        if count == 0:
            return numpy.empty((0, 3), dtype)
        return numpy.asarray(_Memory(self._handle, address, (count, 3), (12, 4), numpy.dtype(dtype)))

    def release(self):
        """Frees the memory now instead of at garbage collection. Arrays that are still referenced keep theirs."""
        self._handle = _Released


class Snapshot:
    """The state of a scene after a frame. It determines all following frames."""

    def __init__(self, handle):
        self._handle = _Handle(handle, "snapshot_release")

    @property
    def frame(self):
        return value_of("snapshot_frame", self._handle.value)

    @property
    def size(self):
        """The size in bytes."""
        return value_of("snapshot_size", self._handle.value)

    def release(self):
        self._handle.close()

    def write(self, path):
        """Writes the snapshot to a file, for Snapshot.read()."""
        call("snapshot_write", self._handle.value, str(path).encode())

    @staticmethod
    def read(path):
        handle = c_void_p()
        call("snapshot_read", str(path).encode(), byref(handle))
        return Snapshot(handle)


def _each_once(values, parameters):
    """Merges two dicts. Raises TypeError if a name is in both."""
    for name in parameters.keys() & values.keys():
        raise TypeError(f"{name} is given twice, by name and in a dictionary; keep one of them")
    return {**values, **parameters}


class _Program:
    """The common base of Scene and Run. It holds their options and callbacks."""

    def __init__(self):
        self._raised = None  # an exception of a callback, raised when the call ends
        self._handle = None
        self._held = {}      # strings that callbacks have returned

    def _scene_options(self, set=None, seed=None, paths=(), threads=0, script_seconds=600, script_memory=1 << 30, memory=0,
                       estimate_errors=True, keep_all=False, log=None, progress=None, find_module=None, find_file=None,
                       objects=None, nodes=(), **parameters):
        """Returns the library's options. The caller releases their offers."""
        options = sized(Options)
        settings = to_settings(_each_once(set or {}, parameters))
        options.set, options.set_count = settings, len(settings)
        if seed is not None:
            options.seed = ctypes.pointer(c_uint64(UInt64.checked(seed)))
        options.paths, options.path_count = strings(paths, "paths", "folders")
        options.threads, options.script_seconds = Int.checked(threads), script_seconds
        options.script_memory, options.memory = UInt64.checked(script_memory), UInt64.checked(memory)
        options.estimate_errors, options.keep_all = bool(estimate_errors), bool(keep_all)
        if log:
            options.log = Log(self._guard(lambda _, level, line: log(line.decode()), None))
        options.progress = Progress(self._guard(lambda _, frame, last: self._go_on(progress, frame, last), 0))
        if find_module:
            options.find_module = Find(
                self._guard(lambda _, name: self._hold("module", find_module(name.decode())), None))
        if find_file:
            options.find_file = Find(self._guard(lambda _, path: self._hold("file", find_file(path.decode())), None))
        options.offers = make_offers(objects or {}, nodes, self._guard)
        return options

    def _cancel_if_open(self):
        if self._handle:
            self.cancel()

    def release(self):
        """Frees the memory now instead of at garbage collection. Frames and snapshots stay valid."""
        self._handle.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.release()

    def _call(self, name, *arguments):
        self._raised = None
        try:
            with interruptible(self._cancel_if_open):
                call(name, *arguments)
        except Error as error:
            if self._raised:
                raise self._raised from error
            raise
        if self._raised:
            raise self._raised

    def _guard(self, function, otherwise):
        """Wraps a callback: its exception is stored until the call ends, because exceptions cannot pass through C."""
        program = weakref.ref(self)

        def guarded(*arguments):
            try:
                return function(*arguments)
            except BaseException as error:  # includes KeyboardInterrupt
                program()._raised = error
                return otherwise
        return guarded

    def _go_on(self, progress, frame, last):
        return int(self._raised is None and (progress is None or progress(frame, last) is not False))

    def _hold(self, what, text):
        if text is None:
            return None
        self._held[what] = ctypes.create_string_buffer(encoded(str(text)))
        return ctypes.addressof(self._held[what])


class Scene(_Program):
    """A scene from a file. If text= is given, that string is the scene, and `file` is its name in messages.

    Parameters of the scene are keyword arguments, such as rate=5000. Use set={"solve.substeps": 4} for parameters of
    nodes, for parameters with the name of an option, and for names that are not Python identifiers.

    seed            replaces the seed of every create; it does not set a rapid.param "seed"
    paths           folders that are searched for modules
    threads         0 uses all processors
    script_seconds, script_memory, memory
                    limits in seconds and bytes
    estimate_errors False switches the error estimates off
    keep_all        True keeps attributes that nothing reads
    log             log(text) receives the output of scripts and the warnings
    progress        progress(frame, last) is called after each frame of advance_to(), which ends if it returns False
    find_module     find_module(name) returns the source of a module, or None
    find_file       find_file(path) returns the path of a file that the scene names, or None
    objects         {"floor": rapid.Shape(...)}: objects that the scene uses as rapid.host "floor". With
                    set={"collide2.shape": "host:floor"} one replaces a parameter of a node.
    nodes           more node types, each a rapid.Force, rapid.Edit or rapid.Constraint
    """

    def __init__(self, file, *, text=None, set=None, seed=None, paths=(), threads=0, script_seconds=600,
                 script_memory=1 << 30, memory=0, estimate_errors=True, keep_all=False, log=None, progress=None,
                 find_module=None, find_file=None, objects=None, nodes=(), **parameters):
        super().__init__()
        numbers = {"seed": seed, "threads": threads, "script_seconds": script_seconds, "script_memory": script_memory,
                   "memory": memory, "estimate_errors": estimate_errors, "keep_all": keep_all}
        options = self._options = self._scene_options(
            set, paths=paths, log=log, progress=progress, find_module=find_module, find_file=find_file, objects=objects,
            nodes=nodes, **numbers, **parameters)
        handle = c_void_p()
        try:
            if text is None:
                self._call("scene_open", str(file).encode(), byref(options), byref(handle))
            else:
                self._call("scene_open_text", str(file).encode(), text.encode(), byref(options), byref(handle))
        finally:
            call("offers_release", options.offers)
        self._handle = _Handle(handle, "scene_release")
        self._refuse_ambiguous(numbers, set or {})

    @staticmethod
    def load_plugin(path):
        """Loads the node types of a plugin, a library that was built with the runtime's headers. Scenes that are opened
        later can use them."""
        call("scene_load_plugin", str(path).encode())

    def _refuse_ambiguous(self, options, settings):
        """Raises TypeError if an option has the name of a parameter: the option does not set the parameter."""
        defaults = Scene.__init__.__kwdefaults__
        parameters = self.parameters
        for name, value in options.items():
            if value != defaults[name] and name in parameters and name not in settings:
                raise TypeError(f'{name} = {value!r} is an option of rapid.Scene, and the scene has a parameter '
                                f'"{name}"; set the parameter by set={{"{name}": {value!r}}}')

    @property
    def parameters(self):
        """The scene's parameters: a dict from names to {"value", "default", "doc"}."""
        result = {}
        for index in range(value_of("scene_parameter_count", self._handle.value)):
            one = sized(Parameter)
            call("scene_parameter", self._handle.value, index, byref(one))
            result[one.name.decode()] = {"value": from_value(one.value), "default": from_value(one.fallback),
                                         "doc": (one.doc or b"").decode()}
        return result

    @property
    def nodes(self):
        """The nodes as a list of {"name", "type", "file", "line"}, in the order in which the scene creates them."""
        result = []
        for index in range(value_of("scene_node_count", self._handle.value)):
            one = sized(Node)
            call("scene_node", self._handle.value, index, byref(one))
            result.append({"name": one.name.decode(), "type": one.type.decode(), "file": one.file.decode(),
                           "line": one.line})
        return result

    @property
    def node_types(self):
        """The node types by name, as `rapid nodes` describes them."""
        types = json.loads(get("scene_node_types", self._handle.value, c_char_p()).value)
        return {one.pop("name"): one for one in types}

    warnings = property(lambda self: lines("scene_warnings", self._handle.value), doc="The warnings from opening the scene.")
    fps = property(lambda self: value_of("scene_fps", self._handle.value))
    first_frame = property(lambda self: value_of("scene_first_frame", self._handle.value))
    next_frame = property(lambda self: value_of("scene_next_frame", self._handle.value))

    def set(self, values=None, /, **parameters):
        """Sets parameters, as the arguments of Scene() do, and restarts the scene."""
        settings = to_settings(_each_once(values or {}, parameters))
        self._call("scene_set", self._handle.value, settings, len(settings))

    def offer(self, name, thing):
        """Replaces or adds an object. Functions of the frame that use rapid.host "NAME" get it from the next frame on.
        All other uses get it at the next set().

        A mesh with as many positions and the same triangles as that of the frame before moves from there through the
        frame, like the last file of a sequence of meshes: points are born along its path with its velocity, and as a
        collider it sweeps points along. With other triangles it is at rest in this frame, with a warning. In a frame
        without an offer, and after restart() and set(), the last mesh is at rest; a snapshot holds the last meshes."""
        offers = make_offers({name: thing}, (), self._guard)
        try:
            self._call("scene_offer", self._handle.value, offers)
        finally:
            call("offers_release", offers)

    def advance(self):
        """Computes the next frame. Ctrl-C cancels it; the scene must then be restarted."""
        return self._frame("scene_advance")

    def advance_to(self, frame):
        """Computes all frames up to this one, and returns it."""
        return self._frame("scene_advance_to", frame)

    def run(self, first, last):
        """Yields the frames from first to last. Earlier frames are computed too."""
        if first > self.next_frame:
            self.advance_to(first - 1).release()
        elif first < self.next_frame:
            self.restart()
            if first > self.next_frame:
                self.advance_to(first - 1).release()
        while self.next_frame <= last:
            yield self.advance()

    def restart(self):
        self._call("scene_restart", self._handle.value)

    def save(self):
        """Returns a Snapshot. At least one frame must have been computed."""
        handle = c_void_p()
        self._call("scene_save", self._handle.value, byref(handle))
        return Snapshot(handle)

    def restore(self, snapshot):
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"the snapshot is a {type(snapshot).__name__}; it must be a rapid.Snapshot")
        self._call("scene_restore", self._handle.value, snapshot._handle.value)

    def explain(self):
        """Returns what the plan keeps and prunes, and why, as `rapid explain --json` reports it."""
        return json.loads(get("scene_explain", self._handle.value, c_char_p()).value)

    def points_after(self, node, frame):
        """Returns the points as they leave a node in a frame, as a Frame whose output has the node's name. Afterwards
        the scene is at its start."""
        return self._frame("scene_points_after", node.encode(), frame)

    def graph(self, form="svg"):
        """Returns the scene's graph: "dot" in Graphviz's language, "svg" as a picture, "json" as nodes and edges with
        their positions. "svg" and "json" need Graphviz's program `dot`."""
        forms = ["dot", "svg", "json"]
        if form not in forms:
            raise ValueError(f"form = {form!r}; it must be one of {', '.join(forms)}")
        text = c_char_p()
        call("scene_graph", self._handle.value, forms.index(form), byref(text))
        return json.loads(text.value) if form == "json" else text.value.decode()

    def trace(self, ids, first, last, create=None):
        """Returns the lives of points, selected by id, in the frames from first to last, as `rapid trace --json`
        reports them. create: the name of the node that creates the points. Afterwards the scene is at its start."""
        text, numbers = c_char_p(), (c_int64 * len(ids))(*(Int64.checked(one) for one in ids))
        self._call("scene_trace", self._handle.value, numbers, len(ids), create.encode() if create else None, first, last,
                   byref(text))
        return json.loads(text.value)

    def cancel(self):
        """Cancels the advance that is running in another thread, or the next one if none is running."""
        call("scene_cancel", self._handle.value)

    def _frame(self, name, *arguments):
        """Calls a function of the scene that computes a frame, and returns the frame."""
        handle = c_void_p()
        try:
            self._call(name, self._handle.value, *arguments, byref(handle))
        except BaseException:
            if handle:  # a Ctrl-C handler raised after the frame was complete
                call("frame_release", handle)
            raise
        return Frame(handle, self)

    def shapes(self, frame):
        """Returns the Shapes of a frame, which need not have been computed."""
        handle = c_void_p()
        self._call("scene_shapes", self._handle.value, frame, byref(handle))
        return Shapes(handle)

    def picture(self, frame, width=640, height=360):
        """Returns a Picture of a Frame of the scene, with the scene's shapes."""
        return _picture("scene_picture", self._handle.value, frame._handle.value, width, height)


class Run(_Program):
    """A run that writes files, as `rapid run` does. Call prepare() once, then run() once.

    outputs         file patterns, such as ["first.####.vdb"]
    frames          (first, last) or (first, last, step); the default is 48 frames from the scene's first one
    width, height   of pictures, in pixels
    position, target, fov
                    the camera of pictures; a value of None is chosen so that everything is visible
    statistics, profile, events
                    names of files to write
    cache           a folder; a later run with the same folder resumes where this one ended
    cache_every     the number of frames between snapshots in the cache
    cache_again     True computes all frames again
    cache_replace   True takes over the folder of another run
    part            (number, count): simulates one of several disjoint subsets of the points
    sample          the fraction of the points to simulate
    frame           frame(number, points, seconds, is_known) is called after each frame
    line            line(text) receives messages about files
    warning         warning(text) receives warnings

    All other arguments are those of Scene.
    """

    def __init__(self, file, outputs=(), frames=None, *, text=None, width=1280, height=720, position=None, target=None,
                 fov=None, statistics=None, profile=None, events=None, cache=None, cache_every=10, cache_again=False,
                 cache_replace=False, part=None, sample=1, frame=None, line=None, warning=None, **scene):
        super().__init__()
        options = sized(RunOptions)
        options.text = None if text is None else encoded(text)
        if frames is not None:
            options.frames = ctypes.pointer(Frames(*frames) if len(frames) == 3 else Frames(*frames, 1))
        options.outputs, options.output_count = strings(outputs, "outputs", "patterns")
        options.width, options.height = Int.checked(width), Int.checked(height)
        options.camera = _camera(position, target, fov)
        for name, path in (("statistics", statistics), ("profile", profile), ("events", events), ("cache", cache)):
            setattr(options, name, None if path is None else encoded(str(path)))
        options.cache_every, options.cache_again, options.cache_replace = cache_every, cache_again, cache_replace
        options.part, options.part_count = part or (0, 0)
        options.sample = sample
        if frame:
            options.frame = FrameDone(self._guard(lambda _, *values: frame(*values[:3], bool(values[3])), None))
        if line:
            options.line = Line(self._guard(lambda _, text: line(text.decode()), None))
        if warning:
            options.warning = Line(self._guard(lambda _, text: warning(text.decode()), None))
        of_scene = self._scene_options(**scene)
        self._options = options, of_scene
        handle = c_void_p()
        try:
            self._call("run_make", str(file).encode(), byref(of_scene), byref(options), byref(handle))
        finally:
            call("offers_release", of_scene.offers)
        self._handle = _Handle(handle, "run_release")

    def prepare(self):
        """Opens and plans the scene, and checks the names of the output files."""
        self._call("run_prepare", self._handle.value)

    first_frame = property(lambda self: value_of("run_first_frame", self._handle.value), doc="The first frame of the scene.")

    @property
    def frames(self):
        """The frames to write, as (first, last, step)."""
        frames = get("run_frames", self._handle.value, Frames())
        return frames.first, frames.last, frames.step

    def run(self):
        """Computes and writes the frames. Returns {"ending", "last_frame", "unwritten", "summary"}. The ending is
        "complete", or "ended" if end_after_frame() was called. Raises Error if a frame fails."""
        outcome = sized(Outcome)
        self._call("run_run", self._handle.value, byref(outcome))
        return {"ending": ["complete", "ended", "failed"][outcome.ending], "last_frame": outcome.last_frame,
                "unwritten": outcome.unwritten.decode().split("\n") if outcome.unwritten else [],
                "summary": outcome.summary.decode()}

    def end_after_frame(self):
        """Ends the run after the current frame, with a snapshot if there is a cache. Can be called from any thread."""
        call("run_end_after_frame", self._handle.value)

    def cancel(self):
        """Ends the run at once. Can be called from any thread."""
        call("run_cancel", self._handle.value)


def merge_files(parts, output, progress=None):
    """Merges the files of the parts of a run into the files that the whole run would have written. parts is a list of
    file patterns, in which {part} stands for every part. progress(frame, points) is called for each frame. The merge
    ends if it returns False. Returns {"parts", "frames", "points"}. No scene may run at the same time."""
    merged, raised = sized(Merged), []

    def report(_, frame, points):
        try:
            return int(progress is None or progress(frame, points) is not False)
        except BaseException as error:
            raised.append(error)
            return 0
    try:
        call("merge_files", *strings(parts, "parts", "patterns"), encoded(str(output)), MergeProgress(report), None, byref(merged))
    except Error as error:
        if raised:
            raise raised[0] from error
        raise
    return {"parts": merged.parts, "frames": merged.frames, "points": merged.points}
