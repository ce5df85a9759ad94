"""OpenVDB's own tools read .vdb."""
import re

import numpy

from programs import ExchangeTest, colour_test_points, needs


@needs("vdb_print")
class OpenvdbTest(ExchangeTest):
    def grid(self, file):
        """Returns the text that is printed of a file of one grid, its voxel size, and its active box in world space."""
        printed = self.run_program("vdb_print", "-l", file)
        voxel = float(re.search(r"voxel size: *([\d.e-]+)", printed)[1])
        corners = re.search(r"Bounding box of active voxels: *\[(.*?)\] -> \[(.*?)\]", printed).groups()
        return printed, voxel, voxel * numpy.array([list(map(int, corner.split(","))) for corner in corners])

    def test_points_are_in_the_box_of_their_voxels(self):
        points = colour_test_points(1000)
        self.write_points(points, "a.vdb")
        printed, voxel, box = self.grid("a.vdb")
        self.assertRegex(printed, r"Name: points\n")
        self.assertRegex(printed, r"Type: Tree_ptdataidx32")
        numpy.testing.assert_allclose(box, [points["P"].min(0), points["P"].max(0)], rtol=0, atol=voxel / 2 + 1e-6)

    def test_a_level_set_has_the_size_of_its_sphere(self):
        radius, voxel, half_width = 0.75, 0.05, 3
        self.scene(f'rapid.levelset.sphere {{ radius = {radius}, voxel = {voxel} }}:write "ball.vdb"\n'
                   "return rapid.create {}", "-f", "1")
        printed, size, box = self.grid("ball.vdb")
        self.assertRegex(printed, r"level set")
        self.assertAlmostEqual(size, voxel)
        reach = radius + half_width * voxel
        numpy.testing.assert_allclose(box, [[-reach] * 3, [reach] * 3], rtol=0, atol=1.01 * voxel)
