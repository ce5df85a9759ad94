"""What the picture shows: points, colours, shapes, trails, the camera."""
import json
import math
import subprocess

from bench import choose, go, statistics, test
from browser import wait_for


# Pixels of the picture that are neither the background nor grey.
COLOURED = """(() => {
  const canvas = document.getElementById('canvas'), copy = document.createElement('canvas');
  copy.width = canvas.width; copy.height = canvas.height;
  const context = copy.getContext('2d');
  context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, copy.width, copy.height).data;
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    if (Math.max(data[i], data[i + 1], data[i + 2]) - Math.min(data[i], data[i + 1], data[i + 2]) > 60) ++count;
  return count;
})()"""


def column(browser, frame, name, **wish):
    """The values of an attribute, as the picture has them: from 0 for the least to 1; None where there is none."""
    given = json.dumps({"frame": frame, "colour": name, **wish})
    values, gaps = browser.promise(f"rapidView.ask('frame', {given}).then((m) =>"
                                   " [[...m.arrays.value], m.unknown.value])")
    if not gaps:
        return [value / 65535 for value in values]
    return [None if value == 0 else (value - 1) / 65534 for value in values]


# Points that an attractor draws in, the nearer the faster; a tolerance gives each the sub-steps that it needs.
ORBITS = """local rapid = require "rapid"
local P = {}
for i = 1, 60 do P[i] = {0.3 + i * 0.05, 0, 0} end
return rapid.create { points = rapid.points.from { P = P } } :attract { strength = 4 }
  :solve { SOLVE }
"""


@test
def draws_the_points_of_the_scene(bench):
    browser = bench.ready()
    browser.click("#ground")  # the axes are coloured, too
    wait_for(lambda: browser.run(f"return {COLOURED}") > 200)
    assert browser.run("return document.body.dataset.shown") == "40"
    before = browser.run(f"return {COLOURED}")
    browser.run("const p = rapidView.picture; p.points.visible = false; p.draw()")
    wait_for(lambda: browser.run(f"return {COLOURED}") < before / 4)


@test
def positions_are_those_of_run_to_16_bits(bench):
    browser = bench.ready()
    go(browser, 12)
    message = browser.run("""const m = rapidView.picture.message, P = [];
      for (let i = 0; i < m.shown; ++i) P.push([0, 1, 2].map((k) =>
        m.box[0][k] + m.arrays.P[3 * i + k] / 65535 * (m.box[1][k] - m.box[0][k])));
      return P;""")
    rows = bench.rows(12)
    assert len(rows) == len(message)
    for row, place in zip(rows, message):
        for k, name in enumerate(("Px", "Py", "Pz")):
            size = max(r[name] for r in rows) - min(r[name] for r in rows)
            assert abs(row[name] - place[k]) <= size / 65535 + 1e-6


@test
def colours_by_an_attribute_with_its_range(bench):
    browser = bench.ready()
    go(browser, 12)
    choose(browser, "colour", "heat")
    browser.wait("rapidView.picture.message.colour === 'heat' && !document.getElementById('legend').hidden")
    heat = [row["heat"] for row in bench.rows(12)]
    low, high = browser.run("return rapidView.picture.message.ranges.value")
    assert abs(low - min(heat)) < 1e-5 and abs(high - max(heat)) < 1e-4
    choose(browser, "group", "warm")
    wanted = sum(row["group:warm"] for row in bench.rows(12))
    assert 0 < wanted < 40
    browser.wait(f"document.body.dataset.shown === '{int(wanted)}'")


@test
def colours_by_the_estimated_error(bench):
    text = ORBITS.replace("SOLVE", "substeps = 2")
    browser = bench.ready(text)
    assert "error" in browser.run("return [...document.getElementById('colour').options].map((o) => o.value)")
    choose(browser, "colour", "error")
    browser.wait("rapidView.picture.message.colour === 'error' && !document.getElementById('legend').hidden")
    go(browser, 12)
    low, high = browser.run("return rapidView.picture.message.ranges.value")
    # The largest is the one that the statistics tell.
    wanted = statistics(bench, text, "1-12")[12]["error"]
    assert abs(high - wanted["position_max"]) <= 1e-6 * wanted["position_max"], (high, wanted)
    values = column(browser, 12, "error")
    assert None not in values and values.index(max(values)) < 20 and low < high / 100
    # In the first frame nothing has moved yet.
    go(browser, 1)
    assert browser.run("return rapidView.picture.message.ranges.value") == [0, 0]


@test
def points_without_an_estimate_are_told_apart(bench):
    text = ORBITS.replace("60", "3000").replace("0.05", "0.001").replace("SOLVE", "substeps = 2")
    browser = bench.ready(text, "-f", "1-6")
    choose(browser, "colour", "error")
    browser.wait("rapidView.picture.message.colour === 'error'")
    go(browser, 6)
    values = column(browser, 6, "error")
    known = sum(value is not None for value in values)
    assert 1000 <= known <= 1250, known
    assert browser.run("return rapidView.picture.uniforms.gaps.value") == 1
    assert f"{known:,}".replace(",", " ") in browser.run("return document.getElementById('legend').innerText")


@test
def colours_by_the_sub_steps_of_each_point(bench):
    text = ORBITS.replace("SOLVE", "tolerance = 1e-5")
    browser = bench.ready(text)
    go(browser, 6)
    table = browser.promise("rapidView.ask('sheet', {frame: 6, count: 60}).then((s) => s.rows.map((r) => r.values))")
    taken = [row["substeps"] for row in table]
    assert max(taken) == statistics(bench, text, "1-6")[6]["substeps"], taken
    assert len(set(taken)) >= 3 and all(n & (n - 1) == 0 for n in taken)
    choose(browser, "colour", "substeps")
    browser.wait("rapidView.picture.message.colour === 'substeps'")
    assert browser.run("return rapidView.picture.message.ranges.value") == [min(taken), max(taken)]


