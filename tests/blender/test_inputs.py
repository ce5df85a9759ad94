"""Blender's objects as inputs: the meshes, points and curves that Rapid sees, and the errors of the scene."""
import bpy
import numpy

from rapid_blender import handlers, inputs, source
from scenes import COLLIDE, EMIT, Case, added, moved

AT_POINTS = """local rapid = require "rapid"
return rapid.create { fps = 24 } :emit { source = rapid.host "places", impulse = { [2] = 6 } } :solve {}
"""


class Meshes(Case):
    def mesh(self, **filled):
        """Returns the positions and triangles of an input, in Rapid's space."""
        thing = self.simulation(EMIT)
        one = thing.rapid.inputs["emitter"]
        for name, value in filled.items():
            setattr(one, name, value)
        return inputs._mesh(one, bpy.context.evaluated_depsgraph_get(), 1.0)

    @staticmethod
    def volume(P, T):
        """Returns the enclosed volume, which is negative if the triangles face inwards."""
        a, b, c = (P[T[:, k]].astype(float) for k in range(3))
        return numpy.einsum("ij,ij->i", a, numpy.cross(b, c)).sum() / 6

    def test_a_mesh_keeps_its_volume_under_any_placement(self):
        cube = added("cube", size=1, location=(3, 1, 2), rotation=(0.3, 0.5, 0.7), scale=(1, 2, 3))
        P, T, _ = self.mesh(object=cube)
        self.assertAlmostEqual(self.volume(P, T), 6, 4)

    def test_the_triangles_of_a_mirrored_object_face_outwards(self):
        cube = added("cube", size=1)
        cube.scale.x = -1
        P, T, _ = self.mesh(object=cube)
        self.assertAlmostEqual(self.volume(P, T), 1, 4)

    def test_modifiers_are_evaluated(self):
        cube = added("cube", size=1)
        array = cube.modifiers.new("Array", "ARRAY")
        array.count, array.relative_offset_displace = 3, (2, 0, 0)
        P, T, _ = self.mesh(object=cube)
        self.assertAlmostEqual(self.volume(P, T), 3, 4)

    def test_all_objects_of_a_collection_are_one_mesh(self):
        collection = bpy.data.collections.new("Rocks")
        self.scene.collection.children.link(collection)
        for x in range(3):
            cube = added("cube", size=1, location=(2 * x, 0, 0))
            collection.objects.link(cube)
        P, T, _ = self.mesh(kind="COLLECTION", collection=collection)
        self.assertAlmostEqual(self.volume(P, T), 3, 4)

    def test_instances_of_an_object_are_part_of_its_mesh(self):
        cube = added("cube", size=1)
        plane = added("plane", size=4, location=(0, 0, 5))
        cube.parent, plane.instance_type = plane, "VERTS"
        P, T, _ = self.mesh(object=plane)
        self.assertEqual(len(P), 4 + 4 * 8)

    def test_text_and_metaballs_have_meshes(self):
        bpy.ops.object.metaball_add(radius=1)
        P, T, _ = self.mesh(object=bpy.context.object)
        self.assertGreater(self.volume(P, T), 0.5)

    def test_attributes_of_vertices_go_to_points(self):
        cube = added("cube", size=1, location=(0, 0, 2))
        heat = cube.data.attributes.new("heat", "FLOAT", "POINT")
        heat.data.foreach_set("value", [5] * 8)
        thing = self.simulation(EMIT, emitter=cube)
        self.bake(thing)
        numpy.testing.assert_allclose(self.points(thing, 8)["heat"], 5, rtol=1e-6)

    def test_an_object_that_blender_does_not_evaluate_is_an_error(self):
        cube = added("cube")
        thing = self.simulation(EMIT, emitter=cube)
        cube.hide_viewport = True
        self.assertIn("Cube is disabled in viewports", str(self.refused(thing)))
        cube.hide_viewport = False
        collection = bpy.data.collections.new("Excluded")
        self.scene.collection.children.link(collection)
        self.scene.collection.objects.unlink(cube)
        collection.objects.link(cube)
        bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
        self.assertIn("excluded from the view layer", str(self.refused(thing)))

    def test_an_object_that_is_only_hidden_is_read_with_its_modifiers(self):
        cube = added("cube", size=1)
        cube.modifiers.new("Array", "ARRAY").relative_offset_displace = 2, 0, 0
        cube.hide_render = True
        cube.hide_set(True)
        self.scene.frame_set(2)
        P, T, _ = self.mesh(object=cube)
        self.assertAlmostEqual(self.volume(P, T), 2, 4)

    def test_an_object_without_faces_is_an_error(self):
        cube = added("cube")
        thing = self.simulation(EMIT, emitter=cube)
        cube.vertex_groups.new(name="none")
        cube.modifiers.new("Mask", "MASK").vertex_group = "none"
        self.assertIn('input "emitter": Cube has no faces', str(self.refused(thing)))


