"""Runs Rapid and other programs on files in a folder of the test."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy

HERE = pathlib.Path(__file__).resolve().parent
RAPID = pathlib.Path(os.environ["RAPID_BUILD"]) / "bin/rapid"


def needs(program):
    """Returns a decorator that skips tests if a program is not installed."""
    return unittest.skipUnless(shutil.which(program), f"{program} is not installed")


def lua(value):
    """Returns an array, a list, a string or a number as a literal of Lua."""
    if isinstance(value, numpy.ndarray):
        value = value.tolist()
    if isinstance(value, list):
        return "{" + ", ".join(map(lua, value)) + "}"
    return json.dumps(value, ensure_ascii=False)


class ExchangeTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def run_program(self, *command):
        done = subprocess.run(list(map(str, command)), cwd=self.path, text=True, check=False, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, env={**os.environ, "HOME": str(self.path)})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def scene(self, text, *arguments):
        """Runs a scene, in which `rapid` is the module."""
        (self.path / "scene.lua").write_text('local rapid = require "rapid"\n' + text, encoding="utf-8")
        return self.run_program(RAPID, "run", "scene.lua", "--quiet", *arguments)

    def write_points(self, columns, *files):
        """Writes files of points with these columns, arrays by name."""
        table = ", ".join(f"{name} = {lua(column)}" for name, column in columns.items())
        outputs = [argument for file in files for argument in ("-o", file)]
        self.scene(f"return rapid.create {{ points = rapid.points.from {{ {table} }} }}", "-f", "1", *outputs)

    def read_points(self, file):
        """Returns the columns that Rapid reads from a file, by .npz, which NumPy reads."""
        self.scene(f"return rapid.create {{ points = rapid.points.read {lua(file)} }}", "-f", "1", "-o", "read.npz")
        with numpy.load(self.path / "read.npz") as arrays:
            return {name: arrays[name] for name in arrays.files}

    def births(self, source, count, start="surface", frame=1):
        """Returns the columns of points born at the end of a frame, of 1/24 s, on an object of the scene.

        v is the normal of the surface.
        """
        self.scene(f"""return rapid.create {{ fps = 24 }}
  :emit {{ source = {source}, from = "{start}", impulse = {{[{frame}] = {count}}}, birth = "end",
          inherit_velocity = 0, speed = 1 }} :solve {{}}""", "-f", str(frame), "-o", "born.npz")
        with numpy.load(self.path / "born.npz") as arrays:
            return {name: arrays[name] for name in arrays.files}

    def blender(self, script, **given):
        """Runs a function of blender_scripts.py in Blender, and returns its result."""
        (self.path / "given.json").write_text(json.dumps(given), encoding="utf-8")
        output = self.run_program("blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                                  HERE / "blender_scripts.py", "--", script, self.path)
        result = self.path / "result.json"
        self.assertTrue(result.exists(), output)
        return json.loads(result.read_text(encoding="utf-8"))


def curves():
    """Returns the positions of five points, and the numbers of their curves."""
    return numpy.arange(15).reshape(5, 3) / 4, [0, 0, 0, 1, 1]


def colour_test_points(count=7):
    """Returns columns of points with colours whose bytes are exact."""
    random = numpy.random.default_rng(3)

    def single(array):
        return array.astype(numpy.float32).astype(float)
    return {"P": single(random.uniform(-5, 5, (count, 3))), "v": single(random.uniform(-1, 1, (count, 3))),
            "Cd": single(random.integers(0, 256, (count, 3)) / 255),
            "Alpha": single(random.integers(0, 256, count) / 255), "N": single(random.uniform(-1, 1, (count, 3)))}
