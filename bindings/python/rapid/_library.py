"""The C interface (rapid/rapid.h) through ctypes: the library, its structs, and its errors as exceptions."""
import ctypes
import ctypes.util
import operator
import os
import pathlib
from ctypes import CFUNCTYPE, POINTER, byref, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint32, c_uint64, c_void_p

NUMBER, BOOLEAN, TEXT, VEC3 = range(4)
STATUS = {1: "wrong call", 2: "wrong scene", 3: "failed frame", 4: "cancelled", 5: "too long", 6: "out of memory",
          7: "busy", 8: "unexpected"}


def encoded(text):
    """Encodes a str for the library. Raises ValueError if it contains a NUL, where C would end the string."""
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is a {type(text).__name__}; it must be a str")
    if "\0" in text:
        raise ValueError(f"{text!r} contains a NUL character")
    return text.encode()


class _Text(c_char_p):
    """An argument of bytes, or None."""

    @classmethod
    def from_param(cls, value):
        if isinstance(value, bytes) and 0 in value:
            raise ValueError(f"{value!r} contains a NUL character")
        return c_char_p.from_param(value)


def _whole(c_type):
    """Returns an argument type for an integer type, and a function that converts to it. Both check the range: ctypes
    alone would take a number modulo 2^64."""
    bits = 8 * ctypes.sizeof(c_type)
    signed = c_type(-1).value < 0
    least, most = (-2**(bits - 1), 2**(bits - 1) - 1) if signed else (0, 2**bits - 1)

    class Whole(c_type):
        @classmethod
        def from_param(cls, value):
            return c_type(cls.checked(value))

        @staticmethod
        def checked(value):
            number = operator.index(value.value if isinstance(value, c_type) else value)
            if not least <= number <= most:
                raise OverflowError(f"{number} is out of range; it must be from {least} to {most}")
            return number
    return Whole


Int, Int64, Size, UInt32, UInt64 = map(_whole, (c_int, c_int64, c_size_t, c_uint32, c_uint64))


class Value(ctypes.Structure):
    _fields_ = [("type", c_int), ("number", c_double * 3), ("text", c_char_p)]


class Setting(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("value", Value)]


Log = CFUNCTYPE(None, c_void_p, c_int, c_char_p)
Progress = CFUNCTYPE(c_int, c_void_p, c_int64, c_int64)
Find = CFUNCTYPE(c_void_p, c_void_p, c_char_p)


class Options(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("set", POINTER(Setting)), ("set_count", c_size_t),
                ("seed", POINTER(c_uint64)), ("paths", POINTER(c_char_p)), ("path_count", c_size_t),
                ("threads", c_int), ("script_seconds", c_double), ("script_memory", c_uint64), ("memory", c_uint64),
                ("estimate_errors", c_int), ("keep_all", c_int), ("user", c_void_p), ("log", Log), ("progress", Progress),
                ("find_module", Find), ("find_file", Find), ("offers", c_void_p)]


class Parameter(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("doc", c_char_p), ("value", Value), ("fallback", Value)]


class Node(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("type", c_char_p), ("file", c_char_p), ("line", c_int)]


class Column(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("type", c_int), ("count", c_size_t),
                ("components", c_size_t), ("stride", c_size_t), ("data", c_void_p)]


class Statistics(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("points", c_uint64), ("born", c_uint64), ("died", c_uint64),
                ("collisions", c_uint64), ("substeps", c_int), ("has_errors", c_int), ("error_p50", c_double),
                ("error_p95", c_double), ("error_max", c_double), ("penetration_max", c_double),
                ("constraint_residual_max", c_double), ("seconds", c_double), ("script_seconds", c_double),
                ("solve_seconds", c_double)]


class Mesh(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("role", c_int), ("corner_count", c_size_t), ("positions", c_void_p),
                ("triangle_count", c_size_t), ("triangles", c_void_p)]


class Plane(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("normal", c_double * 3), ("offset", c_double)]


class Camera(ctypes.Structure):
    _fields_ = [("position", POINTER(c_double)), ("target", POINTER(c_double)), ("fov", c_double)]


class Frames(ctypes.Structure):
    _fields_ = [("first", c_int64), ("last", c_int64), ("step", c_int64)]


FrameDone = CFUNCTYPE(None, c_void_p, c_int64, c_uint64, c_double, c_int)
Line = CFUNCTYPE(None, c_void_p, c_char_p)


