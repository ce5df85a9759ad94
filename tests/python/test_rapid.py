"""The Python module: arrays that share memory, errors, callbacks. tests/scene/test_scene.cpp tests scenes.

    RAPID_LIBRARY=build/test/lib/librapid_host.so python3 tests/python/test_rapid.py
"""
import gc
import math
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.dont_write_bytecode = True  # otherwise in the folder of the sources
root = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(root / "bindings/python"))

import numpy  # noqa: E402

import rapid  # noqa: E402

FALL = """
local rapid = require "rapid"
local height = rapid.param("height", 10, "m, of the drop")
return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.25, center = vec3(0, height, 0) } }
  :attribute { heat = 2 }
  :points("warm", function(p) if p.index % 2 == 0 then p:join "even" end end)
  :detail("total", function(points) points.detail.count = #points end)
  :gravity {} :solve {}
"""


def fall(**options):
    return rapid.Scene("fall.lua", text=FALL, **options)


class Frames(unittest.TestCase):
    def test_a_column_is_an_array_of_the_values(self):
        frame = fall().advance_to(25)
        self.assertEqual((frame.number, len(frame), frame.time), (25, 16, 1.0))
        self.assertEqual((frame["P"].shape, frame["P"].dtype), ((16, 3), numpy.float32))
        numpy.testing.assert_allclose(frame["P"][:, 1], 10 - 9.81 / 2, rtol=1e-6)
        self.assertEqual(sorted(frame["id"]), list(range(16)))
        self.assertEqual(frame["id"].dtype, numpy.int64)

    def test_an_array_shares_memory_and_is_not_written(self):
        frame = fall().advance_to(3)
        first, second = frame["P"], frame["P"]
        self.assertTrue(numpy.shares_memory(first, second))
        self.assertFalse(first.flags.writeable)
        with self.assertRaises(ValueError):
            first[0] = 0

    def test_an_array_outlives_its_frame_and_its_scene_unchanged(self):
        scene = fall()
        frame = scene.advance_to(3)
        P = frame["P"]
        before = P.copy()
        frame.release()
        del frame
        scene.advance_to(9)
        scene.release()
        del scene
        gc.collect()
        numpy.testing.assert_array_equal(P, before)

    def test_a_value_that_all_share_is_one_number(self):
        heat = fall().advance()["heat"]
        self.assertEqual((heat.shape, heat.strides), ((16,), (0,)))
        self.assertTrue((heat == 2).all())

    def test_texts_are_arrays_of_str_and_categories(self):
        cloud = rapid.from_numpy(numpy.zeros((4, 3)), name=numpy.array(["leaf", "bark", "leaf", ""]))
        text = """local rapid = require "rapid"
return rapid.create { points = rapid.host "cloud" } :attribute { material = "wood" }
  :points("fall", function(p) if p.name == "leaf" then p.name = "fallen " .. p.name end end) :solve {}"""
        frame = rapid.Scene("texts.lua", text=text, objects={"cloud": cloud}).advance_to(2)
        self.assertEqual(list(frame["name"]), ["fallen leaf", "bark", "fallen leaf", ""])
        self.assertEqual(list(frame["material"]), ["wood"] * 4)
        names, places = frame.categories("name")
        self.assertEqual(names, ["", "bark", "fallen leaf"])
        self.assertEqual(list(places), [2, 1, 2, 0])

    def test_groups_and_details(self):
        frame = fall().advance_to(2)
        self.assertEqual(frame.groups, ["even"])
        self.assertEqual(frame.group("even").sum(), 8)
        self.assertEqual(frame.group("even").dtype, bool)
        self.assertEqual(frame.detail("count"), 16)

    def test_a_name_that_is_not_there(self):
        frame = fall().advance()
        self.assertIn("P", frame)
        with self.assertRaisesRegex(KeyError, "did you mean .*heat"):
            frame["hea"]
        with self.assertRaisesRegex(rapid.Error, "no group"):
            frame.group("odd")

    def test_a_frame_that_was_released(self):
        frame = fall().advance()
        frame.release()
        with self.assertRaisesRegex(rapid.Error, "NULL"):
            frame.columns

    def test_statistics_are_a_dictionary(self):
        frame = fall().advance_to(4)
        self.assertEqual(frame.statistics_json["points"], 16)
        self.assertEqual(frame.statistics_json["frame"], 4)
        self.assertEqual(frame.statistics.points, 16)

    def test_a_picture(self):
        picture = fall().advance().show(64, 36)
        self.assertTrue(picture.png.startswith(b"\x89PNG"))
        self.assertEqual(picture._repr_png_(), picture.png)

    def test_points_are_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.csv"
            fall().advance().write(path)
            self.assertEqual(len(path.read_text().splitlines()), 17)


