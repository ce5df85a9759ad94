"""The shots of graphs/blender: the claims in the headers of their scenes."""
import pathlib
import sys

import bpy
import numpy

from scenes import Case, values

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "graphs/blender"))


class Shots(Case):
    def test_rain_stays_out_of_the_car_which_carries_droplets_along(self):
        import rain
        rain.main(self.folder / "rain.blend")
        self.scene = bpy.context.scene
        outputs = {one.name: one.object for one in bpy.data.objects["Rain"].rapid.outputs}
        for frame in (20, 40, 60):
            self.scene.frame_set(frame)
            drops, droplets = values(outputs["drops"].data), values(outputs["droplets"].data)
            self.assertGreater(len(drops["P"]), 3000)
            self.assertGreaterEqual(drops["P"][:, 2].min(), -1e-4)
            body = drops["P"] - numpy.array(bpy.data.objects["Body"].location)
            within = (numpy.abs(body) < numpy.array((3.9, 1.6, 0.55)) / 2 - 0.05).all(1)
            self.assertEqual(within.sum(), 0)
            self.assertGreater((droplets["velocity"][:, 0] > 2).sum(), 300)
