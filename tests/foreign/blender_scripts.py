"""Functions that run in Blender: blender -b -P blender_scripts.py -- FUNCTION FOLDER

Each gets the folder and the values of given.json, and returns what result.json will have.
"""
import json
import math
import pathlib
import sys

import bpy
import mathutils
from mathutils.bvhtree import BVHTree


def clear():
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)


def only_object():
    [thing] = [thing for thing in bpy.data.objects if thing.type in ("MESH", "VOLUME")]
    return thing


def vectors(values):
    return [list(value) for value in values]


def import_ply(folder):
    """Returns the mesh of a.ply, and the columns that its importer finds for colours."""
    bpy.ops.import_mesh.ply(filepath=str(folder / "a.ply"))
    mesh = only_object().data
    from io_mesh_ply import import_ply as importer
    spec, elements, _ = importer.read(str(folder / "a.ply"))
    columns = next(element for element in spec.specs if element.name == b"vertex")
    names = [b"red", b"green", b"blue", b"alpha"]
    indices = [columns.index(name) for name in names if columns.index(name) >= 0]
    types = [columns.properties[index].numeric_type for index in indices]
    return {"P": vectors(vertex.co for vertex in mesh.vertices), "edges": vectors(edge.vertices for edge in mesh.edges),
            "colours": [[row[index] for index in indices] for row in elements[b"vertex"]], "types": types}


def import_obj(folder):
    # The new importer of Blender 3.4 reads only the first segment of a line.
    if hasattr(bpy.ops.import_scene, "obj"):
        bpy.ops.import_scene.obj(filepath=str(folder / "a.obj"), axis_forward="Y", axis_up="Z")
    else:
        bpy.ops.wm.obj_import(filepath=str(folder / "a.obj"), forward_axis="Y", up_axis="Z")
    thing = only_object()
    return {"P": vectors(thing.matrix_world @ vertex.co for vertex in thing.data.vertices),
            "edges": vectors(edge.vertices for edge in thing.data.edges)}


def import_vdb(folder):
    """Returns the grids of a.vdb and the box of what Blender would draw."""
    bpy.ops.object.volume_import(filepath=str(folder / "a.vdb"))
    thing = only_object()
    thing.data.grids.load()
    bpy.context.view_layer.update()
    return {"grids": [[grid.name, grid.data_type] for grid in thing.data.grids], "box": vectors(thing.bound_box)}


def new_figure():
    """Adds a monkey's head in triangles and a prism of seven sides, turned and moved, with a colour for each corner.

    Faces that are not flat would be cut in different ways by Blender's exporters and by Rapid.
    """
    clear()
    bpy.ops.mesh.primitive_cylinder_add(vertices=7, radius=0.4, depth=0.5, location=(1.2, 0, 0))
    prism = bpy.context.object
    bpy.ops.object.transform_apply()
    bpy.ops.mesh.primitive_monkey_add(size=1.5)
    head = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.quads_convert_to_tris()
    bpy.ops.object.mode_set(mode="OBJECT")
    prism.select_set(True)
    bpy.ops.object.join()
    head.location, head.rotation_euler = (0.5, -1, 2), (0.3, 0.2, 0.1)
    colours = head.data.color_attributes.new(name="Col", type="BYTE_COLOR", domain="CORNER")
    for loop in head.data.loops:
        colours.data[loop.index].color_srgb = colour_at(head.data.vertices[loop.vertex_index]) + [1]
    bpy.context.view_layer.update()
    return head


def colour_at(vertex):
    return [min(1, max(0, 0.5 + part / 3)) for part in vertex.co]