def ball(P, gradient, center=(0, 1, 0), radius=0.5):
    d = P - numpy.array(center)
    length = numpy.linalg.norm(d, axis=1)
    if gradient is not None:
        gradient[:] = d / numpy.maximum(length, 1e-300)[:, None]
    return length - radius

    def test_points_are_read_described_and_compared(self):
        scene = fall()
        first, second = scene.advance(), scene.advance()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "fall.bgeo"
            first.write(path)
            read = rapid.Frame.read(path)
            with self.assertRaisesRegex(rapid.Error, "nothing.bgeo"):
                rapid.Frame.read(path.with_name("nothing.bgeo"))
        self.assertEqual((read.number, len(read), read.outputs), (0, 16, ["main"]))
        numpy.testing.assert_array_equal(read["P"], first["P"])
        self.assertEqual(read.describe(), first.describe() | {"bytes": read.describe()["bytes"]})
        self.assertEqual(first.describe()["bounds"]["min"][1], 10)
        self.assertTrue(read.compare(first, 0)["same"])
        found = second.compare(first, 0)
        self.assertFalse(found["same"])
        self.assertAlmostEqual(found["attributes"][0]["max"], 9.81 / 2 / 24 ** 2, places=5)
        with self.assertRaises(rapid.Error):
            first.compare(second, -1)
        with self.assertRaisesRegex(rapid.Error, "no scene"):
            read.show()