class RunOptions(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("text", c_char_p), ("frames", POINTER(Frames)), ("outputs", POINTER(c_char_p)),
                ("output_count", c_size_t), ("width", c_int), ("height", c_int), ("camera", Camera),
                ("statistics", c_char_p), ("profile", c_char_p), ("events", c_char_p), ("cache", c_char_p),
                ("cache_every", c_int64), ("cache_again", c_int), ("cache_replace", c_int), ("part", c_int),
                ("part_count", c_int), ("sample", c_double), ("user", c_void_p), ("frame", FrameDone), ("line", Line),
                ("warning", Line)]


class Outcome(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("ending", c_int), ("last_frame", c_int64), ("unwritten", c_char_p),
                ("summary", c_char_p)]


MergeProgress = CFUNCTYPE(c_int, c_void_p, c_int64, c_uint64)


class Merged(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("parts", c_size_t), ("frames", c_size_t), ("points", c_uint64)]


Distance = CFUNCTYPE(c_int, c_void_p, c_size_t, POINTER(c_double), POINTER(c_double), POINTER(c_double))
Release = CFUNCTYPE(None, c_void_p)


class Shape(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("lower", c_double * 3), ("upper", c_double * 3), ("distance", Distance),
                ("user", c_void_p), ("slope_bound", c_double), ("smallest_feature", c_double)]


class Call(ctypes.Structure):
    _fields_ = [("count", c_size_t), ("frame", c_double), ("time", c_double), ("dt", c_double),
                ("parameters", POINTER(c_double)), ("P", POINTER(c_double)), ("v", POINTER(c_double)),
                ("acceleration", POINTER(c_double)), ("reads", POINTER(POINTER(ctypes.c_float))),
                ("writes", POINTER(POINTER(ctypes.c_float))), ("kill", POINTER(ctypes.c_uint8)),
                ("id", POINTER(c_int64)), ("rods", c_void_p)]


class NodeParameter(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("doc", c_char_p), ("unit", c_char_p), ("fallback", Value)]


class NodeColumn(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("type", c_int)]


NodeCall = CFUNCTYPE(c_int, c_void_p, POINTER(Call))


class NodeType(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("doc", c_char_p), ("kind", c_int),
                ("parameters", POINTER(NodeParameter)), ("parameter_count", c_size_t), ("reads", POINTER(NodeColumn)),
                ("read_count", c_size_t), ("writes", POINTER(NodeColumn)), ("write_count", c_size_t),
                ("call", NodeCall), ("user", c_void_p)]


def _load():
    """Loads the library from RAPID_LIBRARY, or from the installed package (PREFIX/lib/python3/dist-packages/rapid), or
    from the newest build of a checkout, or from the system's search path."""
    name = "librapid_host.so"
    named = os.environ.get("RAPID_LIBRARY")
    if named:
        return ctypes.CDLL(named)
    here = pathlib.Path(__file__).resolve()
    checkout = None
    for folder in here.parents:
        for found in [folder / name] + sorted(folder.glob(f"*-linux-gnu/{name}")):
            if found.exists():
                return ctypes.CDLL(str(found))
        builds = [path for path in folder.glob(f"build/*/lib/{name}")]
        if builds:
            return ctypes.CDLL(str(max(builds, key=lambda path: path.stat().st_mtime)))
        if (folder / "CMakePresets.json").exists():
            checkout = folder
    system = ctypes.util.find_library("rapid_host")
    if system:
        return ctypes.CDLL(system)
    if checkout:
        raise ImportError(f"{name} is not built; type\n    {checkout}/rapid --version && "
                          f"cmake --build {checkout}/build/release --target rapid_host_library")
    raise ImportError(f"{name} is neither next to the module nor in the search path of the system; set RAPID_LIBRARY to its path")


library = _load()

_strings = ["message", "file", "node", "text", "script_stack"]
for _text in _strings:
    getattr(library, f"rapid_error_{_text}").restype = c_char_p
    getattr(library, f"rapid_error_{_text}").argtypes = [c_void_p]
library.rapid_error_line.argtypes = library.rapid_error_release.argtypes = [c_void_p]
library.rapid_error_release.restype = None
library.rapid_version.restype = c_char_p

