"""The loaders of three.js read .ply and .obj."""
import json
import pathlib
import unittest

import numpy

from programs import HERE, ExchangeTest, colour_test_points, curves, needs

THREE = pathlib.Path("/usr/share/javascript/three")


@needs("node")
@unittest.skipUnless((THREE / "examples/jsm/loaders/PLYLoader.js").exists(), "three.js is not installed")
class ThreeTest(ExchangeTest):
    def setUp(self):
        super().setUp()
        # Node takes .js for a module only in a package that says so.
        (self.path / "three").mkdir()
        for part in ("build", "examples"):
            (self.path / "three" / part).symlink_to(THREE / part)
        (self.path / "package.json").write_text('{"type": "module"}', encoding="utf-8")

    def load(self, file):
        """Returns the attributes of a file's only geometry, of three numbers per vertex."""
        printed = self.run_program("node", "--preserve-symlinks", HERE / "three_loaders.mjs",
                                   self.path / "three/examples/jsm/loaders", file)
        [attributes] = json.loads(printed)
        return {name: numpy.array(numbers).reshape(-1, 3) for name, numbers in attributes.items()}

    def test_ply_has_its_positions_normals_and_colours(self):
        columns = colour_test_points()
        self.write_points(columns, "a.ply")
        read = self.load("a.ply")
        numpy.testing.assert_array_equal(read["position"], columns["P"])
        numpy.testing.assert_array_equal(read["normal"], columns["N"])
        numpy.testing.assert_allclose(read["color"], columns["Cd"], atol=1e-6)

    def test_curves_of_obj_are_lines(self):
        P, curve = curves()
        self.write_points({"P": P, "curve": curve}, "a.obj")
        numpy.testing.assert_allclose(self.load("a.obj")["position"], P, atol=1e-6)
