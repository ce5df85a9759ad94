"""What the shots of this folder have in common: the add-on, materials, lights, the bake and the picture."""
import importlib.util
import pathlib
import sys

import addon_utils
import bpy
import mathutils

HERE = pathlib.Path(__file__).resolve().parent


def _enable():
    """Enables the add-on: the installed one, or else that of the checkout."""
    if hasattr(bpy.types.Object, "rapid"):
        return
    if importlib.util.find_spec("rapid_blender") is None:
        sys.path += [str(HERE.parents[1] / "bindings/blender"), str(HERE.parents[1] / "bindings/python")]
    addon_utils.enable("rapid_blender")


def begin(frames):
    """Begins an empty shot of this length, at 24 frames per second."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _enable()
    scene, render = bpy.context.scene, bpy.context.scene.render
    scene.frame_start, scene.frame_end, render.fps = 1, frames, 24
    render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 48, False
    render.resolution_x, render.resolution_y = 960, 540
    render.use_motion_blur, render.motion_blur_shutter = True, 0.5
    scene.view_settings.view_transform = "Filmic"
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.06, 0.08, 0.11, 1)


def material(name, color, roughness=0.5, metallic=0.0, light=0.0):
    """Returns a material. light: how much it shines in its colour."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*color, 1)
    inputs["Roughness"].default_value, inputs["Metallic"].default_value = roughness, metallic
    inputs["Emission"].default_value, inputs["Emission Strength"].default_value = (*color, 1), light
    return made


def keyed(thing, path, *keys):
    """Animates a property at constant speed between keys (frame, value)."""
    for frame, value in keys:
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=frame)
    for curve in thing.animation_data.action.fcurves:
        curve.extrapolation = "LINEAR"
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def simulation(name, scene):
    """Returns the object of a simulation whose scene is a file of this folder. Its inputs are still empty."""
    bpy.ops.rapid.add()
    thing = bpy.context.object
    thing.name = name
    thing.rapid.text.from_string((HERE / scene).read_text(encoding="utf-8"))
    bpy.ops.rapid.reload()
    return thing


def show_points(thing, points_material):
    from rapid_blender import node_groups
    node_groups.show(thing, node_groups.POINTS, Material=points_material)


def camera(location, target, lens):
    made = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    made.data.lens, made.location = lens, location
    made.rotation_euler = (mathutils.Vector(target) - mathutils.Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = made


def light(location, energy, size):
    """An area that shines on the origin. energy: W."""
    made = bpy.data.objects.new("Light", bpy.data.lights.new("Light", "AREA"))
    made.data.energy, made.data.size, made.location = energy, size, location
    made.rotation_euler = (-mathutils.Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)


def bake(thing, path):
    """Saves the shot, and bakes its simulation next to it."""
    bpy.ops.wm.save_as_mainfile(filepath=str(pathlib.Path(path).resolve()))
    bpy.context.view_layer.objects.active = thing
    bpy.ops.rapid.bake()
    bpy.ops.wm.save_mainfile()


def run(make):
    """Makes the shot that the command line names, and renders a frame if it names one."""
    given = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if len(given) not in (1, 3):
        sys.exit("usage: blender -b -P SHOT.py -- SHOT.blend [FRAME PICTURE.png]")
    make(given[0])
    if len(given) == 3:
        bpy.context.scene.frame_set(int(given[1]))
        bpy.context.scene.render.filepath = str(pathlib.Path(given[2]).resolve())
        bpy.ops.render.render(write_still=True)
