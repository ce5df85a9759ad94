"""Rain on a driving car, in Blender: blender -b -P graphs/blender/rain.py -- rain.blend [FRAME PICTURE.png]

Makes the shot, bakes it and saves it. With a frame and a picture, renders it too.
"""
import math
import pathlib
import sys

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import shot  # noqa: E402

SPEED = 5    # m/s
FRAMES = 60


def box(name, size, location, bevel, material):
    bpy.ops.mesh.primitive_cube_add(size=1, location=location)
    made = bpy.context.object
    made.name, made.scale = name, size
    bpy.ops.object.transform_apply(location=False, rotation=False)
    modifier = made.modifiers.new("Bevel", "BEVEL")
    modifier.width, modifier.segments = bevel, 4
    made.data.materials.append(material)
    return made


def make_car():
    """Returns a collection with a body that drives along x and wheels that roll."""
    collection = bpy.data.collections.new("Car")
    bpy.context.scene.collection.children.link(collection)
    paint = shot.material("Paint", (0.5, 0.03, 0.02), roughness=0.25, metallic=0.4)
    glass = shot.material("Glass", (0.02, 0.025, 0.03), roughness=0.08)
    rubber = shot.material("Rubber", (0.02, 0.02, 0.02), roughness=0.7)
    body = box("Body", (3.9, 1.6, 0.55), (0, 0, 0.6), 0.18, paint)
    parts = [body, box("Cabin", (2, 1.4, 0.5), (-0.2, 0, 1.1), 0.2, glass)]
    for x in (-1.2, 1.2):
        for y in (-0.75, 0.75):
            bpy.ops.mesh.primitive_cylinder_add(radius=0.33, depth=0.22, location=(x, y, 0.34),
                                                rotation=(math.pi / 2, 0, 0))
            wheel = bpy.context.object
            wheel.data.materials.append(rubber)
            wheel.modifiers.new("Bevel", "BEVEL").width = 0.04
            wheel.rotation_mode = "YXZ"
            shot.keyed(wheel, "rotation_euler", (1, (math.pi / 2, 0, 0)),
                       (FRAMES, (math.pi / 2, SPEED * (FRAMES - 1) / 24 / 0.33, 0)))
            parts.append(wheel)
    for part in parts:
        if part != body:
            part.parent, part.matrix_parent_inverse = body, body.matrix_world.inverted()
        for other in part.users_collection:
            other.objects.unlink(part)
        collection.objects.link(part)
    way = SPEED * (FRAMES - 1) / 24
    shot.keyed(body, "location", (1, (-way / 2, 0, 0.6)), (FRAMES, (way / 2, 0, 0.6)))
    return collection


def main(path):
    shot.begin(FRAMES)
    car = make_car()
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0, 0, 4))
    clouds = bpy.context.object
    clouds.name, clouds.scale, clouds.hide_render = "Clouds", (16, 6, 1), True
    bpy.ops.mesh.primitive_plane_add(size=80)
    bpy.context.object.data.materials.append(shot.material("Road", (0.03, 0.032, 0.035), roughness=0.3))

    rain = shot.simulation("Rain", "rain.lua")
    rain.rapid.inputs["clouds"].object = clouds
    rain.rapid.inputs["car"].kind, rain.rapid.inputs["car"].collection = "COLLECTION", car
    water = shot.material("Water", (0.75, 0.85, 1), roughness=0.1, light=0.6)
    for output in rain.rapid.outputs:
        shot.show_points(output.object, water)

    shot.camera((-4.5, -7.5, 1.5), (0.4, 0, 0.75), lens=38)
    shot.light((5, 4, 6), energy=1500, size=4)
    shot.light((-6, -3, 5), energy=500, size=6)
    shot.bake(rain, path)


if __name__ == "__main__":
    shot.run(main)
