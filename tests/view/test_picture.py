"""The contents of the picture: points, colours, shapes, trails, the camera."""
import json
import math
import subprocess

from bench import choose, go, statistics, test
from browser import wait_for


# Counts the pixels of the picture that are neither background nor grey.
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
    """Returns the values of an attribute as the picture uses them: from 0 for the least to 1; None for a missing
    value."""
    given = json.dumps({"frame": frame, "colour": name, **wish})
    values, gaps = browser.promise(f"rapidView.ask('frame', {given}).then((m) =>"
                                   " [[...m.arrays.value], m.unknown.value])")
    if not gaps:
        return [value / 65535 for value in values]
    return [None if value == 0 else (value - 1) / 65534 for value in values]


# Points that an attractor pulls in, the nearer the faster; a tolerance gives each the substeps that it needs.
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
    expected = sum(row["group:warm"] for row in bench.rows(12))
    assert 0 < expected < 40
    browser.wait(f"document.body.dataset.shown === '{int(expected)}'")


@test
def colours_by_the_estimated_error(bench):
    text = ORBITS.replace("SOLVE", "substeps = 2")
    browser = bench.ready(text)
    assert "error" in browser.run("return [...document.getElementById('colour').options].map((o) => o.value)")
    choose(browser, "colour", "error")
    browser.wait("rapidView.picture.message.colour === 'error' && !document.getElementById('legend').hidden")
    go(browser, 12)
    low, high = browser.run("return rapidView.picture.message.ranges.value")
    # The largest is the one in the statistics.
    expected = statistics(bench, text, "1-12")[12]["error"]
    assert abs(high - expected["position_max"]) <= 1e-6 * expected["position_max"], (high, expected)
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
    # If no point sleeps, all have the colour of points that are awake.
    assert set(column(browser, 1, "asleep")) == {0}
    assert browser.promise("rapidView.ask('frame', {frame: 1, colour: 'asleep'}).then((m) => m.ranges.value)") == [0, 1]


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
        shown, reported, total = browser.promise(f"rapidView.ask('frame', {{frame: 5, most: {most}}})"
                                             ".then((m) => [m.shown, m.every, m.total])")
        assert (shown, reported, total) == (40 // every, every, 40), (most, shown, reported)
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
    # Every control has a tooltip.
    unreported = browser.run("""return [...document.querySelectorAll(
      'button:not(dialog button), select, input, [role=separator], [tabindex="0"]:not(#canvas), canvas:not(#canvas, #legend *)')]
      .filter((c) => !c.title && !c.querySelector('title')).map((c) => c.outerHTML)""")
    assert unreported == [], unreported


@test
def the_mouse_orbits_pans_and_zooms(bench):
    browser = bench.ready()
    box = browser.run("const b = document.getElementById('canvas').getBoundingClientRect();"
                      "return [b.left, b.top, b.right, b.bottom]")
    x, y = (box[0] + box[2]) / 2, (box[1] + box[3]) / 2

    def camera():
        numbers = [float(n) for n in browser.run("return rapidView.picture.cameraText()").split(",")]
        return numbers[:3], numbers[3:6], [a - b for a, b in zip(numbers[:3], numbers[3:6])]

    _, target, offset = camera()
    browser.drag(x, y, x + 80, y + 30)
    _, same, turned = camera()
    assert math.dist(target, same) < 1e-5 and abs(math.hypot(*turned) / math.hypot(*offset) - 1) < 1e-4
    assert turned[1] > offset[1] + 0.01, "dragged down, seen from higher up"
    browser.drag(x, y, x + 80, y, button=1)
    _, moved, kept = camera()
    assert math.dist(kept, turned) < 1e-4 and math.dist(moved, same) > 0.01
    browser.wheel(x, y, -120)
    _, same, nearer = camera()
    assert math.dist(moved, same) < 1e-5 and abs(math.dist(nearer, [0, 0, 0]) / math.hypot(*kept) - math.exp(-0.12)) < 1e-3
    browser.drag(x, y, x, y + 50, button=2)
    assert math.hypot(*camera()[2]) > math.hypot(*nearer) * 1.05


@test
def colours_by_speed_and_by_a_group(bench):
    browser = bench.ready()
    rows = bench.rows(24)
    speeds = [math.hypot(row["vx"], row["vy"], row["vz"]) for row in rows]
    low, high = min(speeds), max(speeds)
    for value, speed in zip(column(browser, 24, "speed"), speeds):
        assert abs(value - (speed - low) / (high - low)) < 1e-4, (value, speed)
    assert column(browser, 24, "group:warm") == [row["group:warm"] for row in rows]
    choose(browser, "colour", "group:warm")
    browser.wait("rapidView.picture.message.colour === 'group:warm'")


@test
def deforming_bodies_and_emitters_are_those_of_the_frame(bench):
    for frame in range(1, 6):  # a box that grows
        corners = [(x, y, z) for x in (0, 1) for y in (0, frame) for z in (0, 1)]
        faces = "1 2 4 3, 5 7 8 6, 1 5 6 2, 3 4 8 7, 1 3 7 5, 2 6 8 4"
        (bench.path / f"grow.{frame:04d}.obj").write_text(
            "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {f}\n" for f in faces.split(", ")),
            encoding="utf-8")
    browser = bench.ready("""local rapid = require "rapid"
local body = rapid.mesh.read "grow.####.obj"
return rapid.create {} :emit { source = body, rate = 2400 } :gravity {}
  :collide { shape = rapid.levelset.from_mesh(body, { voxel = 0.1 }) } :solve {}""", "-f", "1-5")
    tops = """return Object.fromEntries(rapidView.picture.shapes.children.map((child) => { child.geometry.computeBoundingBox();
      return [Object.entries(rapidView.picture.materials).find(([, m]) => m === child.material)[0],
              child.geometry.boundingBox.max.y]; }))"""
    for frame in (2, 5, 3):
        go(browser, frame)
        wait_for(lambda: set(browser.run(tops)) == {"collider", "emitter"}
                 and all(abs(top - frame) < 0.11 for top in browser.run(tops).values()))