class Offers(unittest.TestCase):
    def test_points_of_arrays(self):
        P = numpy.random.default_rng(3).random((100, 3))
        cloud = rapid.from_numpy(P, heat=numpy.arange(100.0), v=numpy.full((100, 3), 24.0), n=numpy.arange(100))
        scene = rapid.Scene("cloud.lua", objects={"cloud": cloud},
                            text="return require('rapid').create { points = rapid.host 'cloud' } :solve {}".replace(
                                "rapid.host", "require('rapid').host"))
        first = scene.advance()
        numpy.testing.assert_array_equal(first["P"], P.astype(numpy.float32))
        numpy.testing.assert_array_equal(first["heat"], numpy.arange(100.0))
        self.assertEqual(first["n"].dtype, numpy.int64)
        numpy.testing.assert_allclose(scene.advance()["P"], P + 1, rtol=1e-6)

    def test_arrays_of_the_wrong_shape(self):
        for P, columns in (([1, 2, 3], {}), (numpy.zeros((3, 2)), {}), (numpy.zeros((3, 3)), {"heat": numpy.zeros(4)}),
                           (numpy.zeros((3, 3)), {"heat": numpy.zeros((3, 5))}),
                           (numpy.zeros((3, 3)), {"name": numpy.array(["a", "b"])}),
                           (numpy.zeros((3, 3)), {"name": numpy.array([b"a", b"b", b"c"])})):
            with self.assertRaises(TypeError):
                rapid.from_numpy(P, **columns)
        with self.assertRaisesRegex(rapid.Error, "nan"):
            rapid.Scene("a.lua", text="", objects={"a": rapid.from_numpy(numpy.full((2, 3), math.nan))})
        with self.assertRaises(TypeError):
            rapid.Scene("a.lua", text="", objects={"a": 3})

    def test_a_shape(self):
        scene = rapid.Scene("rain.lua", objects={"ball": rapid.Shape(ball, (-0.5, 0.5, -0.5), (0.5, 1.5, 0.5))}, text="""
            local rapid = require 'rapid'
            return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.1, center = {0, 2, 0} } }
              :gravity {} :collide { shape = rapid.host 'ball' } :solve {}""")
        lowest = min(numpy.linalg.norm(frame["P"] - numpy.array([0, 1, 0]), axis=1).min() for frame in scene.run(1, 24))
        self.assertGreater(lowest, 0.5 - 1e-5)
        self.assertLess(lowest, 0.51)

    def test_a_force_and_an_edit(self):
        def pull(now, strength, center):
            return strength * (center - now.P)

        def burn(now):
            now["heat"][:] += now.dt
            now.kill[:] = now["heat"] > 0.5

        nodes = [rapid.Force("pull", pull, "Pulls.", {"strength": 4.0, "center": (0, 0, 0)}),
                 rapid.Edit("burn", burn, writes=["heat"])]
        scene = rapid.Scene("pull.lua", nodes=nodes, text="""local rapid = require 'rapid'
            return rapid.create { points = rapid.points.from { P = {{1, 0, 0}} } } :burn {} :pull {}
              :solve { substeps = 100 }""")
        frame = scene.advance_to(11)
        self.assertAlmostEqual(frame["P"][0, 0], math.cos(2 * 10 / 24), places=3)
        self.assertAlmostEqual(frame["heat"][0], 10 / 24, places=5)
        self.assertEqual(len(scene.advance_to(14)), 0)

    def test_a_constraint(self):
        def chain(now, length):
            return [(a, b, length, 0) for a, b in zip(now.id, now.id[1:])]
        scene = rapid.Scene("chain.lua", nodes=[rapid.Constraint("chain", chain, parameters={"length": 1.0})], text="""
            return require('rapid').create { points = require('rapid').points.from { P = {{0, 0, 0}, {1, 0, 0}},
              v = {{0, 1, 0}, {0, -1, 0}} } } :chain {} :solve { substeps = 20 }""")
        P = scene.advance_to(30)["P"].astype(float)
        self.assertAlmostEqual(numpy.linalg.norm(P[0] - P[1]), 1, places=3)
        self.assertAlmostEqual(P[0, 0], 0.5 - 0.5 * math.cos(2 * 29 / 24), places=2)

    def test_what_a_force_raises_rises(self):
        def broken(now):
            raise ZeroDivisionError("in a force")
        scene = rapid.Scene("a.lua", nodes=[rapid.Force("broken", broken)], text="""local rapid = require 'rapid'
            return rapid.create { points = rapid.points.grid {} } :broken {} :solve {}""")
        scene.advance()
        with self.assertRaisesRegex(ZeroDivisionError, "in a force"):
            scene.advance()

    def test_a_mesh_is_offered_again(self):
        def square(y):
            return rapid.Mesh([[0, y, 0], [1, y, 0], [1, y, 1], [0, y, 1]], [[0, 2, 1], [0, 3, 2]])
        scene = rapid.Scene("a.lua", objects={"square": square(1)}, text="""local rapid = require 'rapid'
            return rapid.create {} :emit { source = function() return rapid.host 'square' end, rate = 240 } :solve {}""")
        scene.advance_to(2)
        scene.offer("square", square(5))
        self.assertEqual((scene.advance()["P"][:, 1] > 4).sum(), 10)

    def test_births_on_a_mesh_offered_for_each_frame_have_its_velocity(self):
        # A square that grows by a tenth of its size in each frame moves by 2.4 X per second at X.
        corners = numpy.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], numpy.float32)

        def square(frame):
            return rapid.Mesh(corners * (1 + 0.1 * (frame - 1)), [[0, 2, 1], [0, 3, 2]])
        scene = rapid.Scene("a.lua", objects={"square": square(1)}, text="""local rapid = require 'rapid'
            return rapid.create { fps = 24 }
              :emit { source = function() return rapid.host 'square' end, rate = 2400 } :solve {}""")
        for _ in range(2):
            scene.advance()
            for frame in (2, 3, 4):
                scene.offer("square", square(frame))
                now = scene.advance()
                born = slice(100 * (frame - 2), None)
                self.assertEqual(len(now), 100 * (frame - 1))
                numpy.testing.assert_allclose(now["v"][born], 2.4 / (1 + 0.1 * (frame - 1)) * now["P"][born], atol=1e-4)
            scene.restart()
            scene.offer("square", square(1))