@test
def colours_by_sleep(bench):
    text = """local rapid = require "rapid"
local P = {}
for i = 1, 60 do P[i] = {i % 8 * 0.5, 0.1 + (i > 30 and i * 0.5 or 0), math.floor(i / 8) * 0.5} end
return rapid.create { points = rapid.points.from { P = P } } :attribute { pscale = 0.1 } :gravity {}
  :collide { shape = rapid.shape.plane {} } :contact {} :solve { substeps = 4 }
"""
    browser = bench.ready(text, "-f", "1-36")
    asleep = statistics(bench, text, "1-36")[36]["asleep"]
    assert 0 < asleep < 60
    values = column(browser, 36, "asleep")
    assert sum(value == 1 for value in values) == asleep


@test
def shows_shapes_where_they_are_in_the_frame(bench):
    browser = bench.ready("""local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :gravity {}
  :collide { shape = rapid.levelset.from_mesh(rapid.mesh.box { size = {1, 1, 1} }, { voxel = 0.1 }),
             transform = function(frame) return rapid.translate(2 * frame.time, 0, 0) end } :solve {}""")
    bounds = """const [box] = rapidView.picture.shapes.children; if (!box) return [0, 0]; box.geometry.computeBoundingBox();
      const { min, max } = box.geometry.boundingBox; return [(min.x + max.x) / 2, max.x - min.x];"""
    for frame in (1, 13, 25):
        go(browser, frame)
        wait_for(lambda: abs(browser.run(bounds)[0] - 2 * (frame - 1) / 24) < 1e-4)
        assert abs(browser.run(bounds)[1] - 1) < 0.25  # voxels of 0.1 m
    browser.type("s")
    assert not browser.run("return rapidView.picture.shapes.visible")


@test
def the_camera_goes_to_the_command_line_and_back(bench):
    browser = bench.ready()
    go(browser, 9)
    browser.run("rapidView.picture.look(0.3, 0.2)")
    text = browser.run("return rapidView.picture.cameraText()")
    subprocess.run([bench.rapid, "run", "scene.lua", "-f", "9", "--quiet", "-o", "c.####.png", "--size=320x180",
                    f"--camera={text}"], cwd=bench.path, check=True)
    browser.run("document.getElementById('out-size').value = 'own'; document.getElementById('out-width').value = 320;"
                "document.getElementById('out-height').value = 180;")
    mine = browser.promise("rapidView.ask('picture', rapidView.out.wish()).then(({data}) => [...data])")
    assert bytes(mine) == (bench.path / "c.0009.png").read_bytes(), "another picture than that of run"
    browser.type("f")
    assert browser.run("return rapidView.picture.cameraText()") != text
    browser.type("k")
    browser.wait("document.getElementById('camera-dialog').open")
    browser.run("document.getElementById('camera-text').value = `--camera=${arguments[0]}`", text)
    browser.click("#camera-use")
    back = browser.run("return rapidView.picture.cameraText()")
    assert max(abs(float(a) - float(b)) for a, b in zip(back.split(","), text.split(","))) < 1e-4, (back, text)


@test
def more_points_than_the_page_holds_are_shown_by_id(bench):
    browser = bench.ready()
    for most, every in ((40, 1), (39, 2), (20, 2), (10, 4), (9, 8)):
        shown, told, total = browser.promise(f"rapidView.ask('frame', {{frame: 5, most: {most}}})"
                                             ".then((m) => [m.shown, m.every, m.total])")
        assert (shown, told, total) == (40 // every, every, 40), (most, shown, told)
    rows = bench.rows(5)
    P = browser.promise("rapidView.ask('frame', {frame: 5, most: 10}).then((m) => m.box)")
    chosen = [row["Px"] for row in rows if row["id"] % 4 == 0]
    assert abs(P[0][0] - min(chosen)) < 1e-6 and abs(P[1][0] - max(chosen)) < 1e-6


@test
def trails_join_the_frames_before(bench):
    browser = bench.ready()
    go(browser, 20)
    choose(browser, "trails", "12")
    browser.wait("Boolean(rapidView.picture.trails)")
    ends = browser.run("return [...rapidView.picture.trails.geometry.attributes.position.data.array]")
    assert len(ends) == 40 * 12 * 2 * 4, len(ends)
    before = bench.rows(19)
    assert max(abs(ends[4 + k] - before[0][name]) for k, name in enumerate(("Px", "Py", "Pz"))) < 1e-6
    browser.type("d")
    browser.type("d")
    browser.wait("rapidView.picture.kind?.startsWith('streaks')")


@test
def keys_are_listed_and_themes_change(bench):
    browser = bench.ready()
    browser.run("document.getElementById('canvas').focus()")
    theme = browser.run("return document.documentElement.dataset.theme")
    browser.type("l")
    browser.wait(f"document.documentElement.dataset.theme !== '{theme}'")
    browser.type("?")
    browser.wait("document.getElementById('keys').open")
    listed = browser.run("return document.getElementById('keys').innerText")
    for word in ("Space", "orbit", "Esc"):
        assert word in listed
    untold = browser.run("return [...document.querySelectorAll('button:not(dialog button), select')]"
                         ".filter((c) => !c.title).map((c) => c.outerHTML)")
    assert untold == [], untold
