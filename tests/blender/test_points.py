"""Points as attributes of Blender's meshes: axes, units, types, and the node groups that show them."""
import bpy
import mathutils
import numpy

import rapid
from rapid_blender import axes, bake, node_groups, points
from scenes import EMIT, Case, added, values

TURNED = """local rapid = require "rapid"
return { main = rapid.create { points = rapid.points.from { P = {{1, 2, 3}, {4, 5, 6}}, v = {{1, 0, 0}, {0, 1, 0}},
      orient = {{0.5, 0.5, 0.5, 0.5}, {0, 0.6, 0, 0.8}}, pscale = {0.1, 0.2}, name = {"oak", "birch"}, Alpha = {0.25, 1},
      Cd = {{1, 0, 0}, {0, 1, 0}}, heat = {7, 8}, w = {{0, 3, 0}, {0, 0, 3}} } }
    :solve {} :group { name = "second", where = function(p) return p.id == 1 end },
  other = rapid.create { points = rapid.points.from { P = {{7, 8, 9}} } } :solve {} }
"""


class Attributes(Case):
    def setUp(self):
        super().setUp()
        self.thing = self.simulation(TURNED)
        self.bake(self.thing)
        self.values = self.points(self.thing, 1)

    def test_vectors_are_z_up(self):
        numpy.testing.assert_array_equal(self.values["P"], [[1, -3, 2], [4, -6, 5]])
        numpy.testing.assert_array_equal(self.values["velocity"], [[1, 0, 0], [0, 0, 1]])
        numpy.testing.assert_array_equal(self.values["w"], [[0, 0, 3], [0, -3, 0]])

    def test_attributes_have_their_names_and_types(self):
        numpy.testing.assert_array_equal(self.values["radius"], numpy.float32([0.1, 0.2]))
        numpy.testing.assert_array_equal(self.values["id"], [0, 1])
        numpy.testing.assert_array_equal(self.values["heat"], [7, 8])
        numpy.testing.assert_array_equal(self.values["Cd"], [[1, 0, 0, 0.25], [0, 1, 0, 1]])
        numpy.testing.assert_array_equal(self.values["second"], [False, True])
        numpy.testing.assert_array_equal(self.values["name"], [1, 0])
        self.assertEqual(self.thing.data["name"].split("\n"), ["birch", "oak"])

    def test_each_output_has_an_object(self):
        other = self.thing.rapid.outputs["other"].object
        self.assertNotEqual(other, self.thing)
        numpy.testing.assert_array_equal(values(other.data)["P"], [[7, -9, 8]])

    def test_a_file_and_its_mesh_have_the_same_points_for_another_reader(self):
        frame = rapid.Frame.read(bake.points_files(self.thing, 1)["main"])
        numpy.testing.assert_array_equal(axes.to_rapid(self.values["P"]), frame["P"])


class Rotations(Case):
    def test_euler_angles_turn_as_the_quaternions_do(self):
        random = numpy.random.default_rng(7)
        orient = random.normal(size=(200, 4))
        half = 0.5 ** 0.5
        orient[:4] = [0, 0, half, half], [0, 0, -half, half], [0.5, 0.5, 0.5, 0.5], [0.5, 0.5, 0.5, -0.5]  # gimbal lock
        orient /= numpy.linalg.norm(orient, axis=1)[:, None]
        vector = mathutils.Vector((1, 2, 3))  # of Rapid
        for (x, y, z, w), angles in zip(orient, axes.to_euler(orient)):
            expected = mathutils.Quaternion((w, x, y, z)) @ vector
            turned = mathutils.Euler(angles, "XYZ").to_matrix() @ mathutils.Vector((1, -3, 2))
            numpy.testing.assert_allclose(turned, (expected.x, -expected.z, expected.y), atol=2e-6)


class Fill(Case):
    def test_a_mesh_is_rewritten_for_any_number_of_points_and_attributes(self):
        mesh = bpy.data.meshes.new("points")
        for count, extra in ((3, {}), (3, {}), (5, {}), (5, {"heat": numpy.arange(5, dtype=numpy.float32)}), (5, {}), (0, {})):
            P = numpy.arange(3 * count, dtype=numpy.float32).reshape(-1, 3)
            points.fill(mesh, {"P": P, "v": P, "id": numpy.arange(count), **extra}, 1)
            found = values(mesh)
            self.assertEqual(set(found), {"P", "velocity", "radius", "id", *extra})
            numpy.testing.assert_array_equal(axes.to_rapid(found["P"]), P)

    def test_ids_beyond_32_bits_stay_different(self):
        mesh = bpy.data.meshes.new("points")
        points.fill(mesh, {"P": numpy.zeros((2, 3), numpy.float32), "id": numpy.array([5, 2**31 + 5])}, 1)
        self.assertEqual(len(set(values(mesh)["id"])), 2)


class Shown(Case):
    def setUp(self):
        super().setUp()
        self.thing = self.simulation(EMIT, emitter=added("cube", location=(0, 0, 3)))
        self.bake(self.thing)
        self.scene.frame_set(8)

    def test_points_are_a_point_cloud_with_their_attributes(self):
        graph = bpy.context.evaluated_depsgraph_get()
        cloud = next(one.object.data for one in graph.object_instances if one.object.type == "POINTCLOUD")
        self.assertEqual(len(cloud.attributes["radius"].data), len(self.thing.data.vertices))
        self.assertLessEqual({"velocity", "Cd", "id"}, set(cloud.attributes.keys()))

    def test_instances_have_the_positions_and_sizes_of_the_points(self):
        cube = added("cube", size=2)
        bpy.context.view_layer.objects.active = self.thing
        bpy.ops.rapid.show(form="INSTANCES")
        self.assertEqual(len(self.thing.modifiers), 1)
        node_groups.show(self.thing, node_groups.INSTANCES, Object=cube)
        self.thing.update_tag()
        graph = bpy.context.evaluated_depsgraph_get()
        found = sorted(tuple(one.matrix_world.translation) + tuple(one.matrix_world.to_scale())
                       for one in graph.object_instances if one.is_instance)
        expected = values(self.thing.data)
        expected = sorted(tuple(P) + (radius,) * 3 for P, radius in zip(expected["P"], expected["radius"]))
        numpy.testing.assert_allclose(found, expected, rtol=1e-5)
