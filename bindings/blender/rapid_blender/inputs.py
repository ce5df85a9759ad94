"""Blender's objects as files that Rapid reads: meshes as .ply, points as .npz, curves as .obj, one file per frame."""
import hashlib
import os
import pathlib

import bpy
import numpy

from . import axes, compat
from .source import Problem, kind_of

_EXTENSIONS = {"mesh": "ply", "points": "npz", "curve": "obj"}
_WIDTHS = {"FLOAT": ("value", 1), "INT": ("value", 1), "FLOAT_VECTOR": ("vector", 3), "FLOAT_COLOR": ("color", 4)}


def _coordinates(vertices):
    P = numpy.empty(3 * len(vertices), numpy.float32)
    vertices.foreach_get("co", P)
    return P.reshape(-1, 3)


def _triangles(mesh):
    mesh.calc_loop_triangles()
    corners = numpy.empty(3 * len(mesh.loop_triangles), numpy.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    return corners.reshape(-1, 3)


def _placed(P, matrix, scale):
    """Returns positions in Rapid's space, rounded once, and whether the matrix mirrors."""
    matrix = numpy.array(matrix, numpy.float64)
    return axes.to_rapid((P @ matrix[:3, :3].T + matrix[:3, 3]) * scale), numpy.linalg.det(matrix[:3, :3]) < 0


def _attributes(mesh):
    """Returns the values of a mesh's vertices, by name. Directions and colours have three numbers."""
    result = {}
    for one in mesh.attributes:
        if one.domain != "POINT" or one.data_type not in _WIDTHS or not compat.is_own_attribute(one) \
                or not one.name.isidentifier():
            continue
        field, width = _WIDTHS[one.data_type]
        values = numpy.empty(width * len(one.data), numpy.int32 if one.data_type == "INT" else numpy.float32)
        one.data.foreach_get(field, values)
        values = values.reshape(-1, width) if width > 1 else values.astype(numpy.float32)
        result[one.name] = axes.to_rapid(values) if width == 3 else values[:, :3] if width == 4 else values
    return result


def _is_enabled(thing, layer):
    """Returns whether a layer collection, or one within it, makes Blender evaluate an object. The eye of the outliner
    hides objects that are evaluated."""
    if layer.exclude or layer.collection.hide_viewport:
        return False
    return thing.name in layer.collection.objects or any(_is_enabled(thing, child) for child in layer.children)


class _Evaluated:
    """The evaluated mesh of an object with its modifiers. `with` it: meshes of other types of objects are temporary."""

    def __init__(self, thing, depsgraph, name):
        self._thing = thing.evaluated_get(depsgraph)
        if thing.hide_viewport or not _is_enabled(thing, depsgraph.view_layer.layer_collection):
            # Blender would silently return the mesh without its modifiers.
            raise Problem(f'input "{name}": {thing.name} is disabled in viewports or excluded from the view layer, so '
                          "Blender does not evaluate it; enable it, and hide it by its eye or in renders")
        self.matrix = self._thing.matrix_world

    def __enter__(self):
        if self._thing.type == "MESH":
            return self._thing.data
        mesh = self._thing.to_mesh()
        if mesh is None:
            raise Problem(f"{self._thing.name} is of the type {self._thing.type}, which has no mesh; choose another object")
        return mesh

    def __exit__(self, *_):
        if self._thing.type != "MESH":
            self._thing.to_mesh_clear()


def _mesh(one, depsgraph, scale):
    """Returns the positions, triangles and attributes of all objects of an input, with instances that they make."""
    parts = []
    for thing in one.objects:
        if one.kind == "COLLECTION" and thing.type not in ("MESH", "CURVE", "SURFACE", "META", "FONT"):
            continue
        evaluated = _Evaluated(thing, depsgraph, one.name)
        with evaluated as mesh:
            parts.append((*_placed(_coordinates(mesh.vertices), evaluated.matrix, scale), _triangles(mesh),
                          _attributes(mesh)))
    wanted = {thing.name_full for thing in one.objects}
    for instance in depsgraph.object_instances:
        if instance.is_instance and instance.parent and instance.parent.original.name_full in wanted \
                and instance.object.type == "MESH":
            mesh = instance.object.data
            parts.append((*_placed(_coordinates(mesh.vertices), instance.matrix_world, scale), _triangles(mesh),
                          _attributes(mesh)))
    P, T, begin = [], [], 0
    for positions, mirrored, triangles, _ in parts:
        P.append(positions)
        T.append((triangles[:, ::-1] if mirrored else triangles) + begin)
        begin += len(positions)
    shared = set.intersection(*(set(values) for *_, values in parts)) if parts else set()
    values = {name: numpy.concatenate([part[3][name] for part in parts]) for name in sorted(shared)}
    P, T = (numpy.concatenate(arrays or [numpy.empty((0, 3), kind)]) for arrays, kind in ((P, numpy.float32),
                                                                                         (T, numpy.int32)))
    if len(T) == 0:
        raise Problem(f'input "{one.name}": {", ".join(sorted(wanted))} has no faces')
    return P, T, values


def _ply(P, T, values):
    """Returns the bytes of a binary PLY, with values for each vertex."""
    names, columns = ["x", "y", "z"], [P]
    for name, array in values.items():
        names += [name] if array.ndim == 1 else [f"{name}{axis}" for axis in "xyz"]
        columns.append(array.reshape(len(P), -1))
    faces = numpy.empty(len(T), numpy.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    faces["count"], faces["corners"] = 3, T
    head = [f"ply\nformat binary_little_endian 1.0\nelement vertex {len(P)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(T)}\nproperty list uchar int vertex_indices\nend_header\n"]
    return "\n".join(head).encode() + numpy.hstack(columns).astype("<f4").tobytes() + faces.tobytes()


def _curve(one, depsgraph, scale):
    """Returns the bytes of an .obj with the lines of a curve."""
    evaluated = _Evaluated(one.object, depsgraph, one.name)
    with evaluated as mesh:
        P, _ = _placed(_coordinates(mesh.vertices), evaluated.matrix, scale)
        edges = [tuple(edge.vertices) for edge in mesh.edges]
    lines, last = [], None
    for a, b in edges:  # Blender lists the edges of each line in order
        if a != last:
            lines.append([a])
        lines[-1].append(b)
        last = b
    text = "".join("v %.9g %.9g %.9g\n" % tuple(p) for p in P)
    return (text + "".join("l " + " ".join(str(k + 1) for k in line) + "\n" for line in lines)).encode()


def _points(one, depsgraph, scale):
    """Returns the columns of points: vertices, or an empty."""
    if one.object.type == "EMPTY":
        P, _ = _placed(numpy.zeros((1, 3), numpy.float32), one.object.evaluated_get(depsgraph).matrix_world, scale)
        return {"P": P}
    evaluated = _Evaluated(one.object, depsgraph, one.name)
    with evaluated as mesh:
        P, _ = _placed(_coordinates(mesh.vertices), evaluated.matrix, scale)
        return {"P": P, **{name: array for name, array in _attributes(mesh).items() if name not in ("P", "id")}}


def _file_name(one, frame):
    """frame: None for the pattern of all frames."""
    number = "####" if frame is None else f"{frame:04d}"
    return f"{bpy.path.clean_name(one.name)}.{number}.{_EXTENSIONS[kind_of(one)]}"


class Inputs:
    """The files of a simulation's inputs. write() is called once for each frame, in Blender at that frame.

    A bake stores no references to properties or objects, because undo invalidates them.
    """

    def __init__(self, folder):
        self._folder = pathlib.Path(folder)
        self._hashes = {}  # of contents, by file name
        self._faces = {}   # of meshes, by the name of the input
        self.is_changed = False

    def write(self, thing, frame, scene, depsgraph):
        """frame: the number for Rapid."""
        self._folder.mkdir(parents=True, exist_ok=True)
        scale = scene.unit_settings.scale_length
        for one in thing.rapid.inputs:
            kind, columns = kind_of(one), None
            if kind == "mesh":
                P, T, values = _mesh(one, depsgraph, scale)
                self._faces.setdefault(one.name, set()).add((len(P), hashlib.sha1(T).hexdigest()))
                content = _ply(P, T, values)
            elif kind == "curve":
                content = _curve(one, depsgraph, scale)
            else:
                columns = _points(one, depsgraph, scale)
                content = b"".join(array.tobytes() for array in columns.values())
            self._write(_file_name(one, frame), hashlib.sha1(content).hexdigest(), content, columns)

    def _write(self, name, digest, content, columns):
        """Writes a file unless it has this content already. A file beside it has the hash."""
        self._hashes[name] = digest
        path, known = self._folder / name, self._folder / f"{name}.sha1"
        if path.exists() and known.exists() and known.read_text() == digest:
            return
        self.is_changed = True
        known.unlink(missing_ok=True)
        new = self._folder / f"new.{name}"
        if columns is None:
            new.write_bytes(content)
        else:
            numpy.savez(new, **columns)
        os.replace(new, path)
        known.write_text(digest)

    def finish(self):
        """Removes files of other inputs and frames."""
        for path in self._folder.iterdir() if self._folder.exists() else ():
            if path.name.removesuffix(".sha1") not in self._hashes:
                path.unlink()
                self.is_changed = True

    def table(self, thing, scene_path):
        """Returns the entries for inputs.lua. Paths are relative to the scene, so that a moved project is the same
        run."""
        folder = os.path.relpath(self._folder, os.path.dirname(scene_path) or ".").replace(os.sep, "/")
        result = {}
        for one in thing.rapid.inputs:
            pattern = _file_name(one, None)
            begin, end = pattern.split("####")
            names = sorted(name for name in self._hashes if name.startswith(begin) and name.endswith(end))
            rests = len({self._hashes[name] for name in names}) == 1
            result[one.name] = {"kind": kind_of(one), "path": f"{folder}/{names[0] if rests else pattern}",
                                "changes": len(self._faces.get(one.name, ())) > 1}
        return result