class Others(Case):
    def test_vertices_without_faces_are_points(self):
        mesh = bpy.data.meshes.new("places")
        mesh.from_pydata([(0, 0, 1), (1, 0, 2), (0, 1, 3)], [], [])
        places = bpy.data.objects.new("places", mesh)
        self.scene.collection.objects.link(places)
        thing = self.simulation(AT_POINTS)
        thing.rapid.inputs["places"].object = places
        self.bake(thing)
        P = self.points(thing, 8)["P"]
        self.assertEqual(len(P), 6)
        self.assertEqual({tuple(numpy.round(one, 4)) for one in P}, {(0, 0, 1), (1, 0, 2), (0, 1, 3)})

    def test_an_empty_is_a_point_that_moves(self):
        bpy.ops.object.empty_add()
        empty = moved(bpy.context.object, (1, (0, 0, 0)), (8, (7, 0, 0)))
        thing = self.simulation(AT_POINTS.replace("impulse = { [2] = 6 }", "count = 1, inherit_velocity = 0"))
        thing.rapid.inputs["places"].object = empty
        self.bake(thing)
        found = self.points(thing, 8)
        self.assertGreater(len(set(numpy.round(found["P"][:, 0], 3))), 5)
        self.assertLessEqual(found["P"][:, 0].max(), 7.001)

    def test_a_curve_without_a_profile_is_a_curve(self):
        bpy.ops.curve.primitive_bezier_circle_add(radius=2)
        circle = bpy.context.object
        thing = self.simulation(EMIT, emitter=circle)
        self.bake(thing)
        distances = numpy.linalg.norm(self.points(thing, 2)["P"][:, :2], axis=1)
        self.assertGreater(len(distances), 10)
        numpy.testing.assert_allclose(distances, 2, atol=0.03)


