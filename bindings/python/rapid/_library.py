"""The C interface (rapid/rapid.h) by ctypes: the library, its structs, and its errors as exceptions."""
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
    """A str for the library, for which a text ends at a character 0."""
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is a {type(text).__name__}; it must be a str")
    if "\0" in text:
        raise ValueError(f"{text!r} holds a character 0")
    return text.encode()


class _Text(c_char_p):
    """An argument of bytes, or None."""

    @classmethod
    def from_param(cls, value):
        if isinstance(value, bytes) and 0 in value:
            raise ValueError(f"{value!r} holds a character 0")
        return c_char_p.from_param(value)


def _whole(c_type):
    """An argument of a type of integer, and a function that converts to that. ctypes would take a number modulo 2^64."""
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
    _fields_ = [("size", c_size_t), ("settings", POINTER(Setting)), ("setting_count", c_size_t),
                ("seed", POINTER(c_uint64)), ("paths", POINTER(c_char_p)), ("path_count", c_size_t),
                ("threads", c_int), ("script_seconds", c_double), ("script_memory", c_uint64), ("memory", c_uint64),
                ("no_errors", c_int), ("keep_all", c_int), ("user", c_void_p), ("log", Log), ("progress", Progress),
                ("find_module", Find), ("find_file", Find), ("offers", c_void_p)]


class Parameter(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("doc", c_char_p), ("value", Value), ("fallback", Value)]


class Node(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("type", c_char_p), ("file", c_char_p), ("line", c_int)]


class Column(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("name", c_char_p), ("type", c_int), ("count", c_size_t),
                ("components", c_size_t), ("stride", c_size_t), ("data", c_void_p)]


class FrameInfo(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("number", c_int64), ("time", c_double), ("fps", c_double), ("points", c_size_t),
                ("born", c_uint64), ("died", c_uint64), ("collisions", c_uint64), ("substeps", c_int),
                ("has_errors", c_int), ("error_p50", c_double), ("error_p95", c_double), ("error_max", c_double),
                ("penetration_max", c_double), ("constraint_residual_max", c_double), ("seconds", c_double),
                ("script_seconds", c_double), ("solve_seconds", c_double)]


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
    """RAPID_LIBRARY; else beside the installed package (PREFIX/lib/python3/dist-packages/rapid); else of a checkout's
    builds the newest; else where the system's loader looks."""
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
    raise ImportError(f"{name} is neither beside the module nor known to the system; set RAPID_LIBRARY to its path")


library = _load()

_texts = ["message", "file", "node", "text", "stack"]
for _text in _texts:
    getattr(library, f"rapid_error_{_text}").restype = c_char_p
    getattr(library, f"rapid_error_{_text}").argtypes = [c_void_p]
library.rapid_error_line.argtypes = library.rapid_error_free.argtypes = [c_void_p]
library.rapid_error_free.restype = None
library.rapid_version.restype = c_char_p

_handle = POINTER(c_void_p)
_text = POINTER(c_char_p)
for _name, _types in {
        "load_plugin": [_Text],
        "scene_open": [_Text, POINTER(Options), _handle],
        "scene_open_text": [_Text, _Text, POINTER(Options), _handle],
        "scene_close": [c_void_p],
        "scene_parameter_count": [c_void_p, POINTER(c_size_t)],
        "scene_parameter": [c_void_p, Size, POINTER(Parameter)],
        "scene_set": [c_void_p, POINTER(Setting), Size],
        "scene_node_count": [c_void_p, POINTER(c_size_t)],
        "scene_node": [c_void_p, Size, POINTER(Node)],
        "scene_node_types": [c_void_p, _text],
        "scene_warnings": [c_void_p, _text],
        "scene_first_frame": [c_void_p, POINTER(c_int64)],
        "scene_next_frame": [c_void_p, POINTER(c_int64)],
        "scene_advance": [c_void_p, _handle],
        "scene_advance_to": [c_void_p, Int64, _handle],
        "scene_restart": [c_void_p],
        "scene_cancel": [c_void_p],
        "scene_save": [c_void_p, _handle],
        "scene_restore": [c_void_p, c_void_p],
        "snapshot_frame": [c_void_p, POINTER(c_int64)],
        "snapshot_bytes": [c_void_p, POINTER(c_uint64)],
        "snapshot_write": [c_void_p, _Text],
        "snapshot_read": [_Text, _handle],
        "snapshot_release": [c_void_p],
        "frame_output": [c_void_p, _Text, _handle],
        "frame_names": [c_void_p, Int, _text],
        "frame_get_info": [c_void_p, POINTER(FrameInfo)],
        "frame_statistics": [c_void_p, _text],
        "frame_profile": [c_void_p, _text],
        "frame_column": [c_void_p, _Text, POINTER(Column)],
        "frame_group": [c_void_p, _Text, POINTER(Column)],
        "frame_expanded": [c_void_p, _Text, POINTER(Column)],
        "token_text": [UInt32, _text],
        "text_token": [_Text, POINTER(c_uint32)],
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
        "scene_points_behind": [c_void_p, _Text, Int64, _handle],
        "scene_graph": [c_void_p, Int, _text],
        "scene_trace": [c_void_p, POINTER(c_int64), Size, _Text, Int64, Int64, _text],
        "offers_release": [c_void_p],
        "scene_picture": [c_void_p, c_void_p, Int, Int, POINTER(c_void_p), POINTER(c_size_t)],
        "frame_release": [c_void_p]}.items():
    getattr(library, f"rapid_{_name}").argtypes = _types + [_handle]


class Error(RuntimeError):
    """What went wrong: str() has FILE:LINE: node "NAME": MESSAGE; the parts are message, file, line, node and kind;
    stack has the calls of the script in which it was raised, the innermost first."""

    def __init__(self, kind, message, file="", line=0, node="", text=None, stack=""):
        super().__init__(text or message)
        self.stack = stack
        self.kind, self.message, self.file, self.line, self.node = kind, message, file, line, node


def call(name, *arguments):
    """Calls rapid_NAME. Raises Error, or what a callback of the call has raised."""
    fault = c_void_p()
    status = getattr(library, f"rapid_{name}")(*arguments, byref(fault))
    if status == 0:
        return
    try:
        message, file, node, text, stack = (getattr(library, f"rapid_error_{part}")(fault).decode()
                                            for part in _texts)
        raise Error(STATUS.get(status, str(status)), message, file, library.rapid_error_line(fault), node, text, stack)
    finally:
        library.rapid_error_free(fault)


def get(name, handle, result):
    """The result of a function that writes one behind its handle."""
    call(name, handle, byref(result))
    return result


def sized(struct):
    result = struct()
    result.size = ctypes.sizeof(struct)
    return result


def to_value(value, name):
    """A number, a boolean, a text or three numbers, for the library."""
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
            raise TypeError(f"{name} = {value!r}; it must be a number, a boolean, a text or three numbers")
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
    for place, (name, value) in enumerate(values.items()):
        settings[place].name, settings[place].value = encoded(name), to_value(value, name)
    return settings
