"""Blender reads the files of Rapid, and Rapid those of Blender."""
import math

import numpy

from programs import ExchangeTest, colour_test_points, curves, lua, needs


def farthest(a, b):
    """Returns the largest distance of a point of either set from the other set."""
    apart = numpy.linalg.norm(numpy.asarray(a)[:, None] - numpy.asarray(b)[None], axis=2)
    return max(apart.min(0).max(), apart.min(1).max())


@needs("blender")
class ImportTest(ExchangeTest):
    def test_ply_has_its_positions_and_colours(self):
        points = colour_test_points()
        self.write_points(points, "a.ply")
        read = self.blender("import_ply")
        numpy.testing.assert_array_equal(read["P"], points["P"])
        self.assertEqual(read["edges"], [])
        self.assertEqual(read["types"], ["B"] * 4)
        numpy.testing.assert_allclose(numpy.array(read["colours"]) / 255,
                                      numpy.column_stack((points["Cd"], points["Alpha"])), atol=1e-6)

    def test_curves_are_edges_in_ply_and_obj(self):
        P, curve = curves()
        self.write_points({"P": P, "curve": curve}, "a.ply", "a.obj")
        for name in ("import_ply", "import_obj"):
            read = self.blender(name)
            numpy.testing.assert_allclose(read["P"], P, atol=1e-6)
            self.assertEqual(sorted(map(sorted, read["edges"])), [[0, 1], [1, 2], [3, 4]], name)

    def test_vdb_has_its_volume(self):
        radius, voxel = 0.75, 0.05
        self.scene(f'rapid.levelset.sphere {{ radius = {radius}, voxel = {voxel} }}:write "a.vdb"\n'
                   "return rapid.create {}", "-f", "1")
        read = self.blender("import_vdb")
        self.assertEqual(read["grids"], [["surface", "FLOAT"]])
        # Blender's box is that of the leaves of 8 x 8 x 8 voxels.
        reach = radius / voxel + 3
        low, high = 8 * math.floor(-reach / 8) * voxel, (8 * math.ceil(reach / 8) - 1) * voxel
        numpy.testing.assert_allclose([numpy.min(read["box"], 0), numpy.max(read["box"], 0)], [[low] * 3, [high] * 3],
                                      rtol=0, atol=1e-5)


    def test_rasterized_points_are_volumes_around_them(self):
        voxel, radius = 0.1, 0.3
        points = colour_test_points()
        self.scene(f"""local points = rapid.points.from {{ P = {lua(points["P"])} }}
return rapid.create {{ points = points }}
  :rasterize {{ file = "a.vdb", voxel = {voxel}, radius = {radius} }}""", "-f", "1")
        read = self.blender("import_vdb")
        self.assertIn(["density", "FLOAT"], read["grids"])
        low, high = numpy.min(read["box"], 0), numpy.max(read["box"], 0)
        leaf = 8 * voxel
        self.assertTrue(numpy.all((low <= points["P"].min(0)) & (low >= points["P"].min(0) - radius - 1.5 * leaf)), low)
        self.assertTrue(numpy.all((high >= points["P"].max(0)) & (high <= points["P"].max(0) + radius + 1.5 * leaf)),
                        high)


@needs("blender")
class ExportTest(ExchangeTest):
    def check_surface(self, source, figure, frame=1):
        """Checks births on vertices and on faces against the vertices, faces and centroid of Blender's mesh."""
        vertices = self.births(source, 2 * len(figure["P"]), "points", frame)["P"]
        self.assertLess(farthest(vertices, figure["P"]), 1e-5)
        count = 4000
        births = self.births(source, count, "surface", frame)["P"]
        distances = self.blender("distances", triangles=figure["triangles"], P=figure["P"], births=births.tolist())
        self.assertLess(max(distances), 1e-5)
        # The mean of uniform births is within five standard deviations of the centroid.
        off = numpy.abs(births.mean(0) - figure["centroid"])
        self.assertTrue(numpy.all(off < 5 * births.std(0) / count**0.5), off)

    def test_obj_ply_stl_and_gltf_have_blenders_surface(self):
        figure = self.blender("export_mesh")
        turn = numpy.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # from z up to y up, of row vectors
        for source, map_ in (('"figure.obj"', numpy.eye(3)), ('"figure.ply"', numpy.eye(3)),
                             ('"figure.stl"', numpy.eye(3)), ('"figure.gltf"', turn),
                             ('"figure.stl", { up = "z", unit = 0.01 }', 0.01 * turn)):
            with self.subTest(source):
                mapped = {name: (numpy.array(figure[name]) @ map_).tolist() for name in ("P", "centroid")}
                self.check_surface(f"rapid.mesh.read({source})", {**figure, **mapped})

    def test_normals_of_a_mirrored_prism_point_outwards(self):
        figure = self.blender("export_mirrored")
        turn = numpy.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        for source, map_ in (("prism.glb", turn), ("prism.obj", numpy.eye(3)), ("prism.stl", numpy.eye(3))):
            with self.subTest(source):
                mapped = {name: (numpy.array(figure[name]) @ map_).tolist() for name in ("P", "centroid")}
                self.check_surface(f'rapid.mesh.read "{source}"', {**figure, **mapped})
                births = self.births(f'rapid.mesh.read "{source}"', 500)
                numpy.testing.assert_allclose(numpy.linalg.norm(births["v"], axis=1), 1, atol=1e-5)
                outwards = births["P"] - numpy.mean(mapped["P"], 0)
                self.assertGreater(numpy.sum(outwards * births["v"], 1).min(), 0)

    def test_colours_of_ply_are_blenders(self):
        figure = self.blender("export_mesh")
        births = self.births('rapid.mesh.read "figure.ply"', 2 * len(figure["P"]), "points")
        apart = numpy.linalg.norm(births["P"][:, None] - numpy.array(figure["P"])[None], axis=2)
        expected = numpy.array(figure["Cd"])[apart.argmin(1)]
        numpy.testing.assert_allclose(births["Cd"], expected, rtol=0, atol=0.51 / 255)

    def test_a_skin_and_shape_keys_of_gltf_are_blenders_in_each_frame(self):
        frames = [0, 7, 24]
        for frame, figure in zip(frames, self.blender("export_character", frames=frames)):
            with self.subTest(frame):
                # Frame 1 of Rapid is time 0.
                self.check_surface('rapid.mesh.read("figure.glb", { animation = "" })', figure, frame + 1)
