"""Small scenes in Blender for the tests, and the same meshes as sequences of .ply files for `rapid run`."""

import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest

import bpy
import numpy

from rapid_blender import bake, handlers


EMIT = """local rapid = require "rapid"
local rate = rapid.param("rate", 500, "births per second [0, 10000]")
return rapid.create { fps = 24 }
  :emit { source = rapid.host "emitter", rate = rate, birth = "even", attributes = { pscale = 0.05, Cd = {0.2, 0.4, 0.8} } }
  :gravity {} :solve {}
"""

COLLIDE = """local rapid = require "rapid"
return rapid.create { fps = 24, points = rapid.points.grid { size = {2, 1, 2}, spacing = 0.25, center = {0, 1, 0} } }
  :gravity {}
  :collide { shape = rapid.levelset.from_mesh(rapid.host "body", { voxel = 0.1 }), bounce = 0.3 }
  :solve {}
"""


class Case(unittest.TestCase):
    """A test in an empty .blend that is saved in a temporary folder."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="rapid_blender_"))
        self.addCleanup(shutil.rmtree, self.folder)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.blend = self.folder / "shot.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(self.blend))
        self.scene = bpy.context.scene
        self.scene.frame_start, self.scene.frame_end = 1, 8
        self.scene.frame_set(1)

    def simulation(self, text, name="Rapid", **objects):
        """Returns an object that is a simulation of a scene, with objects for its inputs."""
        bpy.ops.rapid.add()
        thing = bpy.context.object
        thing.name = name
        thing.rapid.text.from_string(text)
        bpy.ops.rapid.reload()
        for one, filler in objects.items():
            thing.rapid.inputs[one].object = filler
        return thing

    def bake(self, thing, **options):
        bpy.context.view_layer.objects.active = thing
        return bpy.ops.rapid.bake(**options)

    def refused(self, thing):
        """Returns the error of a bake."""
        with self.assertRaises(RuntimeError):
            self.bake(thing)
        return handlers.scene_problems[thing.name_full]

    def points(self, thing, frame):
        """Returns the attributes of a baked frame, with positions as P."""
        self.scene.frame_set(frame)
        self.assertEqual({}, {**handlers.scene_problems, **handlers.frame_problems})
        return values(thing.data)

    def run_on_files(self, text, frames, **objects):
        """Returns the points of the last frame by `rapid run`, with the objects as sequences of files."""
        folder = self.folder / "files"
        for frame in range(frames[0] - 1, frames[1] + 2):
            self.scene.frame_set(frame)
            for name, thing in objects.items():
                write_ply(folder / f"{name}.{frame:04d}.ply", thing)
        self.scene.frame_set(1)
        for name in objects:
            text = text.replace(f'rapid.host "{name}"', f'rapid.mesh.read "{name}.####.ply"')
        (folder / "scene.lua").write_text(text)
        command = [os.environ["RAPID_BUILD"] + "/bin/rapid", "run", str(folder / "scene.lua"), "--quiet", "-f",
                   f"{frames[1]}", "-o", str(folder / "points.####.npz")]
        subprocess.run(command, check=True)
        with numpy.load(folder / f"points.{frames[1]:04d}.npz") as arrays:
            return {name: arrays[name] for name in arrays.files}

    def assert_same_points(self, blender, files):
        """Compares bits: the axes are exchanged, one changes its sign, and nothing is rounded."""
        self.assertGreater(len(files["id"]), 10)
        numpy.testing.assert_array_equal(blender["id"], files["id"])
        for name, of_file in (("P", "P"), ("velocity", "v")):
            x, y, z = files[of_file].T
            numpy.testing.assert_array_equal(blender[name], numpy.stack([x, -z, y], 1))


def values(mesh):
    """Returns the attributes of a mesh, by name."""
    def read(items, field, width, kind):
        array = numpy.empty(width * len(items), kind)
        items.foreach_get(field, array)
        return array.reshape(-1, width) if width > 1 else array
    known = {"FLOAT": ("value", 1, numpy.float32), "INT": ("value", 1, numpy.int32), "BOOLEAN": ("value", 1, bool),
             "FLOAT_VECTOR": ("vector", 3, numpy.float32), "FLOAT_COLOR": ("color", 4, numpy.float32)}
    result = {one.name: read(one.data, *known[one.data_type]) for one in mesh.attributes if one.name[0] != "."}
    return {"P": read(mesh.vertices, "co", 3, numpy.float32), **result}


def write_ply(path, thing):
    """Writes the evaluated mesh of an object, y up, by another path than the add-on's."""
    path.parent.mkdir(exist_ok=True)
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    mesh.calc_loop_triangles()
    rows = [list(row) for row in evaluated.matrix_world]  # Blender's own product rounds more often
    content = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\nproperty float x\n"
               f"property float y\nproperty float z\nelement face {len(mesh.loop_triangles)}\n"
               "property list uchar int vertex_indices\nend_header\n").encode()
    for vertex in mesh.vertices:
        x, y, z = (sum(a * b for a, b in zip(row, (*vertex.co, 1))) for row in rows[:3])
        content += struct.pack("<3f", x, z, -y)
    for triangle in mesh.loop_triangles:
        content += struct.pack("<B3i", 3, *triangle.vertices)
    path.write_bytes(content)
    bpy.data.meshes.remove(mesh)


def added(primitive, **options):
    getattr(bpy.ops.mesh, f"primitive_{primitive}_add")(**options)
    return bpy.context.object


def moved(thing, first, last, path="location"):
    """Moves an object from a value to another one at constant speed. first, last: (frame, value)."""
    for frame, value in (first, last):
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=frame)
    for curve in thing.animation_data.action.fcurves:
        curve.extrapolation = "LINEAR"
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    return thing


def bent(thing, frames):
    """Deforms a mesh by an armature whose bone turns by a radian over the frames."""
    bpy.ops.object.armature_add()
    armature = bpy.context.object
    thing.parent = armature
    modifier = thing.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    group = thing.vertex_groups.new(name="Bone")
    group.add([one.index for one in thing.data.vertices if one.co.z > 0], 1, "ADD")
    bone = armature.pose.bones["Bone"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((frames[0], 0), (frames[1], 1)):
        bone.rotation_euler = angle, 0, 0
        bone.keyframe_insert("rotation_euler", frame=frame)
    return thing


def grown(thing, frames):
    """Deforms a mesh by a shape key."""
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Tall")
    for one in key.data:
        one.co.z *= 2
    for frame, value in ((frames[0], 0), (frames[1], 1)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    return thing


def files_of(thing):
    """Returns the time of change of each file of points."""
    return {path.name: path.stat().st_mtime_ns for path in bake.folder_of(thing).glob("points_*.npz")}


def in_new_process(blend, code="", environment=(), arguments=()):
    """Opens a file in another Blender with the add-on, and runs code, then arguments of the command line."""
    bindings = pathlib.Path(handlers.__file__).parents[2]
    folders = [str(bindings / "blender"), str(bindings / "python")]
    head = (f"import sys\nsys.dont_write_bytecode = True\nsys.path[:0] = {folders}\n"
            "import bpy, rapid_blender\nrapid_blender.register()\n"
            f"bpy.ops.wm.open_mainfile(filepath={str(blend)!r})\n")
    return subprocess.run(["blender", "--background", "--factory-startup", "--python-expr", head + code, *arguments],
                          env={**os.environ, **dict(environment)}, text=True, check=False, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