class Scenes(unittest.TestCase):
    def test_parameters(self):
        scene = fall(height=3)
        self.assertEqual(scene.parameters, {"height": {"value": 3.0, "default": 10.0, "doc": "m, of the drop"}})
        self.assertAlmostEqual(scene.advance()["P"][0, 1], 3)
        scene.set(height=5)
        self.assertAlmostEqual(scene.advance()["P"][0, 1], 5)
        scene.set({"gravity.g": (0, 0, 2)})
        self.assertAlmostEqual(scene.advance_to(25)["v"][0, 2], 2, places=5)
        with self.assertRaisesRegex(rapid.Error, "did you mean .*height"):
            scene.set(heigt=1)
        with self.assertRaises(TypeError):
            scene.set(height=(1, 2))
        with self.assertRaises(TypeError):
            scene.set(height=None)

    def test_a_shape_gives_one_real_distance_of_each_place(self):
        text = """local rapid = require "rapid" return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} } }
  :gravity {} :collide { shape = rapid.host "floor" } :solve {}"""
        for distance, wrong in ((lambda P: P[:1, 1], ValueError), (lambda P: P[:, 1:2], ValueError),
                                (lambda P: P[:, 1] + 1j, TypeError), (lambda P: None, TypeError)):
            scene = rapid.Scene("floor.lua", text=text,
                                objects={"floor": rapid.Shape(lambda P, gradient, of=distance: of(P))})
            with self.assertRaisesRegex(wrong, "the distance has the"):
                scene.advance_to(3)

    def test_paths_are_a_list(self):
        with self.assertRaisesRegex(TypeError, "paths = 'modules'; it must be a list of folders"):
            fall(paths="modules")

    def test_a_trace_of_frames_that_end_before_they_begin_is_refused(self):
        scene = fall()
        with self.assertRaisesRegex(rapid.Error, "frames 5 to 1 end before they begin"):
            scene.trace([0], 5, 1)

    def test_an_option_that_is_the_name_of_a_parameter_is_refused(self):
        def opened(**options):
            return rapid.Scene("scene.lua", text="""local rapid = require "rapid"
local seed, memory = rapid.param("seed", 1), rapid.param("memory", 2)
return rapid.create { points = rapid.points.from { P = {{seed, memory, 0}} } } :solve {}""", **options)
        for options in {"seed": 5}, {"memory": 2**30}, {"seed": 5, "set": {"memory": 3}}:
            with self.assertRaisesRegex(TypeError, 'option of rapid.Scene, and the scene has a parameter "(seed|memory)"; '
                                                   'set the parameter by set={"'):
                opened(**options)
        self.assertEqual(opened(set={"seed": 5}).parameters["seed"]["value"], 5)
        self.assertEqual(opened(seed=7, set={"seed": 5}).parameters["seed"]["value"], 5)
        scene = opened()
        scene.set(seed=6, memory=4)
        self.assertEqual(list(scene.advance()["P"][0]), [6, 4, 0])

    def test_a_parameter_that_is_given_twice_is_refused(self):
        twice = "height is given twice, by name and in a dictionary; keep one of them"
        with self.assertRaisesRegex(TypeError, twice):
            fall(set={"height": 1}, height=2)
        with self.assertRaisesRegex(TypeError, twice):
            fall().set({"height": 1}, height=1)

    def test_frames_come_one_by_one(self):
        scene = fall()
        self.assertEqual([frame.number for frame in scene.run(3, 6)], [3, 4, 5, 6])
        self.assertEqual([frame.number for frame in scene.run(1, 2)], [1, 2])
        heights = [frame["P"][0, 1] for frame in scene.run(1, 5)]
        for k, height in enumerate(heights):
            self.assertAlmostEqual(height, 10 - 9.81 / 2 * (k / 24) ** 2, places=5)

    def test_an_error_has_file_line_and_node(self):
        with self.assertRaises(rapid.Error) as caught:
            rapid.Scene("wrong.lua", text="local rapid = require 'rapid'\nreturn rapid.create {} :gravity { q = 1 } :solve {}")
        self.assertEqual((caught.exception.file, caught.exception.line, caught.exception.kind),
                         ("wrong.lua", 2, "wrong scene"))
        with self.assertRaisesRegex(rapid.Error, "nowhere.lua"):
            rapid.Scene("nowhere.lua")
        with self.assertRaises(rapid.Error) as caught:
            rapid.Scene("deep.lua", text="local function inner() error 'here' end\ninner()")
        self.assertLess(caught.exception.script_stack.find("deep.lua:1"), caught.exception.script_stack.find("deep.lua:2"))

    def test_nodes_and_their_types(self):
        scene = fall()
        self.assertEqual([node["type"] for node in scene.nodes],
                         ["create", "attribute", "points", "detail", "gravity", "solve"])
        units = {one["name"]: one["unit"] for one in scene.node_types["gravity"]["parameters"]}
        self.assertEqual(units, {"group": "", "g": "m/s²"})

    def test_the_graph_and_the_lives_of_points(self):
        scene = fall()
        self.assertTrue(scene.graph("dot").startswith("digraph"))
        self.assertIn("<svg", scene.graph())
        self.assertEqual([node["name"] for node in scene.graph("json")["nodes"]], [node["name"] for node in scene.nodes])
        with self.assertRaises(ValueError):
            scene.graph("png")
        frame = scene.advance_to(5)
        self.assertIn(["solve1"], [work["nodes"] for work in frame.profile_json])
        kept = {node["name"]: node["kept"] for node in scene.explain()["nodes"]}
        self.assertTrue(all(kept.values()))
        behind = scene.points_after("gravity1", 3)
        self.assertEqual((behind.number, behind.outputs, len(behind)), (3, ["gravity1"], 16))
        with self.assertRaisesRegex(rapid.Error, "did you mean"):
            scene.points_after("gravty1", 3)
        life, = scene.trace([3], 2, 4)
        self.assertEqual((life["id"], [step["frame"] for step in life["steps"]]), (3, [2, 3, 4]))
        self.assertAlmostEqual(life["steps"][2]["values"]["P"][1], 10 - 9.81 / 2 / 8 ** 2, places=5)
        self.assertEqual(scene.next_frame, 1)
        with self.assertRaisesRegex(rapid.Error, "did you mean"):
            scene.trace([3], 1, 2, create="creat1")

    def test_snapshots(self):
        scene = fall()
        scene.advance_to(3)
        snapshot = scene.save()
        self.assertEqual(snapshot.frame, 3)
        later = scene.advance_to(7)["P"].copy()
        scene.restore(snapshot)
        numpy.testing.assert_array_equal(scene.advance_to(7)["P"], later)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "fall.state"
            snapshot.write(path)
            read = rapid.Snapshot.read(path)
            with self.assertRaisesRegex(rapid.Error, "nothing.state"):
                rapid.Snapshot.read(path.with_name("nothing.state"))
        other = fall()
        other.restore(read)
        self.assertEqual(other.next_frame, 4)
        numpy.testing.assert_array_equal(other.advance_to(7)["P"], later)

    def test_callbacks(self):
        printed, frames = [], []

        def progress(frame, last):
            frames.append((frame, last))
            return frame < 2

        scene = rapid.Scene("a.lua", text="print(require('words').hello) " + FALL, log=printed.append, progress=progress,
                            find_module=lambda name: "return { hello = 'from Python' }" if name == "words" else None)
        self.assertEqual(printed, ["from Python"])
        with self.assertRaisesRegex(rapid.Error, "cancelled"):
            scene.advance_to(5)
        self.assertEqual(frames, [(1, 5), (2, 5)])

    def test_what_a_callback_raises_rises(self):
        def progress(frame, last):
            raise ZeroDivisionError("in Python")
        with self.assertRaisesRegex(ZeroDivisionError, "in Python"):
            fall(progress=progress).advance_to(5)
        scene = None

        def call_back(frame, last):
            scene.advance()
        scene = fall(progress=call_back)
        with self.assertRaisesRegex(rapid.Error, "in another call"):
            scene.advance_to(5)

    def test_limits(self):
        scene = rapid.Scene("slow.lua", script_seconds=0.2, text="""local rapid = require 'rapid'
            return rapid.create { points = rapid.points.grid {} }
              :points("spin", function(p, frame) local i = 0 while frame.number > 1 do i = i + 1 end end) :solve {}""")
        scene.advance()
        begun = time.monotonic()
        with self.assertRaises(rapid.Error) as caught:
            scene.advance()
        self.assertEqual(caught.exception.kind, "too long")
        self.assertLess(time.monotonic() - begun, 20)

    def test_another_thread_cancels(self):
        scene = rapid.Scene("slow.lua", text="""local rapid = require 'rapid'
            return rapid.create { points = rapid.points.grid {} }
              :gravity { g = function(frame) while frame.number > 1 do end return vec3(0, 0, 0) end } :solve {}""")
        threading.Timer(0.1, scene.cancel).start()
        with self.assertRaises(rapid.Error) as caught:
            scene.advance_to(2)
        self.assertEqual(caught.exception.kind, "cancelled")
        scene.restart()
        self.assertEqual(scene.advance().number, 1)

    def test_an_import_without_the_library_says_how_to_build_it(self):
        with tempfile.TemporaryDirectory() as folder:
            checkout = pathlib.Path(folder).resolve()
            (checkout / "CMakePresets.json").write_text("{}")
            shutil.copytree(pathlib.Path(rapid.__file__).parent, checkout / "bindings/python/rapid",
                            ignore=shutil.ignore_patterns("__pycache__"))
            environment = {name: value for name, value in os.environ.items() if name != "RAPID_LIBRARY"}
            environment["PYTHONPATH"] = str(checkout / "bindings/python")
            reported = subprocess.run([sys.executable, "-B", "-c",
                                   "import ctypes.util\nctypes.util.find_library = lambda name: None\nimport rapid"],
                                  env=environment, cwd=folder, capture_output=True, text=True)
        self.assertNotEqual(reported.returncode, 0)
        self.assertIn(f"librapid_host.so is not built; type\n    {checkout}/rapid --version && "
                      f"cmake --build {checkout}/build/release --target rapid_host_library", reported.stderr)

    def test_scenes_on_threads_give_the_same_bits(self):
        def bits(into, place):
            scene = rapid.Scene(str(root / "graphs/first.lua"), rate=2000)
            into[place] = scene.advance_to(12)["P"].tobytes()
        results = [None] * 3
        bits(results, 0)
        threads = [threading.Thread(target=bits, args=(results, place)) for place in (1, 2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], results[2])
        self.assertGreater(len(results[0]), 1000)

    def test_a_scene_is_closed_by_hand_or_by_with(self):
        with fall() as scene:
            scene.advance()
        with self.assertRaisesRegex(rapid.Error, "closed"):
            scene.advance()
        scene.release()


