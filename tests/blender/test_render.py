"""Renders with Cycles: the points of the right frame, motion blur, and frames that are not baked."""

import bpy
import numpy

from rapid_blender import node_groups
from scenes import EMIT, Case, added, in_new_process

# A point of 10 cm at 96 m/s, in the middle of the picture at frame 5. A frame is 4 m, and a metre is 10 pixels.
FAST = """local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{-16, 0, 0}}, v = {{96, 0, 0}}, pscale = {0.1} } } :solve {}
"""
PIXELS = 10  # per metre


class Blurred(Case):
    def setUp(self):
        super().setUp()
        scene, render = self.scene, self.scene.render
        self.thing = self.simulation(FAST)
        self.bake(self.thing)
        scene.frame_set(5)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.data.type, camera.data.ortho_scale = "ORTHO", 64 / PIXELS
        camera.location, camera.rotation_euler = (0, -10, 0), (numpy.pi / 2, 0, 0)
        scene.collection.objects.link(camera)
        scene.camera, scene.world = camera, bpy.data.worlds.new("black")
        scene.world.color = 0, 0, 0
        scene.view_settings.view_transform = "Standard"
        render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 16, False
        render.resolution_x, render.resolution_y, render.resolution_percentage = 64, 36, 100
        render.use_motion_blur, render.motion_blur_shutter = True, 0.5
        render.filepath = str(self.folder / "picture.png")
        self.material = bpy.data.materials.new("light")
        self.material.use_nodes = True
        nodes = self.material.node_tree.nodes
        light = nodes.new("ShaderNodeEmission")
        light.inputs["Strength"].default_value = 100
        self.material.node_tree.links.new(light.outputs[0], nodes["Material Output"].inputs["Surface"])
        node_groups.show(self.thing, node_groups.POINTS, Material=self.material)

    def streak(self):
        """Returns the first and last column of the picture that the point has reached, and its row."""
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(self.scene.render.filepath)
        pixels = numpy.array(image.pixels[:]).reshape(36, 64, 4)[:, :, 0] > 0.02
        bpy.data.images.remove(image)
        columns, rows = numpy.flatnonzero(pixels.any(0)), numpy.flatnonzero(pixels.any(1))
        return columns[0], columns[-1] + 1, rows.mean() + 0.5

    def assert_streak(self, middle, metres):
        """The ends of a streak with its point, to one pixel and a half."""
        first, last, row = self.streak()
        self.assertAlmostEqual(row, 18, delta=1)
        self.assertAlmostEqual((first + last) / 2, 32 + PIXELS * middle, delta=1.5)
        self.assertAlmostEqual(last - first, PIXELS * (metres + 0.2), delta=2)

    def test_a_point_cloud_is_blurred_along_its_velocity(self):
        self.assert_streak(0, 2)

    def test_twice_the_shutter_is_twice_the_streak(self):
        self.scene.render.motion_blur_shutter = 1
        self.assert_streak(0, 4)

    def test_without_blur_the_point_is_at_its_position(self):
        self.scene.render.use_motion_blur = False
        self.assert_streak(0, 0)

    def test_a_shutter_that_opens_on_the_frame_blurs_what_follows(self):
        self.scene.cycles.motion_blur_position = "START"
        self.assert_streak(1, 2)

    def test_a_shutter_that_closes_on_the_frame_blurs_what_precedes(self):
        self.scene.cycles.motion_blur_position = "END"
        self.assert_streak(-1, 2)

    def test_instances_are_blurred(self):
        ball = added("uv_sphere", radius=1, location=(0, 0, 50))
        ball.data.materials.append(self.material)
        node_groups.show(self.thing, node_groups.INSTANCES, Object=ball)
        self.assert_streak(0, 2)

    def test_realized_instances_are_blurred(self):
        ball = added("uv_sphere", radius=1, location=(0, 0, 50))
        ball.data.materials.append(self.material)
        node_groups.show(self.thing, node_groups.INSTANCES, Object=ball)
        tree = bpy.data.node_groups.new("realize", "GeometryNodeTree")
        tree.inputs.new("NodeSocketGeometry", "Geometry")
        tree.outputs.new("NodeSocketGeometry", "Geometry")
        nodes = [tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeRealizeInstances", "NodeGroupOutput")]
        for before, after in zip(nodes, nodes[1:]):
            tree.links.new(before.outputs[0], after.inputs[0])
        self.thing.modifiers.new("Realize", "NODES").node_group = tree
        self.assert_streak(0, 2)

    def test_a_render_leaves_the_frame_of_the_viewport(self):
        self.scene.frame_set(4)
        self.streak()
        self.assertEqual(self.scene.frame_current, 4)
        self.assertAlmostEqual(self.thing.data.vertices[0].co.x, -4, 4)


class CommandLine(Case):
    def setUp(self):
        super().setUp()
        self.thing = self.simulation(EMIT, emitter=added("cube"))
        self.bake(self.thing, last=4)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        self.scene.collection.objects.link(camera)
        self.scene.camera, self.scene.render.engine = camera, "CYCLES"
        self.scene.cycles.samples, self.scene.cycles.use_denoising = 1, False
        self.scene.render.resolution_x, self.scene.render.resolution_y = 16, 9
        self.scene.render.filepath = f"{self.folder}/pictures/"
        bpy.ops.wm.save_mainfile()

    def rendered(self, *options):
        """Returns the status, the output, and the frames that were written."""
        done = in_new_process(self.blend, arguments=options)
        return done.returncode, done.stdout, sorted(path.stem for path in self.folder.glob("pictures/*.png"))

    def test_an_animation_is_rendered_from_the_bake(self):
        status, said, frames = self.rendered("--frame-start", "2", "--frame-end", "4", "--render-anim")
        self.assertEqual((status, frames), (0, ["0002", "0003", "0004"]), said)

    def test_a_frame_that_is_not_baked_ends_the_render_with_status_1(self):
        status, said, frames = self.rendered("--frame-start", "4", "--frame-end", "6", "--render-anim")
        self.assertEqual((status, frames), (1, ["0004"]), said)
        self.assertIn("Rapid: frame 5 is not baked", said)

    def test_a_frame_of_other_settings_ends_the_render_with_status_1(self):
        self.thing.rapid.parameters["rate"].value = 7
        bpy.ops.wm.save_mainfile()
        status, said, frames = self.rendered("--render-frame", "3")
        self.assertEqual((status, frames), (1, []), said)
        self.assertIn("frame 3 was baked with other settings", said)

    def test_a_simulation_that_renders_do_not_show_needs_no_bake(self):
        self.thing.hide_render = True
        bpy.ops.wm.save_mainfile()
        self.assertEqual(self.rendered("--render-frame", "6")[0], 0)
