"""Shared by the tests of the viewer: the command, a browser, a view, and the list of tests."""
import csv
import json
import os
import pathlib
import subprocess
import tempfile

from browser import Browser, View

TESTS = []


# A row of beads that fall on a floor, one of which a node lifts out of the row, with rain falling on it.
SCENE = """local rapid = require "rapid"
local height = rapid.param("height", 2, "of the row, in metres")
local count = rapid.param("count", 40, "beads")
local wet = rapid.param("wet", false, "whether it rains")
local push = rapid.param("push", {0, 0, 0}, "a wind, m/s")
local P, ids = {}, {}
for i = 1, count do P[i] = {i * 0.1, height, 0} end
local beads = rapid.create { fps = 24, points = rapid.points.from { P = P } }
  :attribute { pscale = 0.04, heat = 0, Cd = {1, 0.2, 0.1} }
  :group { name = "warm", where = function(p) return p.heat > 3 end }
  :points("warm_up", function(p) p.heat = p.heat + p.P.x end)
  :points("lift", function(p, frame)
    if p.id == 3 and frame.number == 2 then p.P = p.P + vec3(0, 5, 0) end
  end)
  :gravity {} :wind { velocity = push, drag = 1 }
  :collide { name = "floor", shape = rapid.shape.plane {}, bounce = 0.5 } :solve {}
rapid.create { name = "spare" } :drag { linear = 1 }
return beads
"""


def test(function):
    TESTS.append(function)
    return function


class Bench:
    """Shared by the tests: the command, a browser, and a view of SCENE."""

    def __init__(self, rapid):
        self.rapid = rapid
        self.browser = Browser(1280, 800)
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        self.view = None

    def open(self, text=SCENE, *arguments, name="scene.lua"):
        """Opens the page of a new view, and waits until its run is complete."""
        self.end()
        (self.path / name).write_text(text, encoding="utf-8")
        self.view = View(self.rapid, name, *(arguments or ("-f", "1-30")), cwd=self.path)
        self.browser.open(self.view.address)
        return self.browser

    def ready(self, text=SCENE, *arguments):
        browser = self.open(text, *arguments)
        browser.wait("window.rapidView?.state.status?.state === 'done' && Number(document.body.dataset.shown) > 0")
        return browser

    def rows(self, frame, text=SCENE, *arguments):
        """Returns the points of a frame as `rapid run` writes them."""
        (self.path / "same.lua").write_text(text, encoding="utf-8")
        subprocess.run([self.rapid, "run", "same.lua", "-f", str(frame), "--quiet", "-o", "same.####.csv", *arguments],
                       cwd=self.path, check=True)
        with open(self.path / f"same.{frame:04d}.csv", encoding="ascii") as file:
            return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]

    def end(self):
        if self.view:
            view, self.view = self.view, None
            status = view.close()
            assert status == 130, f"the view ended with status {status}: {view.process.stderr.read()}"

    def close(self):
        self.end()
        self.browser.close()
        self.folder.cleanup()


def go(browser, frame):
    browser.run("rapidView.go(arguments[0])", frame)
    browser.wait(f"document.body.dataset.frame === '{frame}'")


def set_parameter(browser, name, value):
    browser.run("""const field = document.querySelector(`[data-name="${arguments[0]}"] input[type=number]`);
      field.value = arguments[1]; field.dispatchEvent(new Event('change'));""", name, value)


def choose(browser, name, value):
    """Chooses a value. The options that come from files appear with the status after the first file is read."""
    browser.wait("[...document.getElementById(%s).options].some((o) => o.value === %s)"
                 % (json.dumps(name), json.dumps(value)))
    browser.run("const s = document.getElementById(arguments[0]); s.value = arguments[1];"
                "s.dispatchEvent(new Event('change'));", name, value)


def wait_for_run(browser, run):
    browser.wait(f"rapidView.state.status.run > {run} && rapidView.state.status.state === 'done'"
                 " && rapidView.state.shownRun === rapidView.state.status.run")


def statistics(bench, text, frames, *arguments):
    """Returns the statistics of `rapid run`, by frame."""
    (bench.path / "same.lua").write_text(text, encoding="utf-8")
    subprocess.run([bench.rapid, "run", "same.lua", "-f", frames, "--quiet", "--stats", "same.json", *arguments],
                   cwd=bench.path, check=True)
    return {f["frame"]: f for f in json.loads((bench.path / "same.json").read_text(encoding="utf-8"))["frames"]}
