"""Baked points as meshes of vertices with attributes."""
import functools

import numpy

from . import axes, compat

_COLORS = ("Cd",)


@functools.lru_cache(maxsize=4)
def _read(path, _changed, _size):
    with numpy.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def read(path):
    """Returns the columns of a file of points. The last files stay in memory, for the steps of motion blur."""
    status = path.stat()
    return _read(str(path), status.st_mtime_ns, status.st_size)


def attributes_of(columns, scale):
    """Converts the columns of a frame to Blender's space. scale: metres per unit. Returns the positions, and the other
    attributes as {name: (type, field of its values, array)}. Strings become indices; `words` has them by attribute."""
    columns, words = dict(columns), {}
    P = axes.to_blender(columns.pop("P"), scale)
    result = {}
    if "v" in columns:
        result["velocity"] = ("FLOAT_VECTOR", "vector", axes.to_blender(columns.pop("v"), scale))
    radius = columns.pop("pscale", None)
    radius = numpy.full(len(P), 0.01, numpy.float32) if radius is None else radius
    result["radius"] = ("FLOAT", "value", radius / numpy.float32(scale))
    if "orient" in columns:
        result["rotation"] = ("FLOAT_VECTOR", "vector", axes.to_euler(columns.pop("orient")))
    for name, array in columns.items():
        if array.dtype.kind == "b":
            result[name.removeprefix("group_")] = ("BOOLEAN", "value", array)
        elif array.dtype.kind == "U":
            words[name], places = numpy.unique(array, return_inverse=True)
            result[name] = ("INT", "value", places.astype(numpy.int32))
        elif array.dtype.kind in "iu":
            result[name] = ("INT", "value", _in_32_bits(array))
        elif array.ndim == 1:
            result[name] = ("FLOAT", "value", array)
        elif name in _COLORS:
            alpha = columns.get("Alpha", numpy.ones(len(P), numpy.float32))
            result[name] = ("FLOAT_COLOR", "color", numpy.column_stack([array, alpha]))
        elif name == "scale":  # along the axes of an instance
            result[name] = ("FLOAT_VECTOR", "vector", numpy.ascontiguousarray(array[:, [0, 2, 1]]))
        elif array.shape[1] == 3:
            lengths = scale if name.startswith("trail") else 1
            result[name] = ("FLOAT_VECTOR", "vector", axes.to_blender(array, lengths))
        elif array.shape[1] == 4:
            result[name] = ("FLOAT_COLOR", "color", array)
    return P, result, words


def _in_32_bits(array):
    """Blender has no wider integers. Ids beyond repeat, 2^32 births later."""
    return array.astype(numpy.int64).astype(numpy.uint32).view(numpy.int32)


def fill(mesh, columns, scale, seconds=0.0):
    """Writes points to a mesh. seconds: the time by which they are moved along their velocities."""
    P, attributes, words = attributes_of(columns, scale)
    if seconds and "velocity" in attributes:
        P = P + attributes["velocity"][2] * numpy.float32(seconds)
    present = {one.name: one.data_type for one in mesh.attributes if compat.is_own_attribute(one)}
    wanted = {name: kind for name, (kind, *_) in attributes.items()}
    if len(mesh.vertices) != len(P) or len(mesh.edges) or present != wanted:
        mesh.clear_geometry()
        mesh.vertices.add(len(P))
    mesh.vertices.foreach_set("co", P.ravel())
    for name, (kind, field, array) in attributes.items():
        one = mesh.attributes.get(name) or mesh.attributes.new(name, kind, "POINT")
        one.data.foreach_set(field, numpy.ascontiguousarray(array).ravel())
    for name, strings in words.items():
        mesh[name] = "\n".join(strings.tolist())
    mesh.update()


def empty(mesh):
    mesh.clear_geometry()
    mesh.update()