# Getters, which have no error to return.
for _name, _result in {
        "scene_parameter_count": c_size_t, "scene_node_count": c_size_t, "scene_fps": c_double,
        "scene_first_frame": c_int64, "scene_next_frame": c_int64, "snapshot_frame": c_int64, "snapshot_size": c_uint64,
        "frame_number": c_int64, "frame_time": c_double, "frame_fps": c_double, "frame_size": c_size_t,
        "shapes_mesh_count": c_size_t, "shapes_plane_count": c_size_t, "shapes_has_camera": c_int,
        "run_first_frame": c_int64}.items():
    getattr(library, f"rapid_{_name}").restype = _result
    getattr(library, f"rapid_{_name}").argtypes = [c_void_p]

_handle = POINTER(c_void_p)
_text = POINTER(c_char_p)
for _name, _types in {
        "scene_load_plugin": [_Text],
        "scene_open": [_Text, POINTER(Options), _handle],
        "scene_open_text": [_Text, _Text, POINTER(Options), _handle],
        "scene_release": [c_void_p],
        "scene_parameter": [c_void_p, Size, POINTER(Parameter)],
        "scene_set": [c_void_p, POINTER(Setting), Size],
        "scene_node": [c_void_p, Size, POINTER(Node)],
        "scene_node_types": [c_void_p, _text],
        "scene_warnings": [c_void_p, _text],
        "scene_advance": [c_void_p, _handle],
        "scene_advance_to": [c_void_p, Int64, _handle],
        "scene_restart": [c_void_p],
        "scene_cancel": [c_void_p],
        "scene_save": [c_void_p, _handle],
        "scene_restore": [c_void_p, c_void_p],
        "snapshot_write": [c_void_p, _Text],
        "snapshot_read": [_Text, _handle],
        "snapshot_release": [c_void_p],
        "frame_output": [c_void_p, _Text, _handle],
        "frame_outputs": [c_void_p, _text],
        "frame_columns": [c_void_p, _text],
        "frame_groups": [c_void_p, _text],
        "frame_details": [c_void_p, _text],
        "frame_warnings": [c_void_p, _text],
        "frame_statistics": [c_void_p, POINTER(Statistics)],
        "frame_statistics_json": [c_void_p, _text],
        "frame_profile_json": [c_void_p, _text],
        "frame_indices": [c_void_p, POINTER(c_int64), Size, POINTER(c_uint32)],
        "frame_column": [c_void_p, _Text, POINTER(Column)],
        "frame_group": [c_void_p, _Text, POINTER(Column)],
        "frame_expanded": [c_void_p, _Text, POINTER(Column)],
        "frame_text_of": [UInt32, _text],
        "frame_token_of": [_Text, POINTER(c_uint32)],
        "frame_detail": [c_void_p, _Text, POINTER(Value)],
        "frame_write": [c_void_p, _Text],
        "frame_read": [_Text, _handle],
        "frame_describe": [c_void_p, _text],
        "frame_compare": [c_void_p, c_void_p, c_double, POINTER(c_int), _text],
        "offers_new": [_handle],
        "offers_on_release": [c_void_p, Release, c_void_p],
        "offers_mesh": [c_void_p, _Text, c_void_p, Size, c_void_p, Size],
        "offers_points": [c_void_p, _Text, Size, POINTER(Column), Size],
        "offers_shape": [c_void_p, _Text, POINTER(Shape)],
        "offers_node": [c_void_p, POINTER(NodeType)],
        "call_add_rod": [POINTER(Call), Int64, Int64, c_double, c_double],
        "scene_offer": [c_void_p, c_void_p],
        "scene_explain": [c_void_p, _text],
        "scene_points_after": [c_void_p, _Text, Int64, _handle],
        "scene_graph": [c_void_p, Int, _text],
        "scene_trace": [c_void_p, POINTER(c_int64), Size, _Text, Int64, Int64, _text],
        "offers_release": [c_void_p],
        "scene_picture": [c_void_p, c_void_p, Int, Int, POINTER(c_void_p), POINTER(c_size_t)],
        "frame_picture": [c_void_p, c_void_p, POINTER(Camera), Int, Int, POINTER(c_void_p), POINTER(c_size_t)],
        "frame_release": [c_void_p],
        "scene_shapes": [c_void_p, Int64, _handle],
        "shapes_mesh": [c_void_p, Size, POINTER(Mesh)],
        "shapes_plane": [c_void_p, Size, POINTER(Plane)],
        "shapes_warnings": [c_void_p, _text],
        "shapes_release": [c_void_p],
        "run_make": [_Text, POINTER(Options), POINTER(RunOptions), _handle],
        "run_prepare": [c_void_p],
        "run_frames": [c_void_p, POINTER(Frames)],
        "run_run": [c_void_p, POINTER(Outcome)],
        "run_end_after_frame": [c_void_p],
        "run_cancel": [c_void_p],
        "run_release": [c_void_p],
        "merge_files": [POINTER(c_char_p), Size, _Text, MergeProgress, c_void_p, POINTER(Merged)]}.items():
    getattr(library, f"rapid_{_name}").argtypes = _types + [_handle]