@test
def points_are_dots_where_dots_are_chosen(bench):
    browser = bench.ready()
    browser.click("#ground")
    wait_for(lambda: browser.run(f"return {COLOURED}") > 9 * 40)
    choose(browser, "style", "dots")
    # Each is two pixels wide, and touches three if it lies between them.
    wait_for(lambda: 0 < browser.run(f"return {COLOURED}") <= 9 * 40)


@test
def says_what_it_needs_where_there_is_no_webgl(bench):
    again = bench.browser.before_pages("HTMLCanvasElement.prototype.getContext = () => null")
    try:
        browser = bench.open()
        browser.wait("!document.getElementById('error').hidden")
        assert "WebGL" in browser.run("return document.getElementById('error').innerText")
    finally:
        again()


@test
def the_page_fits_widths_from_a_thousand_pixels_on(bench):
    browser = bench.ready()
    try:
        for width in (1000, 1280, 1920):
            browser.size(width, 700)
            outside = browser.run("""return [...document.querySelectorAll('#bar > *, #timeline > *, #dock nav > *, #side > *')]
              .filter((e) => e.offsetParent && e.getBoundingClientRect().right > innerWidth + 0.5).map((e) => e.outerHTML)""")
            assert outside == [] and browser.run("return document.documentElement.scrollWidth") == width, (width, outside)
    finally:
        browser.size(1280, 800)


@test
def nothing_is_loaded_from_elsewhere(bench):
    browser = bench.ready()
    origins = browser.run("return [...new Set(performance.getEntriesByType('resource').map((e) => new URL(e.name).origin))]")
    assert origins == [f"http://127.0.0.1:{bench.view.port}"], origins


@test
def panels_are_moved_and_kept(bench):
    browser = bench.ready()
    size = """const b = document.getElementById(arguments[0]).getBoundingClientRect(); return [b.width, b.height]"""
    browser.run("localStorage.clear()")
    wide, tall = browser.run(size, "side")[0], browser.run(size, "dock")[1]
    browser.run("document.querySelector('.border.x').focus()")
    browser.type("\ue012\ue012")
    moved = browser.run(size, "side")[0]
    assert abs(moved - wide - 48) <= 1
    box = browser.run("const b = document.querySelector('.border.y').getBoundingClientRect(); return [b.left + 200, b.top + 3]")
    browser.drag(*box, box[0], box[1] - 40)
    assert abs(browser.run(size, "dock")[1] - tall - 40) <= 1
    browser.run("location.reload()")
    browser.wait("document.body.dataset.shown === '40'")
    assert browser.run(size, "side")[0] == moved
    browser.run("document.querySelectorAll('.border').forEach((b) => b.dispatchEvent(new Event('dblclick')))")
    assert [browser.run(size, "side")[0], browser.run(size, "dock")[1]] == [wide, tall]
    browser.type("m")
    assert browser.run("return document.getElementById('canvas').clientWidth === innerWidth")
    browser.type("m")
    assert browser.run(size, "side")[0] == wide


@test
def colours_are_those_of_the_points_within_what_a_screen_shows(bench):
    # Pictures encode linear light as sRGB up to 0.8, and compress it above.
    points = "{ P = {{0, 0, 0}, {1, 0, 0}}, Cd = %s }"
    for Cd, expected in (("{{-0.5, 0.25, 7}, {1, 0, 0.5}}", [0, 137, 255, 247, 0, 188]),
                         ("{{0.2, 0.4, 3}, {0.2, 0.4, 3}}", [124, 170, 255] * 2)):
        browser = bench.ready(f"""local rapid = require "rapid"
return rapid.create {{ points = rapid.points.from {points % Cd} }} :solve {{}}""", "-f", "1-2")
        assert browser.promise("rapidView.ask('frame', {frame: 2}).then((m) => [...m.arrays.colour])") == expected
    browser = bench.ready("""local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} } } :attribute { Cd = {0.2, 0.4, 3} } :solve {}""",
                          "-f", "1-2")
    assert browser.promise("rapidView.ask('frame', {frame: 2}).then((m) => [...m.arrays.colour])") == [124, 170, 255] * 2
