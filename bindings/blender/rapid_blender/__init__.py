"""Rapid in Blender: a scene in Lua takes Blender's objects as inputs, and its points come back as meshes of vertices.

A bake evaluates the inputs at each frame and writes them as files (inputs), lets Rapid run on them (bake), and stores
Rapid's ordinary output in a folder beside the .blend. Playback and renders only read these files (handlers, points).
docs/blender.md is the guide. The differences between versions of Blender are in compat.py.
"""
bl_info = {
    "name": "Rapid",
    "description": "Particles simulated by scenes in Lua",
    "author": "The developers of Rapid",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Object > Rapid",
    "category": "Physics",
}

import bpy  # noqa: E402

from . import handlers, operators, panel, properties  # noqa: E402


def register():
    for one in properties.CLASSES + operators.CLASSES + panel.CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Object.rapid = bpy.props.PointerProperty(type=properties.RapidSimulation)
    handlers.register()


def unregister():
    handlers.unregister()
    del bpy.types.Object.rapid
    for one in reversed(properties.CLASSES + operators.CLASSES + panel.CLASSES):
        bpy.utils.unregister_class(one)