def surface_of(thing):
    """Returns the evaluated mesh in world space."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    mesh.transform(thing.matrix_world)
    mesh.calc_loop_triangles()
    return mesh


def facts(mesh, turn):
    """Returns the vertices, area and centroid of a surface, turned from z up to the axes of a file."""
    area, moment = 0, mathutils.Vector()
    for triangle in mesh.loop_triangles:
        a, b, c = (mesh.vertices[index].co for index in triangle.vertices)
        size = mathutils.geometry.area_tri(a, b, c)
        area += size
        moment += size * (a + b + c) / 3
    return {"P": vectors(turn @ vertex.co for vertex in mesh.vertices), "area": area,
            "centroid": list(turn @ (moment / area)),
            "triangles": [list(triangle.vertices) for triangle in mesh.loop_triangles]}


Y_UP = mathutils.Matrix(((1, 0, 0), (0, 0, 1), (0, -1, 0)))
SAME = mathutils.Matrix.Identity(3)


def export_mesh(folder):
    """Writes a figure to figure.obj, .ply and .stl, z up, and to figure.gltf, which is y up."""
    head = new_figure()
    bpy.ops.object.select_all(action="DESELECT")
    head.select_set(True)
    bpy.ops.wm.obj_export(filepath=str(folder / "figure.obj"), forward_axis="Y", up_axis="Z")
    bpy.ops.export_mesh.ply(filepath=str(folder / "figure.ply"), axis_forward="Y", axis_up="Z", use_selection=True)
    bpy.ops.export_mesh.stl(filepath=str(folder / "figure.stl"), axis_forward="Y", axis_up="Z", use_selection=True)
    bpy.ops.export_scene.gltf(filepath=str(folder / "figure.gltf"), export_format="GLTF_SEPARATE")
    return {**facts(surface_of(head), SAME), "Cd": [colour_at(vertex) for vertex in head.data.vertices]}


def export_mirrored(folder):
    """Writes a mirrored prism below a node that scales unequally and turns, y up, and z up in text.

    Blender 3.4 turns no mirrored face around in .ply.
    """
    bpy.ops.object.empty_add(rotation=(0.4, -0.2, 0.9), location=(1, 2, 3))
    parent = bpy.context.object
    parent.scale = (1, 2, 0.5)
    bpy.ops.mesh.primitive_cylinder_add(vertices=5, radius=0.7, depth=1.1, location=(0.2, 0.3, 0.4))
    prism = bpy.context.object
    prism.scale = (-1, 1, 1.5)
    prism.rotation_euler = (0.1, 0.7, 0)
    prism.parent = parent
    bpy.context.view_layer.update()
    bpy.ops.export_scene.gltf(filepath=str(folder / "prism.glb"), export_format="GLB")
    bpy.ops.object.select_all(action="DESELECT")
    prism.select_set(True)
    bpy.ops.export_mesh.stl(filepath=str(folder / "prism.stl"), axis_forward="Y", axis_up="Z", use_selection=True,
                            ascii=True)
    bpy.ops.wm.obj_export(filepath=str(folder / "prism.obj"), forward_axis="Y", up_axis="Z")
    return facts(surface_of(prism), SAME)


def export_character(folder, frames):
    """Writes a head with a skin of two bones and a shape key, both animated, and returns its surface in frames."""
    head = new_figure()
    head.matrix_world = mathutils.Matrix.Identity(4)
    head.shape_key_add(name="Basis")
    grown = head.shape_key_add(name="Grown")
    for vertex, point in zip(head.data.vertices, grown.data):
        point.co = vertex.co * 1.4
    bpy.ops.object.armature_add(location=(0, 0, 0))
    rig = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    low = rig.data.edit_bones[0]
    low.name, low.head, low.tail = "low", (0, 0, -1), (0, 0, 0)
    high = rig.data.edit_bones.new("high")
    high.head, high.tail, high.parent, high.use_connect = (0, 0, 0), (0, 0, 1), low, True
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, weight in (("low", lambda z: 0.5 - z), ("high", lambda z: 0.5 + z)):
        group = head.vertex_groups.new(name=name)
        for vertex in head.data.vertices:
            group.add([vertex.index], min(1, max(0, weight(vertex.co.z))), "REPLACE")
    head.parent = rig
    head.modifiers.new("Armature", "ARMATURE").object = rig
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = 24, 0, 24
    for bone in rig.pose.bones:
        bone.rotation_mode = "QUATERNION"
    for frame in range(0, 25):
        part = frame / 24
        rig.pose.bones["low"].location = (0.5 * part, 0, 0.25 * math.sin(5 * part))
        rig.pose.bones["low"].keyframe_insert("location", frame=frame)
        rig.pose.bones["high"].rotation_quaternion = mathutils.Quaternion((1, 0, 0), 1.2 * part)
        rig.pose.bones["high"].keyframe_insert("rotation_quaternion", frame=frame)
        grown.value = part * part
        grown.keyframe_insert("value", frame=frame)
    bpy.ops.export_scene.gltf(filepath=str(folder / "figure.glb"), export_format="GLB", export_nla_strips=False)
    surfaces = []
    for frame in frames:
        scene.frame_set(frame)
        surfaces.append(facts(surface_of(head), Y_UP))
    return surfaces


def distances(folder, triangles, P, births):
    """Returns how far births are from a surface."""
    del folder
    tree = BVHTree.FromPolygons(P, triangles)
    return [tree.find_nearest(birth)[3] for birth in births]


def main():
    function, name = sys.argv[sys.argv.index("--") + 1:]
    folder = pathlib.Path(name)
    given = json.loads((folder / "given.json").read_text(encoding="utf-8"))
    result = globals()[function](folder, **given)
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    clear()
    main()