class Runs(unittest.TestCase):
    def test_a_run_writes_its_files_and_parts_are_merged_into_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            folder, frames, merged = pathlib.Path(folder), [], []
            text = "\n".join(line for line in FALL.split("\n") if ":points" not in line and ":detail" not in line)
            for part, name in ((None, "whole"), ((1, 2), "x"), ((2, 2), "x")):
                with rapid.Run("fall.lua", [folder / f"{name}.####.csv"], (1, 2), text=text, part=part, height=7,
                               frame=lambda number, points, seconds, is_known: frames.append((number, points))) as run:
                    run.prepare()
                    self.assertEqual((run.first_frame, run.frames), (1, (1, 2, 1)))
                    outcome = run.run()
                self.assertEqual((outcome["ending"], outcome["last_frame"]), ("complete", 2))
            self.assertEqual(frames[:2], [(1, 16), (2, 16)])
            reported = rapid.merge_files([folder / "x_part{part}.####.csv"], folder / "merged.####.csv",
                                     lambda frame, points: merged.append(frame))
            self.assertEqual((reported, merged), ({"parts": 2, "frames": 2, "points": 32}, [1, 2]))
            for number in ("0001", "0002"):
                self.assertEqual((folder / f"merged.{number}.csv").read_text(), (folder / f"whole.{number}.csv").read_text())

    def test_what_fails_in_a_run_raises(self):
        with self.assertRaisesRegex(rapid.Error, "sample = 2"):
            rapid.Run("fall.lua", text=FALL, sample=2)
        run = rapid.Run("fall.lua", text=FALL.replace(":gravity {}", ":gravty {}"))
        with self.assertRaisesRegex(rapid.Error, "did you mean"):
            run.prepare()

        def broken(*_):
            raise ValueError("from a callback")
        run = rapid.Run("fall.lua", frames=(1, 2), text=FALL, frame=broken)
        run.prepare()
        with self.assertRaisesRegex(ValueError, "from a callback"):
            run.run()

    def test_shapes_and_pictures_of_them(self):
        scene = rapid.Scene("box.lua", text="""local rapid = require 'rapid'
return rapid.create {} :emit { source = rapid.mesh.box { size = {2, 4, 6} }, rate = 1000 }
  :collide { shape = rapid.shape.plane { normal = {0, 1, 0}, offset = -3 } } :solve {}""")
        shapes = scene.shapes(1)
        mesh, = shapes.meshes
        a, b, c = (mesh["positions"][mesh["triangles"][:, k]].astype(float) for k in range(3))
        self.assertAlmostEqual(numpy.einsum("ij,ij->i", a, numpy.cross(b, c)).sum() / 6, 48, places=4)
        self.assertEqual((mesh["role"], shapes.planes), ("emitter", [{"normal": (0, 1, 0), "offset": -3}]))
        frame = scene.advance()
        self.assertEqual(frame.picture(shapes, width=64, height=36).png, frame.show(64, 36).png)
        self.assertNotEqual(frame.picture(shapes, position=(0, 50, 90), fov=20, width=64, height=36).png,
                            frame.show(64, 36).png)

    def test_a_getter_raises_for_what_is_released(self):
        scene = fall()
        frame, shapes = scene.advance(), scene.shapes(1)
        snapshot = scene.save()
        self.assertEqual((frame.size, frame.indices([3, 99]).tolist()), (16, [3, 2**32 - 1]))
        self.assertEqual(rapid.Frame.text_of(rapid.Frame.token_of("leaf")), "leaf")
        self.assertGreater(snapshot.size, 100)
        for thing, name in ((frame, "number"), (shapes, "has_camera"), (snapshot, "size"), (scene, "next_frame")):
            thing.release()
            with self.assertRaises(rapid.Error):
                getattr(thing, name)


