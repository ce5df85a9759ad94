"""Random sequences of valid, wrong and hostile calls of the Python module, compared with a model of the open objects
and their frames. tests/scene/call_model.h does the same in C and C++.

    HOST_CALLS=24000 HOST_CALLS_SEED=7 tests/python/run build/test
"""
import ctypes
import math
import os
import random
import unittest

import numpy
from test_rapid import main, rapid

FALL = """
local rapid = require "rapid"
local height = rapid.param("height", 10, "m, of the drop")
return rapid.create { points = rapid.points.from { P = {{0, height, 0}, {1, height, 0}} } } :gravity {} :solve {}
"""

CALLS = int(os.environ.get("HOST_CALLS", 240 * int(os.environ.get("RAPID_TEST_SCALE", 1))))
SEED = int(os.environ.get("HOST_CALLS_SEED", 0))

# Errors of wrong and hostile calls: the library's, and Python's own for arguments that no call accepts.
REFUSALS = (rapid.Error, TypeError, ValueError, KeyError, AttributeError, OverflowError, ctypes.ArgumentError)


def fall(**options):
    return rapid.Scene("fall.lua", text=FALL, **options)


class Sequence:
    """The calls of one seed. `said` lists them for the failure message."""

    def __init__(self, test, seed):
        self.test, self.random, self.said = test, random.Random(seed), []
        self.scenes, self.frames, self.snapshots = [], [], []
        self.weights = {self.open: 1, self.close: 2, self.advance: 6, self.advance_to: 6, self.restart: 4, self.set: 1,
                        self.save: 5, self.restore: 5, self.cancel: 4, self.release: 6, self.attack: 12}

    def call(self):
        kind, = self.random.choices(list(self.weights), list(self.weights.values()))
        self.said.append(kind.__name__)
        if not self.scenes:
            return self.open()
        kind()

    def expect(self, kind, function, *arguments):
        """Calls a function. It must raise an Error of this kind, or none if kind is None."""
        try:
            result = function(*arguments)
        except rapid.Error as error:
            self.test.assertEqual(error.kind, kind, f"{self.said}: {error}")
            self.test.assertTrue(str(error))
            return None
        self.test.assertIsNone(kind, f"{self.said}: no error")
        return result

    def scene(self):
        return self.random.choice(self.scenes)

    def open(self):
        if len(self.scenes) < 4:
            self.scenes.append({"scene": fall(), "open": True, "next": 1, "height": 10, "set": 10, "cancelled": False})

    def close(self):
        one = self.scene()
        one["scene"].release()  # a second time is allowed
        one["open"] = False

    def begin(self, one):
        one.update(next=1, height=one["set"], cancelled=False)

    def compute(self, one, number, function, *arguments):
        kind = None
        if not one["open"] or number < one["next"]:
            kind = "wrong call"
        elif one["cancelled"]:
            kind, one["cancelled"] = "cancelled", False
        frame = self.expect(kind, function, *arguments)
        if kind is None:
            one["next"] = number + 1
            self.frames.append((frame, number, one["height"], frame["P"]))

    def advance(self):
        one = self.scene()
        self.compute(one, one["next"], one["scene"].advance)

    def advance_to(self):
        one, number = self.scene(), self.random.randrange(8)
        self.compute(one, number, one["scene"].advance_to, number)

    def restart(self):
        one = self.scene()
        self.expect(None if one["open"] else "wrong call", one["scene"].restart)
        if one["open"]:
            self.begin(one)

    def set(self):
        one, height = self.scene(), self.random.randrange(100)
        self.expect(None if one["open"] else "wrong call", lambda: one["scene"].set(height=height))
        if one["open"]:
            one["set"] = height
            self.begin(one)

    def save(self):
        one = self.scene()
        good = one["open"] and one["next"] > 1
        snapshot = self.expect(None if good else "wrong call", one["scene"].save)
        if good:
            self.snapshots.append((snapshot, one["next"], one["height"]))

    def restore(self):
        if not self.snapshots:
            return
        one, (snapshot, number, height) = self.scene(), self.random.choice(self.snapshots)
        self.expect(None if one["open"] else "wrong call", one["scene"].restore, snapshot)
        if one["open"]:
            self.begin(one)
            one.update(next=number, height=height)

    def cancel(self):
        one = self.scene()
        self.expect(None if one["open"] else "wrong call", one["scene"].cancel)
        one["cancelled"] = one["open"]

    def release(self):
        if self.frames:
            frame, *_ = self.frames[self.random.randrange(len(self.frames))]
            frame.release()  # arrays stay valid, and a second time is allowed

    def attack(self):
        one = self.scene()
        name, function = self.random.choice(hostile_calls(one["scene"], self.frames, self.snapshots))
        self.said[-1] = name
        with self.test.assertRaises(REFUSALS, msg=f"{self.said}") as caught:
            function()
        self.test.assertTrue(str(caught.exception), self.said)
        if getattr(caught.exception, "kind", "") == "cancelled":  # a picture, which computes shapes
            for other in self.scenes:
                if other["scene"] is self.frames[-1][0]._scene:
                    self.test.assertTrue(other["cancelled"], self.said)
                    other["cancelled"] = False
        if one["open"]:
            self.test.assertEqual(one["scene"].next_frame, one["next"], self.said)

    def check_arrays(self):
        for _, number, height, P in self.frames:
            t = (number - 1) / 24
            self.test.assertTrue(numpy.allclose(P[:, 1], height - 9.81 / 2 * t * t, atol=1e-4), self.said)