class Error(RuntimeError):
    """An error of the library. text and str() read FILE:LINE: node "NAME": MESSAGE. The attributes message, file, line
    and node hold the parts, and kind the kind of error. script_stack is the call stack of the script that raised it,
    innermost call first."""

    def __init__(self, kind, message, file="", line=0, node="", text=None, script_stack=""):
        super().__init__(text or message)
        self.text, self.script_stack = text or message, script_stack
        self.kind, self.message, self.file, self.line, self.node = kind, message, file, line, node


def call(name, *arguments):
    """Calls rapid_NAME. Raises Error, or the exception of a callback."""
    fault = c_void_p()
    status = getattr(library, f"rapid_{name}")(*arguments, byref(fault))
    if status == 0:
        return
    try:
        message, file, node, text, stack = (getattr(library, f"rapid_error_{part}")(fault).decode()
                                            for part in _strings)
        raise Error(STATUS.get(status, str(status)), message, file, library.rapid_error_line(fault), node, text, stack)
    finally:
        library.rapid_error_release(fault)


def get(name, handle, result):
    """Calls a function that writes a result after its handle, and returns the result."""
    call(name, handle, byref(result))
    return result


# For each subject, a function that fails where getters return 0: for a released handle, or a scene inside another call.
_checked = {"scene": ("scene_warnings", c_char_p), "frame": ("frame_outputs", c_char_p),
            "shapes": ("shapes_warnings", c_char_p), "run": ("run_frames", Frames)}


def value_of(name, handle):
    """Returns the value of a getter. Raises Error as call() does."""
    value = getattr(library, f"rapid_{name}")(handle)
    if not value:
        subject = name.split("_")[0]
        if subject in _checked:
            function, result = _checked[subject]
            get(function, handle, result())
        elif not library.rapid_snapshot_size(handle):
            raise Error(STATUS[1], "the snapshot is released")
    return value


def lines(name, handle):
    """Returns a list of strings, which the library returns as lines of one string."""
    text = get(name, handle, c_char_p()).value
    return text.decode().split("\n") if text else []


def strings(values, name, what):
    """Returns an array of strings for the library, and its length."""
    if isinstance(values, (str, bytes)):
        raise TypeError(f"{name} = {values!r}; it must be a list of {what}")
    return (c_char_p * len(values))(*(encoded(str(one)) for one in values)), len(values)


def sized(struct):
    result = struct()
    result.size = ctypes.sizeof(struct)
    return result


def to_value(value, name):
    """Converts a number, a boolean, a string or three numbers for the library."""
    result = Value()
    if isinstance(value, bool):
        result.type, result.number[0] = BOOLEAN, value
    elif isinstance(value, str):
        result.type, result.text = TEXT, encoded(value)
    else:
        try:
            numbers = [float(number) for number in value]
            result.type = VEC3
        except TypeError:
            try:
                numbers = [float(value)]
            except TypeError:
                numbers = []
            result.type = NUMBER
        if len(numbers) != (3 if result.type == VEC3 else 1):
            raise TypeError(f"{name} = {value!r}; it must be a number, a boolean, a string or three numbers")
        result.number[:len(numbers)] = numbers
    return result


def from_value(value):
    if value.type == TEXT:
        return value.text.decode()
    if value.type == VEC3:
        return tuple(value.number)
    return bool(value.number[0]) if value.type == BOOLEAN else value.number[0]


def to_settings(values):
    settings = (Setting * len(values))()
    for index, (name, value) in enumerate(values.items()):
        settings[index].name, settings[index].value = encoded(name), to_value(value, name)
    return settings
