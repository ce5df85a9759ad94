"""The zip that `ninja rapid_blender` writes, installed and used by a Blender that knows nothing else of Rapid."""
import os
import pathlib
import subprocess
import zipfile

from scenes import EMIT, Case

ZIP = pathlib.Path(os.environ["RAPID_BUILD"]) / "rapid_blender.zip"

INSTALL = """
import bpy
bpy.ops.preferences.addon_install(filepath=ZIP)
bpy.ops.preferences.addon_enable(module="rapid_blender")
"""
USE = """
import bpy
bpy.ops.mesh.primitive_cube_add()
cube = bpy.context.object
bpy.ops.rapid.add()
thing = bpy.context.object
thing.rapid.text.from_string(TEXT)
bpy.ops.rapid.reload()
thing.rapid.inputs["emitter"].object = cube
bpy.ops.rapid.bake(last=3)
bpy.context.scene.frame_set(3)
from rapid_blender import library
print("FROM", library.load().__file__)
print("COUNT", len(thing.data.vertices))
bpy.ops.preferences.addon_disable(module="rapid_blender")
print("GONE", not hasattr(bpy.types.Object, "rapid"))
"""


class Zip(Case):
    def setUp(self):
        if not ZIP.exists():
            self.skipTest(f"{ZIP} is not there; build the target rapid_blender")
        super().setUp()

    def blender(self, *arguments):
        environment = {name: value for name, value in os.environ.items() if name != "RAPID_LIBRARY"}
        environment["BLENDER_USER_SCRIPTS"] = str(self.folder / "scripts")
        done = subprocess.run(["blender", "--background", "--factory-startup", *arguments], env=environment, text=True,
                              check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return done.stdout

    def test_it_is_installed_enabled_used_and_disabled(self):
        (self.folder / "scripts").mkdir()
        said = self.blender("--python-expr", f"ZIP, TEXT = {str(ZIP)!r}, {EMIT!r}\n" + INSTALL + USE)
        self.assertIn(f"FROM {self.folder}/scripts/addons/rapid_blender/lib/rapid/__init__.py", said)
        self.assertIn(f"COUNT {500 * 2 // 24}\n", said)
        self.assertIn("GONE True", said)

    def test_it_has_no_links_and_no_compiled_modules(self):
        with zipfile.ZipFile(ZIP) as archive:
            for one in archive.infolist():
                self.assertNotEqual(one.external_attr >> 28, 0o12, one.filename)  # a symbolic link
                self.assertNotIn("__pycache__", one.filename)
