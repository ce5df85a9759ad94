"""Bakes: the same points as `rapid run` on the same meshes as files; resumed, stopped and stale bakes."""
import json

import bpy
import numpy

from rapid_blender import bake, handlers
from scenes import COLLIDE, EMIT, Case, added, bent, files_of, grown, moved


class SameAsFiles(Case):
    def test_a_moving_emitter_gives_the_points_of_the_same_meshes_as_files(self):
        emitter = moved(added("ico_sphere", radius=0.3), (1, (0, 0, 2)), (8, (2, 1, 3)))
        thing = self.simulation(EMIT, emitter=emitter)
        self.bake(thing)
        points = self.points(thing, 8)
        self.assert_same_points(points, self.run_on_files(EMIT, (1, 8), emitter=emitter))
        numpy.testing.assert_allclose(points["velocity"][-20:, :2].mean(0), numpy.array([2, 1]) * 24 / 7, rtol=1e-4)

    def test_an_armature_as_collider_gives_the_points_of_the_same_meshes_as_files(self):
        body = bent(added("cube", size=1.2), (1, 8))
        thing = self.simulation(COLLIDE, body=body)
        self.bake(thing)
        self.assert_same_points(self.points(thing, 8), self.run_on_files(COLLIDE, (1, 8), body=body))

    def test_shape_keys_below_modifiers_give_the_points_of_the_same_meshes_as_files(self):
        body = grown(added("cube", size=1.2), (1, 8))
        body.modifiers.new("Smooth", "SUBSURF").levels = 1
        thing = self.simulation(COLLIDE, body=body)
        self.bake(thing)
        self.assert_same_points(self.points(thing, 8), self.run_on_files(COLLIDE, (1, 8), body=body))

    def test_cloth_gives_the_points_of_the_same_meshes_as_files(self):
        sheet = added("grid", size=2, x_subdivisions=6, y_subdivisions=6, location=(0, 0, 2))
        sheet.modifiers.new("Cloth", "CLOTH")
        for frame in range(0, 10):  # Blender simulates cloth forward
            self.scene.frame_set(frame)
        thing = self.simulation(EMIT, emitter=sheet)
        self.bake(thing)
        self.assert_same_points(self.points(thing, 8), self.run_on_files(EMIT, (1, 8), emitter=sheet))

    def test_a_remesh_that_changes_its_faces_is_the_level_set_of_each_frame(self):
        body = grown(added("cube", size=1.2), (1, 8))
        remesh = body.modifiers.new("Remesh", "REMESH")
        remesh.mode, remesh.voxel_size = "VOXEL", 0.2
        thing = self.simulation(COLLIDE, body=body)
        self.bake(thing)
        each = COLLIDE.replace('rapid.levelset.from_mesh(rapid.host "body", { voxel = 0.1 })',
                               "function(frame) return rapid.levelset.from_mesh(rapid.mesh.read("
                               '("body.%04d.ply"):format(frame.number)), { voxel = 0.1 }) end')
        self.assert_same_points(self.points(thing, 8), self.run_on_files(each, (1, 8), body=body))

    def test_the_frame_rate_and_first_frame_are_those_of_blender(self):
        self.scene.render.fps, self.scene.render.fps_base = 24, 1.001
        self.scene.frame_start, self.scene.frame_end = 1001, 1008
        emitter = moved(added("ico_sphere", radius=0.3), (1001, (0, 0, 2)), (1008, (2, 0, 2)))
        thing = self.simulation(EMIT, emitter=emitter)
        self.bake(thing)
        points = self.points(thing, 1008)
        numpy.testing.assert_allclose(points["velocity"][-20:, 0].mean(), 2 * 24 / 1.001 / 7, rtol=1e-4)
        self.assertEqual(len(points["id"]), int(500 * 7 * 1.001 / 24))
        self.assertAlmostEqual(json.loads((bake.folder_of(thing) / "bake.json").read_text())["fps"], 24 / 1.001, 5)

    def test_a_unit_of_a_centimetre_is_the_same_motion_in_metres(self):
        still = COLLIDE.replace('rapid.levelset.from_mesh(rapid.host "body", { voxel = 0.1 })',
                                'rapid.levelset.from_mesh(rapid.host "body", { voxel = 0.1 })')
        metres = self.simulation(still, body=added("cube", size=1.2))
        self.bake(metres)
        expected = self.points(metres, 8)
        self.scene.unit_settings.scale_length = 0.01
        metres.rapid.inputs["body"].object.scale = 100, 100, 100
        self.bake(metres)
        points = self.points(metres, 8)
        for name in ("P", "velocity"):
            numpy.testing.assert_allclose(points[name], 100 * expected[name], rtol=2e-5, atol=2e-4)


