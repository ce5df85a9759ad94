"""What happens when a frame changes, a frame is rendered, or a file is saved, loaded or undone. Nothing is computed here:
points are read from the bake.

A render calls the handlers on another thread, with its own depsgraph, at the times of motion blur. They therefore use
nothing of bpy.context, and rewrite the arrays of existing meshes only.
"""
import sys

import bpy
from bpy.app.handlers import persistent

from . import bake, points
from .properties import simulations
from .source import Problem

scene_problems = {}  # mistakes in scenes and bakes, by the full name of a simulation; not stored in the .blend
frame_problems = {}  # why the current frame is not shown
_rendered = {}       # the frame that a render has begun, by the name of its scene
is_paused = False    # while a bake goes through the frames


def show(scene, frame, subframe=0.0):
    """Fills the meshes of all simulations with the points of a frame, moved by a part of a frame."""
    for thing in simulations(scene):
        try:
            _show(thing, scene, frame, subframe)
        except Problem as problem:
            frame_problems[thing.name_full] = problem


def _mesh_of(output, scene):
    """Returns the mesh of an output. Blender ignores writes to arrays of a linked mesh, so an object that is linked or
    overridden gets a mesh of its own, except during a render."""
    mesh = output.object.data
    if mesh.library and scene.name not in _rendered:
        output.object.data = bpy.data.meshes.new(f"{output.object.name} points")
        for material in mesh.materials:
            output.object.data.materials.append(material)
    return output.object.data


def _show(thing, scene, frame, subframe):
    if frame < thing.rapid.start:
        for output in thing.rapid.outputs:
            if output.object:
                points.empty(_mesh_of(output, scene))
        return
    files = check(thing, scene, frame)
    for output in thing.rapid.outputs:
        if output.object:
            points.fill(_mesh_of(output, scene), points.read(files[output.name]), scene.unit_settings.scale_length,
                        subframe / bake.frame_rate(scene))


def check(thing, scene, frame):
    """Returns the files of a frame. Raises Problem if it is not baked, or was baked with other settings."""
    record, files = bake.record_of(thing), bake.points_files(thing, frame)
    if not record or not files or not all(path.exists() for path in files.values()):
        raise Problem(f"{thing.name}: frame {frame} is not baked; press Bake")
    if record["key"] != bake.key_of(thing, scene):
        raise Problem(f"{thing.name}: frame {frame} was baked with other settings; bake again")
    return files


@persistent
def on_frame(scene, _depsgraph=None):
    if is_paused:
        return
    frame_problems.clear()
    frame = _rendered.get(scene.name, scene.frame_current)
    show(scene, frame, scene.frame_current + scene.frame_subframe - frame)


@persistent
def before_render(scene, _=None):
    """A frame that is not baked is an error. It ends a render without a window with status 1."""
    _rendered[scene.name] = scene.frame_current
    for thing in simulations(scene):
        if thing.hide_render or scene.frame_current < thing.rapid.start:
            continue
        try:
            check(thing, scene, scene.frame_current)
        except Problem as problem:
            frame_problems[thing.name_full] = problem
            if bpy.app.background:
                print(f"Rapid: {problem}", file=sys.stderr, flush=True)
                sys.exit(1)


@persistent
def after_render(scene, _=None):
    _rendered.pop(scene.name, None)


@persistent
def refill(*_):
    """After loading, saving, undo and redo."""
    frame_problems.clear()
    for scene in bpy.data.scenes:
        show(scene, scene.frame_current)


@persistent
def before_save(*_):
    """Empties the meshes, so that the .blend stays small."""
    for thing in bpy.data.objects:
        for output in thing.rapid.outputs if thing.rapid.is_simulation else ():
            if output.object and not output.object.data.library:
                points.empty(output.object.data)


@persistent
def after_save(*_):
    bake.move_to_saved_file()
    refill()


@persistent
def after_load(*_):
    scene_problems.clear()
    _rendered.clear()
    refill()


HANDLERS = {"frame_change_pre": on_frame, "render_pre": before_render, "render_post": after_render,
            "render_complete": after_render, "render_cancel": after_render, "save_pre": before_save,
            "save_post": after_save, "load_post": after_load, "undo_post": refill, "redo_post": refill}


def register():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