class Hostile:
    """Objects that imitate those of the module."""

    def __getattr__(self, name):
        return self

    def __len__(self):
        return 1 << 40


def hostile_calls(scene, frames, snapshots):
    """Returns (name, function) of calls that are refused and change nothing."""
    strings = ["", "none", "P.x", "\x1b[2J", "\udcff", "a\0b", None, 3, b"P", "n" * 100000]
    numbers = [2**64 + 2, -2**80, 1.5, math.nan, "2", None, [2]]
    paths = ["", "x", "x.none", "/dev/full/x.csv", "/dev/zero", "/", "a\0b"]
    all_calls = [("advance_to", lambda n=n: scene.advance_to(n)) for n in numbers]
    for text in strings:
        all_calls += [("set " + repr(text)[:20], lambda t=text: scene.set({t: 1})),
                      ("value " + repr(text)[:20], lambda t=text: scene.set(height=t if t != 3 else [3])),
                      ("points_after", lambda t=text: scene.points_after(t, 2)),
                      ("graph", lambda t=text: scene.graph(t))]
    for values in ({"solve.substeps": -1}, {"solve.substeps": math.nan}, {"none.none": 1}, {"height": object()},
                   {"height": [1, 2]}, {"height": 1j}, 7):
        all_calls.append((f"set {values}", lambda v=values: scene.set(v)))
    for thing in (None, 3, rapid.from_numpy, Hostile(), rapid.Shape(None), rapid.Shape(lambda P, gradient: 0, lower=(1,)),
                  rapid.Mesh([[0, 0, 0]], [[0, 1, 2]]), rapid.Mesh([[0, 0, 0]], [[-1, 0, 0]])):
        if isinstance(thing, rapid.Shape) and thing._distance is None:
            continue  # a callback that is not callable is an error of the frame
        all_calls.append((f"offer {thing}", lambda t=thing: scene.offer("thing", t)))
    for text in (None, 3, "", "return", "return 3", "error {}", "return (((", "\x1bLJ", "\udcff", "return ('x'):rep(1e15)"):
        all_calls.append((f"open {text!r}", lambda t=text: rapid.Scene("hostile.lua", text=t) if t is not None
                          else rapid.Scene("none.lua")))
    for options in ({"seed": -1}, {"seed": 2**64}, {"seed": "x"}, {"threads": -1}, {"threads": 2**40},
                    {"script_seconds": math.nan}, {"script_memory": -1}, {"memory": 2**70}, {"paths": 3}, {"set": 3},
                    {"nodes": [3]}, {"objects": {"x": 3}}, {"objects": 3}, {"unknown": 3}, {"log": 3}):
        if options.keys() != {"log"}:  # called only if there is something to log
            all_calls.append((f"options {options}", lambda o=options: fall(**o)))
    for array in ([1, 2, 3], numpy.zeros((2, 2)), "P", None, numpy.zeros((2, 3), complex), numpy.array([[object()] * 3])):
        all_calls.append(("from_numpy", lambda a=array: rapid.from_numpy(a)))
        all_calls.append(("Mesh", lambda a=array: rapid.Mesh(a, [[0, 1, 2], [2, 1, 0]][:1]).offer(None, "x", [])))
    all_calls += [("read " + path, lambda p=path: rapid.Frame.read(p)) for path in paths]
    all_calls += [("read snapshot " + path, lambda p=path: rapid.Snapshot.read(p)) for path in paths]
    all_calls += [("plugin " + path, lambda p=path: rapid.Scene.load_plugin(p)) for path in paths[1:]]
    for ids in ([2**70], ["x"], 3, [], [math.nan]):
        all_calls.append((f"trace {ids}", lambda i=ids: scene.trace(i, 1, 2)))
    all_calls += [("restore", lambda: scene.restore(None)), ("restore", lambda: scene.restore(Hostile()))]
    if frames:
        frame = frames[-1][0]
        for text in strings:
            all_calls += [("column", lambda t=text: frame[t]), ("group", lambda t=text: frame.group(t)),
                          ("output", lambda t=text: frame.output(t)), ("detail", lambda t=text: frame.detail(t))]
        all_calls += [("write " + path, lambda p=path: frame.write(p)) for path in paths]
        all_calls += [("compare", lambda o=other: frame.compare(o)) for other in (None, 3, Hostile())]
        all_calls += [("compare", lambda t=t: frame.compare(frame, t)) for t in (-1, math.nan, "x")]
        all_calls += [("show", lambda e=e: frame.show(e, e)) for e in (0, -5, 2**31 - 1, 2**40, "x", 1.5)]
        all_calls.append(("write into an array", lambda: frames[-1][3].__setitem__(0, 1)))
    if snapshots:
        all_calls += [("write snapshot " + path, lambda p=path: snapshots[-1][0].write(p)) for path in
                      ("", "/dev/full/x", "/dev/full", "a\0b")]
    return all_calls


class RandomCalls(unittest.TestCase):
    def test_any_sequence_of_calls_does_what_the_model_says(self):
        calls_of_a_sequence = 40
        for number in range(max(1, CALLS // calls_of_a_sequence)):
            with self.subTest(seed=SEED + number):
                sequence = Sequence(self, SEED + number)
                for _ in range(calls_of_a_sequence):
                    sequence.call()
                sequence.check_arrays()


if __name__ == "__main__":
    main()
