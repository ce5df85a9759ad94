"""NumPy reads .npz, and writes .npz and .npy that Rapid reads."""
import numpy

from programs import ExchangeTest, colour_test_points


class NumpyTest(ExchangeTest):
    def test_arrays_of_npz_are_the_columns_of_the_scene(self):
        columns = {"P": numpy.array([[1, 2, 3], [-4, 0.5, 1e-3]]), "heat": numpy.array([0.25, -7]),
                   "name": ["leaf", "Gr\u00fc\u00dfe"], "Cd": numpy.array([[1, 0, 0.5], [0, 1, 0]])}
        self.write_points(columns, "a.npz")
        with numpy.load(self.path / "a.npz") as arrays:
            numpy.testing.assert_array_equal(arrays["P"], columns["P"].astype(numpy.float32))
            numpy.testing.assert_array_equal(arrays["Cd"], columns["Cd"].astype(numpy.float32))
            numpy.testing.assert_array_equal(arrays["heat"], columns["heat"].astype(numpy.float32))
            numpy.testing.assert_array_equal(arrays["name"], columns["name"])
            numpy.testing.assert_array_equal(arrays["id"], [0, 1])
            self.assertEqual(arrays["P"].dtype, numpy.float32)
            self.assertEqual(arrays["id"].dtype, numpy.int64)

    def test_csv_is_a_table_of_the_columns(self):
        points = colour_test_points()
        self.write_points(points, "a.csv")
        table = numpy.genfromtxt(self.path / "a.csv", delimiter=",", names=True, dtype=None)
        for name in ("P", "v", "Cd", "N"):
            read = numpy.column_stack([table[name + axis] for axis in "xyz"])
            numpy.testing.assert_array_equal(read.astype(numpy.float32), points[name])
        numpy.testing.assert_array_equal(table["Alpha"].astype(numpy.float32), points["Alpha"])

    def test_npz_of_other_types_and_orders_is_read(self):
        P = numpy.random.default_rng(1).uniform(-1, 1, (50, 3))
        numpy.savez_compressed(self.path / "a.npz", P=numpy.asfortranarray(P.astype(">f8")),
                               v=P.astype(numpy.float16), hits=numpy.arange(50, dtype=">i2"), name=["a", "bc"] * 25)
        read = self.read_points("a.npz")
        numpy.testing.assert_array_equal(read["P"], P.astype(numpy.float32))
        numpy.testing.assert_array_equal(read["v"], P.astype(numpy.float16).astype(numpy.float32))
        numpy.testing.assert_array_equal(read["hits"], numpy.arange(50))
        numpy.testing.assert_array_equal(read["name"], ["a", "bc"] * 25)

    def test_npy_is_read_as_positions(self):
        P = numpy.random.default_rng(2).uniform(-1, 1, (20, 3))
        for array in (P, P.astype(">f4"), numpy.asfortranarray(P)):
            numpy.save(self.path / "a.npy", array)
            numpy.testing.assert_array_equal(self.read_points("a.npy")["P"], array.astype(numpy.float32))
