"""Runs the tests of a file in Blender: blender -b -P inside.py -- FILE PATTERN"""
import importlib
import pathlib
import sys
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "bindings/blender"), str(ROOT / "bindings/python"), str(ROOT / "tests/blender")]

import rapid_blender  # noqa: E402


class Timed(unittest.TextTestResult):
    def startTest(self, test):
        super().startTest(test)
        self._started = time.monotonic()

    def stopTest(self, test):
        super().stopTest(test)
        print(f"{time.monotonic() - self._started:.3f} s: {test.id().rpartition('.')[2].replace('_', ' ')}", flush=True)


def main():
    file, pattern = sys.argv[sys.argv.index("--") + 1:]
    rapid_blender.register()
    loader = unittest.TestLoader()
    loader.testNamePatterns = [f"*{pattern}*"] if pattern else None
    suite = loader.loadTestsFromModule(importlib.import_module(pathlib.Path(file).stem))
    result = unittest.TextTestRunner(resultclass=Timed, verbosity=0).run(suite)
    failed = len(result.failures) + len(result.errors)
    skipped = len(result.skipped)
    for test, reason in result.skipped:
        print(f"skipped: {test.id().rpartition('.')[2]}: {reason}")
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped", flush=True)


main()