class Continued(Case):
    def setUp(self):
        super().setUp()
        self.emitter = moved(added("ico_sphere", radius=0.3), (1, (0, 0, 2)), (8, (2, 1, 3)))
        self.thing = self.simulation(EMIT, emitter=self.emitter)

    def test_a_second_bake_computes_nothing(self):
        self.bake(self.thing)
        before = files_of(self.thing)
        self.assertEqual(len(before), 8)
        self.bake(self.thing)
        self.assertEqual(files_of(self.thing), before)

    def test_a_bake_that_is_stopped_continues_with_the_same_points(self):
        self.scene.frame_end = 200
        self.thing.rapid.parameters["rate"].value = 3000
        self.bake(self.thing)
        expected = self.points(self.thing, 200)
        bpy.ops.rapid.free()
        self.assertEqual(files_of(self.thing), {})
        stopped = bake.Bake(self.thing, self.scene, 200)
        for what, _ in stopped.steps():
            if what == "frames":
                stopped.stop()
        before = files_of(self.thing)
        self.assertLess(len(before), 200)
        self.assertGreater(len(before), 0)
        self.bake(self.thing)
        after = files_of(self.thing)
        self.assertEqual({name: after[name] for name in before}, before)
        for name, array in self.points(self.thing, 200).items():
            numpy.testing.assert_array_equal(array, expected[name])

    def test_the_frames_up_to_the_current_one_can_be_run(self):
        self.scene.frame_set(5)
        bpy.ops.rapid.run()
        self.assertEqual(len(files_of(self.thing)), 5)
        before = files_of(self.thing)
        self.bake(self.thing)
        self.assertEqual({name: files_of(self.thing)[name] for name in before}, before)

    def test_frames_of_other_settings_are_not_shown(self):
        self.bake(self.thing)
        expected = self.points(self.thing, 8)
        self.thing.rapid.parameters["rate"].value = 100
        self.scene.frame_set(7)
        self.assertIn("baked with other settings", str(handlers.frame_problems[self.thing.name_full]))
        self.thing.rapid.parameters["rate"].value = 500
        numpy.testing.assert_array_equal(self.points(self.thing, 8)["P"], expected["P"])
        self.thing.rapid.parameters["rate"].value = 100
        self.bake(self.thing)
        self.assertEqual(len(self.points(self.thing, 8)["id"]), 29)

    def test_a_changed_input_removes_the_frames_of_the_one_before(self):
        self.bake(self.thing)
        self.emitter.scale = 2, 2, 2
        self.bake(self.thing, last=4)
        self.assertEqual(len(files_of(self.thing)), 4)

    def test_a_module_that_changes_is_another_run(self):
        (self.folder / "speed.lua").write_text("return 1")
        self.thing.rapid.text.from_string(EMIT.replace("birth =", 'speed = require "speed", birth ='))
        self.bake(self.thing)
        before = self.points(self.thing, 8)["P"]
        (self.folder / "speed.lua").write_text("return 2")
        self.bake(self.thing)
        self.assertGreater(numpy.abs(self.points(self.thing, 8)["P"] - before).max(), 0.01)

    def test_two_simulations_in_a_file_are_two_bakes(self):
        other = self.simulation(EMIT, name="Other", emitter=added("cube"))
        self.bake(self.thing)
        self.bake(other)
        expected = self.points(other, 8)["P"]
        self.bake(self.thing)
        numpy.testing.assert_array_equal(self.points(other, 8)["P"], expected)
        self.assertNotEqual(bake.folder_of(self.thing), bake.folder_of(other))

    def test_an_object_that_is_removed_ends_its_bake_with_an_error(self):
        steps = bake.Bake(self.thing, self.scene, 8).steps()
        next(steps)
        bpy.data.objects.remove(self.thing)
        with self.assertRaisesRegex(Exception, "Rapid was removed during its bake"):
            for _ in steps:
                pass
        self.assertEqual(bake.Bake.running, {})
