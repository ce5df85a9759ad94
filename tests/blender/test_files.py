"""Saving, loading, moving, linking and undoing a .blend with a simulation."""
import shutil

import bpy
import numpy

from rapid_blender import bake, handlers
from scenes import EMIT, Case, added, files_of, in_new_process, moved, values


class Files(Case):
    def setUp(self):
        super().setUp()
        emitter = moved(added("ico_sphere", radius=0.3), (1, (0, 0, 2)), (8, (2, 1, 3)))
        self.thing = self.simulation(EMIT, emitter=emitter)
        self.bake(self.thing)
        self.expected = self.points(self.thing, 8)["P"]

    def reopened(self, path):
        bpy.ops.wm.open_mainfile(filepath=str(path))
        self.scene = bpy.context.scene
        return bpy.data.objects["Rapid"]

    def test_a_saved_file_has_no_points_and_shows_them_when_it_is_opened(self):
        self.thing.rapid.parameters["rate"].value = 10000
        bpy.ops.rapid.bake(last=60)
        self.scene.frame_set(60)
        count = len(self.thing.data.vertices)
        self.assertGreater(count, 20000)
        bpy.ops.wm.save_mainfile(compress=False)
        self.assertEqual(len(self.thing.data.vertices), count)
        self.assertLess(self.blend.stat().st_size, 1.2e6)
        thing = self.reopened(self.blend)
        self.assertEqual(len(thing.data.vertices), count)

    def test_a_moved_folder_keeps_its_bake(self):
        bpy.ops.wm.save_mainfile()
        moved_folder = self.folder.with_name(self.folder.name + "_moved")
        shutil.copytree(self.folder, moved_folder, copy_function=shutil.copy2)
        self.addCleanup(shutil.rmtree, moved_folder)
        shutil.rmtree(self.folder / "rapid")
        thing = self.reopened(moved_folder / "shot.blend")
        numpy.testing.assert_array_equal(self.points(thing, 8)["P"], self.expected)
        self.bake(thing)
        numpy.testing.assert_array_equal(self.points(thing, 8)["P"], self.expected)

    def test_the_first_save_moves_the_bake_beside_the_file(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.scene.frame_end = 8
        thing = self.simulation(EMIT, emitter=added("cube"))
        self.bake(thing)
        expected = self.points(thing, 8)["P"]
        (self.folder / "new").mkdir()
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "new/first.blend"))
        self.assertEqual(bake.folder_of(thing), self.folder / "new/rapid/Rapid")
        numpy.testing.assert_array_equal(self.points(thing, 8)["P"], expected)

    def test_a_linked_simulation_shows_the_bake_of_its_library(self):
        bpy.ops.wm.save_mainfile()
        other = self.folder / "other"
        other.mkdir()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(other / "other.blend"))
        with bpy.data.libraries.load(str(self.blend), link=True) as (_, into):
            into.objects = ["Rapid"]
        self.scene = bpy.context.scene
        self.scene.collection.objects.link(into.objects[0])
        numpy.testing.assert_array_equal(self.points(into.objects[0], 8)["P"], self.expected)
        self.assertFalse(bake.folder_of(into.objects[0]).is_relative_to(other))

    def test_an_override_is_a_simulation_of_its_own(self):
        bpy.ops.wm.save_mainfile()
        other = self.folder / "other"
        other.mkdir()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(other / "other.blend"))
        with bpy.data.libraries.load(str(self.blend), link=True) as (_, into):
            into.objects = ["Rapid"]
        self.scene = bpy.context.scene
        self.scene.frame_end = 8
        thing = into.objects[0].override_create(remap_local_usages=True)
        self.scene.collection.objects.link(thing)
        self.scene.collection.objects.link(thing.rapid.inputs["emitter"].object)
        self.bake(thing)
        self.assertEqual(bake.folder_of(thing), other / "rapid/Rapid")
        numpy.testing.assert_array_equal(self.points(thing, 8)["P"], self.expected)
        bpy.ops.wm.save_mainfile()
        thing = self.reopened(other / "other.blend")
        self.assertTrue(thing.override_library)
        numpy.testing.assert_array_equal(self.points(thing, 8)["P"], self.expected)

    def test_undo_shows_the_points_of_the_frame(self):
        self.scene.frame_set(3)
        bpy.ops.ed.undo_push(message="frame 3")
        self.scene.frame_set(8)
        bpy.ops.ed.undo_push(message="frame 8")
        bpy.ops.ed.undo()
        thing = bpy.data.objects["Rapid"]
        frame = bpy.context.scene.frame_current
        self.assertEqual(frame, 3)
        with numpy.load(bake.points_files(thing, frame)["main"]) as arrays:
            self.assertEqual(len(thing.data.vertices), len(arrays["P"]))

    def test_scrubbing_shows_each_frame_and_nothing_before_the_start(self):
        counts = {frame: len(self.points(self.thing, frame)["P"]) for frame in (8, 2, 5, 1, 7, 0)}
        for frame in (2, 5, 7, 8):
            with numpy.load(bake.points_files(self.thing, frame)["main"]) as arrays:
                self.assertEqual(counts[frame], len(arrays["P"]))
        self.assertEqual((counts[1], counts[0]), (0, 0))

    def test_a_frame_beyond_the_bake_keeps_the_points_and_is_reported(self):
        self.scene.frame_set(9)
        numpy.testing.assert_array_equal(values(self.thing.data)["P"], self.expected)
        self.assertIn("frame 9 is not baked", str(handlers.frame_problems["Rapid"]))

    def test_free_removes_the_files_and_the_points(self):
        bpy.ops.rapid.free()
        self.assertFalse(bake.folder_of(self.thing).exists())
        self.assertEqual(len(self.thing.data.vertices), 0)


class Library(Case):
    def test_playback_needs_no_library(self):
        thing = self.simulation(EMIT, emitter=added("cube"))
        self.bake(thing)
        count = len(self.points(thing, 8)["P"])
        bpy.ops.wm.save_mainfile()
        said = in_new_process(self.blend, environment={"RAPID_LIBRARY": "/nowhere/librapid_host.so"}, code="""
bpy.context.scene.frame_set(8)
thing = bpy.data.objects["Rapid"]
print("COUNT", len(thing.data.vertices))
bpy.context.view_layer.objects.active = thing
try:
    bpy.ops.rapid.bake()
except RuntimeError as error:
    print("REFUSED", error)
""").stdout
        self.assertIn(f"COUNT {count}", said)
        self.assertRegex(said, "REFUSED .*cannot be loaded: /nowhere/librapid_host.so")