class Declared(Case):
    def test_parameters_have_the_ranges_kinds_and_choices_of_their_hints(self):
        thing = self.simulation("""local rapid = require "rapid"
local n = rapid.param("n", 5, "births [0, 9]")
local positive = rapid.param("positive", 1.5, "m [0,]")
local plain = rapid.param("plain", 2, "see [the guide]")
local look = rapid.param("look", "rain", "what falls [rain | snow]")
local color = rapid.param("color", {1, 0, 0}, "of points [color]")
local at = rapid.param("at", {1, 2, 3}, "m")
local on = rapid.param("on", true, "whether it falls")
return rapid.create {} :emit { source = rapid.shape.sphere { center = at }, rate = n } :solve {}
""")
        found = {one.name: (one.kind, one.doc) for one in thing.rapid.parameters}
        self.assertEqual(found, {
            "n": ("NUMBER", "births"), "positive": ("NUMBER", "m"), "plain": ("NUMBER", "see [the guide]"),
            "look": ("CHOICE", "what falls"), "color": ("COLOR", "of points"), "at": ("VECTOR", "m"),
            "on": ("FLAG", "whether it falls")})
        ranges = {name: thing.rapid.parameters[name].id_properties_ui("value").as_dict() for name in ("n", "positive")}
        self.assertEqual((ranges["n"]["min"], ranges["n"]["max"], ranges["positive"]["min"]), (0, 9, 0))
        self.assertEqual(source.settings_of(thing), {})
        thing.rapid.parameters["look"].value = "snow"
        self.assertEqual(source.settings_of(thing), {"look": "snow"})

    def test_a_reload_keeps_values_and_forgets_what_the_scene_no_longer_declares(self):
        cube = added("cube")
        thing = self.simulation(EMIT, emitter=cube)
        thing.rapid.parameters["rate"].value = 77
        thing.rapid.text.from_string(EMIT.replace("500, ", "600, "))
        bpy.ops.rapid.reload()
        self.assertEqual((thing.rapid.parameters["rate"].value, thing.rapid.inputs["emitter"].object), (77, cube))
        thing.rapid.text.from_string(COLLIDE)
        bpy.ops.rapid.reload()
        self.assertEqual((thing.rapid.parameters.keys(), thing.rapid.inputs.keys()), ([], ["body"]))

    def test_a_default_that_was_not_changed_follows_the_scene(self):
        thing = self.simulation(EMIT)
        thing.rapid.text.from_string(EMIT.replace("500, ", "600, "))
        bpy.ops.rapid.reload()
        self.assertEqual(thing.rapid.parameters["rate"].value, 600)

    def test_a_mistake_has_its_file_line_and_node_and_opens_there(self):
        thing = self.simulation(EMIT)
        thing.rapid.text.from_string(EMIT.replace(":gravity {}", ":gravity { gg = 1 }"))
        with self.assertRaises(RuntimeError):
            bpy.ops.rapid.reload()
        problem = self.refused(thing)
        self.assertEqual((problem.line, problem.file), (5, str(self.folder / thing.rapid.text.name)))
        self.assertIn(f"{problem.file}:5:", str(problem))
        self.assertIn('unknown parameter "gg"', str(problem))
        bpy.ops.rapid.open_text(path=problem.file, line=problem.line)
        self.assertEqual(thing.rapid.text.current_line_index, 4)

    def test_a_mistake_on_the_first_line_shows_no_text_of_the_add_on(self):
        thing = self.simulation(EMIT)
        thing.rapid.text.from_string("local rapid = = 1")
        problem = self.refused(thing)
        self.assertEqual(problem.line, 1)
        self.assertNotIn("rapid_blender", str(problem).replace(problem.file, ""))

    def test_an_error_while_frames_are_computed_keeps_the_frames_before_it(self):
        thing = self.simulation(EMIT.replace(":gravity {}", ':points("stop", function(p, frame) '
                                             'if frame.number == 5 then p.v = p.v / 0 end end)'), emitter=added("cube"))
        problem = self.refused(thing)
        self.assertEqual((problem.node, problem.line), ("stop", 5))
        handlers.scene_problems.clear()
        self.assertGreater(len(self.points(thing, 4)["P"]), 0)

    def test_an_input_that_nothing_fills_is_named_with_its_line(self):
        problem = self.refused(self.simulation(EMIT))
        self.assertEqual(problem.line, 4)
        self.assertIn('rapid.host "emitter": no object is chosen', str(problem))

    def test_a_scene_in_a_file_is_read_relative_to_the_blend(self):
        (self.folder / "scenes").mkdir()
        (self.folder / "scenes/rain.lua").write_text(EMIT)
        thing = self.simulation(EMIT)
        thing.rapid.source, thing.rapid.file = "FILE", "//scenes/rain.lua"
        bpy.ops.rapid.reload()
        thing.rapid.inputs["emitter"].object = added("cube")
        self.bake(thing)
        self.assertGreater(len(self.points(thing, 8)["P"]), 0)
        thing.rapid.file = "//scenes/snow.lua"
        self.assertIn("scenes/snow.lua: the scene cannot be read", str(self.refused(thing)))