class Interrupts(unittest.TestCase):
    def setUp(self):
        # A process that a shell starts in the background ignores Ctrl-C, and so would Python.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGINT, before)

    def press(self, *_):
        os.kill(os.getpid(), signal.SIGINT)

    def test_ctrl_c_between_frames_ends_the_call(self):
        scene = fall(progress=lambda frame, last: frame != 3 or self.press() or True)
        for _ in range(100):  # nor does it end the next call, however late the watching thread wakes
            with self.assertRaises(KeyboardInterrupt):
                scene.advance_to(10**6)
            scene.restart()
            self.assertEqual(scene.advance_to(2).number, 2)
            scene.restart()

    def test_ctrl_c_ends_a_frame_that_would_not_end(self):
        text = """local rapid = require "rapid"
return rapid.create {} :detail("endless", function() print "go" while true do end end) :solve {}"""
        for _ in range(5):
            scene = rapid.Scene("endless.lua", text=text, script_seconds=600, log=self.press)
            with self.assertRaises(KeyboardInterrupt):
                scene.advance_to(2)

    def test_a_handler_of_the_program_runs_and_the_call_goes_on(self):
        pressed = []
        before = signal.signal(signal.SIGINT, lambda number, frame: pressed.append(number))
        try:
            frame = fall(progress=lambda frame, last: frame != 3 or self.press() or True).advance_to(6)
        finally:
            signal.signal(signal.SIGINT, before)
        self.assertEqual((frame.number, pressed), (6, [signal.SIGINT]))

    def test_what_a_handler_raises_rises_after_the_call(self):
        def stop(number, frame):
            raise ZeroDivisionError("stopped")
        before = signal.signal(signal.SIGINT, stop)
        try:
            with self.assertRaisesRegex(ZeroDivisionError, "stopped"):
                fall(progress=lambda frame, last: frame != 3 or self.press() or True).advance_to(10**6)
        finally:
            signal.signal(signal.SIGINT, before)

    def test_the_handler_and_the_descriptor_are_the_programs_again(self):
        ours, theirs = socket.socketpair()
        theirs.setblocking(False)
        handler = signal.getsignal(signal.SIGINT)
        before = signal.set_wakeup_fd(theirs.fileno())
        try:
            fall().advance_to(3)
            self.assertEqual(signal.getsignal(signal.SIGINT), handler)
            with self.assertRaises(KeyboardInterrupt):
                fall(progress=lambda frame, last: frame != 3 or self.press() or True).advance_to(10**6)
            self.assertEqual(ours.recv(1), bytes([signal.SIGINT]))
        finally:
            self.assertEqual(signal.set_wakeup_fd(before), theirs.fileno())
            ours.close()
            theirs.close()


class KeptArrays(unittest.TestCase):
    def test_arrays_of_an_edit_that_are_kept_are_read_only_copies(self):
        kept = []
        edit = rapid.Edit("cut", lambda now: kept.append(now["v"]), doc="x", writes=["v"])
        cloud = rapid.from_numpy(numpy.random.default_rng(1).random((300, 3)))
        text = 'local rapid = require "rapid" return rapid.create { points = rapid.host "cloud" } :cut {} :gravity {} :solve {}'
        scene = rapid.Scene("cut.lua", text=text, nodes=[edit], objects={"cloud": cloud})
        frame = scene.advance_to(5)
        before = frame["v"].copy()
        self.assertGreater(len(kept), 0)
        for array in kept:
            with self.assertRaises(ValueError):
                array[:] = 12345
            array.sum()
        numpy.testing.assert_array_equal(frame["v"], before)
        scene.release()
        kept[-1].sum()

    def test_arrays_of_a_force_and_of_a_shape_outlive_the_scene(self):
        kept = []

        def pull(now):
            kept.extend([now.P, now.v, now["heat"], now.acceleration])
            return numpy.zeros((now.count, 3))

        def ground(P, gradient):
            kept.append(P)
            if gradient is not None:
                kept.append(gradient)
                gradient[:] = (0, 1, 0)
            return P[:, 1] + 1
        text = """local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.25 } } :attribute { heat = 2 }
  :pull {} :gravity {} :collide { shape = rapid.host "ground" } :solve {}"""
        force = rapid.Force("pull", pull, doc="x", reads=["heat"])
        scene = rapid.Scene("kept.lua", text=text, nodes=[force], objects={"ground": rapid.Shape(ground)})
        scene.advance_to(24).release()
        scene.release()
        del scene
        gc.collect()
        self.assertGreater(len(kept), 8)
        for array in kept:
            self.assertFalse(array.flags.writeable)
            self.assertTrue(numpy.isfinite(array).all())

    def test_shapes_that_are_replaced_are_released(self):
        held = len(rapid._offers._used_callbacks)
        text = """local rapid = require "rapid"
return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.25 } } :gravity {}
  :collide { shape = function() return rapid.host "ground" end } :solve {}"""

        def ground(P, gradient):
            if gradient is not None:
                gradient[:] = (0, 1, 0)
            return P[:, 1] + 5
        scene = rapid.Scene("floor.lua", text=text, objects={"ground": rapid.Shape(ground)})
        for _ in range(600):
            scene.offer("ground", rapid.Shape(ground))
            scene.advance().release()
        self.assertLessEqual(len(rapid._offers._used_callbacks) - held, 300)
        scene.release()
        del scene
        gc.collect()
        self.assertEqual(len(rapid._offers._used_callbacks), held)


def main(module="__main__"):
    """Runs the tests of a module, or those named by the arguments, and prints their counts in the form that tests/run
    reads."""
    outcome = unittest.main(module, exit=False, verbosity=0).result
    failed = len(outcome.failures) + len(outcome.errors)
    print(f"{max(0, outcome.testsRun - failed - len(outcome.skipped))} passed, {failed} failed, {len(outcome.skipped)} skipped")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
