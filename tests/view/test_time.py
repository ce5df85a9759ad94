"""Runs, parameters, the timeline, files, the cache."""
import csv
import json
import subprocess
import time

from bench import SCENE, go, set_parameter, test, wait_for_run
from browser import View, wait_for


# The second frame would take hours: a million substeps of many points.
SLOW = """local rapid = require "rapid"
local slow = rapid.param("slow", true, "whether it takes hours")
local P = {}
for i = 1, 20000 do P[i] = {i * 1e-4 + 0.5, 1, 0} end
return rapid.create { points = rapid.points.from { P = P } } :attract { strength = 0.1 }
  :solve { substeps = slow and 1000000 or 1 }
"""
# The same in a script.
SLOW_SCRIPT = SLOW.replace(":attract {", """:points("wait", function(p)
      if slow and p.id == 7 then while true do end end end) :attract {""").replace("1000000", "1")


@test
def plays_pauses_steps_and_scrubs(bench):
    browser = bench.ready()
    go(browser, 1)
    browser.run("document.getElementById('canvas').focus()")
    browser.type(" ")
    browser.wait("Number(document.body.dataset.frame) > 6")
    browser.type(" ")
    assert not browser.run("return rapidView.state.playing")
    time.sleep(0.2)
    stopped = browser.run("return rapidView.state.frame")
    time.sleep(0.3)
    assert browser.run("return rapidView.state.frame") == stopped
    browser.type("\ue014")
    browser.wait(f"document.body.dataset.frame === '{min(stopped + 1, 30)}'")
    box = browser.run("const b = document.querySelector('#timeline canvas').getBoundingClientRect();"
                      "return [b.left, b.top, b.width, b.height]")
    for frame in (29, 2, 15):
        x = box[0] + 6 + (box[2] - 12) * (frame - 1) / 29
        browser.click_at(x, box[1] + box[3] / 2)
        browser.wait(f"document.body.dataset.frame === '{frame}'")


@test
def a_changed_parameter_runs_the_scene_again(bench):
    browser = bench.ready()
    go(browser, 10)
    run = browser.run("return rapidView.state.status.run")
    set_parameter(browser, "count", 7)
    wait_for_run(browser, run)
    assert browser.run("return document.body.dataset.shown") == "7"
    assert browser.run("return document.body.dataset.frame") == "10"
    assert browser.run("return document.querySelector('[data-name=count]').classList.contains('set')")
    rows = bench.rows(10, SCENE, "--set", "count=7")
    point = browser.promise("rapidView.ask('point', {frame: 10, id: 6})")
    assert point["values"]["P"][1] == rows[6]["Py"] or abs(point["values"]["P"][1] - rows[6]["Py"]) < 1e-7
    run = browser.run("return rapidView.state.status.run")
    browser.run("document.querySelector('#parameters h2 button').click()")
    wait_for_run(browser, run)
    assert browser.run("return document.body.dataset.shown") == "40"


@test
def every_kind_of_parameter_has_its_field(bench):
    browser = bench.ready()
    kinds = browser.run("""return Object.fromEntries([...document.querySelectorAll('.parameter')].map((row) =>
      [row.dataset.name, [...row.querySelectorAll('input')].map((input) => input.type)]))""")
    assert kinds == {"height": ["number", "range"], "count": ["number", "range"], "wet": ["checkbox"],
                     "push": ["number", "number", "number"]}, kinds
    run = browser.run("return rapidView.state.status.run")
    browser.run("""const field = document.querySelector('[data-name=push] input');
      field.value = 3; field.dispatchEvent(new Event('change'));""")
    wait_for_run(browser, run)
    values = browser.run("return rapidView.state.status.values")
    assert values == {"push": "3,0,0"}, values


@test
def an_error_shows_its_line_and_the_last_frames_stay(bench):
    browser = bench.ready()
    go(browser, 10)
    run = browser.run("return rapidView.state.status.run")
    wrong = SCENE.replace(":gravity {}", ":gravty {}")
    (bench.path / "scene.lua").write_text(wrong, encoding="utf-8")
    browser.wait(f"rapidView.state.status.run > {run} && !document.getElementById('error').hidden")
    text = browser.run("return document.getElementById('error').innerText")
    line = 1 + SCENE[:SCENE.index(":gravity")].count("\n")
    assert f"scene.lua:{line}" in text and "gravity" in text, text
    go(browser, 20)
    assert browser.run("return document.body.dataset.shown") == "40"
    run = browser.run("return rapidView.state.status.run")
    (bench.path / "scene.lua").write_text(SCENE.replace('"count", 40', '"count", 11'), encoding="utf-8")
    wait_for_run(browser, run)
    assert browser.run("return document.getElementById('error').hidden")
    assert browser.run("return document.body.dataset.shown") == "11"


@test
def an_error_within_a_frame_keeps_the_frames_before(bench):
    text = SCENE.replace("p.heat = p.heat + p.P.x", 'if frame.number == 9 then error "too warm" end').replace(
        "function(p) if frame", "function(p, frame) if frame")
    browser = bench.open(text)
    browser.wait("window.rapidView?.state.status?.state === 'failed' && document.body.dataset.frame === '8'")
    assert "too warm" in browser.run("return document.getElementById('error').innerText")


@test
def says_when_the_memory_is_full(bench):
    browser = bench.open("""local rapid = require "rapid"
local P = {}
for i = 1, 50000 do P[i] = {i * 1e-5, 0, 0} end
return rapid.create { points = rapid.points.from { P = P } } :gravity {} :solve {}""", "-f", "1-60", "--memory", "100M")
    browser.wait("window.rapidView?.state.status?.state === 'full'")
    kept, last, used, most = browser.run("""const s = rapidView.state.status;
      return [s.ready[s.ready.length - 1][1], s.last, s.bytes, s.most_bytes]""")
    assert 5 < kept < 60 == last and used <= most == 50 << 20
    assert "memory is full" in browser.run("return document.getElementById('state').textContent")
    go(browser, 3)
    assert browser.run("return document.body.dataset.shown") == "50000"


@test
def a_change_abandons_a_slow_frame_within_it(bench):
    for text in (SLOW, SLOW_SCRIPT):
        browser = bench.open(text, "-f", "1-4")
        browser.wait("window.rapidView?.state.status?.state === 'computing' && document.body.dataset.frame === '1'")
        run = browser.run("return rapidView.state.status.run")
        browser.run("document.querySelector('[data-name=slow] input').click()")
        wait_for_run(browser, run)
        wait_for(lambda: browser.promise("rapidView.ask('status', {since: 0, graph: 0}).then((s) => s.ending)") == 0)
        assert browser.run("return rapidView.state.status.ready") == [[1, 4]]


@test
def the_timeline_shows_what_is_computed_and_what_is_stale(bench):
    browser = bench.open(SLOW.replace("or 1 }", "or 2 }").replace('"slow", true', '"slow", false'), "-f", "1-10")
    browser.wait("window.rapidView?.state.status?.state === 'done'")
    run = browser.run("return rapidView.state.status.run")
    browser.run("document.querySelector('[data-name=slow] input').click()")
    browser.wait(f"rapidView.state.status.run > {run} && rapidView.state.status.ready.length")
    pixel = """const c = document.querySelector('#timeline canvas'), r = devicePixelRatio, f = arguments[0];
      const x = 6 + (f - 1) / 9 * (c.clientWidth - 12), y = c.clientHeight - 6;
      return [...c.getContext('2d').getImageData(x * r, y * r, 1, 1).data].slice(0, 3);"""
    named = """const d = document.createElement('canvas').getContext('2d');
      d.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--' + arguments[0]);
      d.fillRect(0, 0, 1, 1); return [...d.getImageData(0, 0, 1, 1).data].slice(0, 3);"""
    go(browser, 6)
    for frame, name in ((1, "good"), (2, "accent"), (9, "stale")):
        wait_for(lambda: browser.run(pixel, frame) == browser.run(named, name))


@test
def a_cache_keeps_the_frames_for_the_next_view(bench):
    computed = "rapidView.ask('figures').then((f) => f.figures.map((s) => s.seconds.total))"
    bench.ready(SCENE, "-f", "1-20", "--cache", "kept")
    first = bench.browser.promise(computed)
    bench.end()
    files = {file.name: file.stat().st_mtime_ns for file in bench.path.glob("kept/view/*/frame.*.rapid")}
    assert len(files) == 20
    browser = bench.ready(SCENE, "-f", "1-20", "--cache", "kept")
    assert browser.promise(computed) == first, "frames were computed again"
    go(browser, 12)
    rows = bench.rows(12)
    points = browser.promise("rapidView.ask('sheet', {frame: 12}).then((s) => s.rows.map((r) => r.values))")
    for row, point in zip(rows, points):
        assert all(abs(point["P"][k] - row[name]) <= 1e-8 * max(1, abs(row[name])) for k, name in enumerate(("Px", "Py", "Pz")))
    assert browser.run("return rapidView.picture.shapes.children.length") == 1
    # More frames are appended to these. Other parameters are another run; when they are set back, the frames exist.
    bench.ready(SCENE, "-f", "1-30", "--cache", "kept")
    longer = bench.browser.promise(computed)
    assert longer[:20] == first and len(longer) == 30
    run = browser.run("return rapidView.state.status.run")
    set_parameter(browser, "count", 7)
    wait_for_run(browser, run)
    assert browser.promise(computed) != longer
    browser.run("document.querySelector('#parameters h2 button').click()")
    wait_for_run(browser, run + 1)
    assert browser.promise(computed) == longer
    # A truncated file is computed again.
    bench.end()
    next(file for file in bench.path.glob("kept/view/*/frame.0012.rapid")).unlink()
    browser = bench.ready(SCENE, "-f", "1-20", "--cache", "kept")
    go(browser, 12)
    again = browser.promise(computed)
    assert again[:11] == first[:11] and again[12:] == first[12:20]


@test
def a_cached_frame_whose_statistics_are_damaged_is_computed_again(bench):
    bench.ready(SCENE, "-f", "1-10", "--cache", "damaged")
    bench.end()
    journal = next(bench.path.glob("damaged/view/*/journal"))
    whole = journal.read_bytes()
    journal.write_bytes(whole.replace(b'"frame":4,', b'"frame":5,'))  # a record without its checksum
    assert journal.read_bytes() != whole
    browser = bench.ready(SCENE, "-f", "1-10", "--cache", "damaged")
    browser.wait("rapidView.state.statistics.length === 10")
    assert browser.run("return rapidView.state.statistics[3].frame") == 4


@test
def cached_frames_are_computed_again_from_the_first_that_read_a_file_that_has_changed(bench):
    text = """local rapid = require "rapid"
return rapid.create {}
  :emit { source = function(frame) return rapid.points.read(frame.number < 5 and "early.csv" or "late.csv") end,
          from = "points", rate = 24 } :solve {}"""
    heights = "rapidView.ask('sheet', {frame: 9}).then((s) => s.rows.map((r) => r.values.P[1]))"
    (bench.path / "early.csv").write_text("id,Px,Py,Pz\n0,0,1,0\n", encoding="utf-8")
    for late in (2, 3):
        (bench.path / "late.csv").write_text(f"id,Px,Py,Pz\n0,0,{late},0\n", encoding="utf-8")
        browser = bench.ready(text, "-f", "1-10", "--cache", "changed")
        first, *_, last = browser.promise(heights)
        assert (first, last) == (1, late)
        bench.end()


@test
def with_a_cache_memory_holds_what_was_seen_last(bench):
    text = """local rapid = require "rapid"
local P = {}
for i = 1, 50000 do P[i] = {i * 1e-5, 0, 0} end
return rapid.create { points = rapid.points.from { P = P } } :gravity {} :solve {}"""
    browser = bench.ready(text, "-f", "1-60", "--memory", "100M", "--cache", "kept-small")
    status = browser.run("return rapidView.state.status")
    assert status["ready"] == [[1, 60]] and status["bytes"] <= status["most_bytes"] == 50 << 20
    for frame in (3, 59, 17, 30):
        go(browser, frame)
        height = browser.run("return rapidView.picture.message.box[0][1]")
        t = (frame - 1) / 24
        assert abs(height + 9.81 * t * t / 2) < 1e-5 * max(1, -height), (frame, height)


@test
def the_set_options_are_those_of_the_command(bench):
    browser = bench.ready()
    run = browser.run("return rapidView.state.status.run")
    set_parameter(browser, "height", 1.5)
    wait_for_run(browser, run)
    browser.click("#copy-set")
    browser.wait("/height=1.5/.test(document.getElementById('dock-note').textContent)")
    note = browser.run("return document.getElementById('dock-note').textContent").removeprefix("copied: ")
    reported, where = note.split("; ")
    assert where.startswith("paste it after rapid run SCENE in a terminal"), where
    (bench.path / "same.lua").write_text(SCENE, encoding="utf-8")
    subprocess.run(f"'{bench.rapid}' run same.lua -f 7 --quiet -o set.####.csv {reported}", shell=True, cwd=bench.path, check=True)
    with open(bench.path / "set.0007.csv", encoding="ascii") as file:
        row = next(csv.DictReader(file))
    point = browser.promise(f"rapidView.ask('point', {{frame: 7, id: {row['id']}}})")
    assert abs(point["values"]["P"][1] - float(row["Py"])) < 1e-7


@test
def a_saved_module_runs_the_scene_again(bench):
    (bench.path / "sizes.lua").write_text("return { count = 5 }", encoding="utf-8")
    text = SCENE.replace('rapid.param("count", 40, "beads")', 'require("sizes").count')
    browser = bench.ready(text)
    assert browser.run("return document.body.dataset.shown") == "5"
    run = browser.run("return rapidView.state.status.run")
    (bench.path / "sizes.lua").write_text("return { count = 12 }", encoding="utf-8")
    wait_for_run(browser, run)
    assert browser.run("return document.body.dataset.shown") == "12"


@test
def a_script_that_takes_too_long_is_an_error_of_the_page(bench):
    browser = bench.open("""local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :points("wait", function(p, frame) while frame.number > 2 do end end) :solve {}""", "-f", "1-9", "--script-timeout", "1")
    browser.wait("window.rapidView?.state.status?.state === 'failed'")
    assert "script" in browser.run("return document.getElementById('error').innerText")
    go(browser, 2)
    assert browser.run("return document.body.dataset.shown") == "1"


@test
def plays_files_without_a_scene(bench):
    (bench.path / "cache.lua").write_text(SCENE, encoding="utf-8")
    subprocess.run([bench.rapid, "run", "cache.lua", "-f", "3-9", "--quiet", "-o", "cache.####.vdb"], cwd=bench.path,
                   check=True)
    bench.end()
    bench.view = View(bench.rapid, "cache.####.vdb", cwd=bench.path)
    browser = bench.browser
    browser.open(bench.view.address)
    browser.wait("document.body.dataset.shown === '40' && document.body.dataset.frame === '3'")
    browser.wait("document.querySelectorAll('#sheet tr[data-id]').length === 40")
    shown = browser.run("return [...document.querySelectorAll('[role=tab]')].filter((t) => t.offsetParent).length")
    assert shown == 1, "files have no graph and no figures"
    go(browser, 9)
    row = bench.rows(9)[3]
    point = browser.promise("rapidView.ask('point', {frame: 9, id: 3})")
    assert abs(point["values"]["P"][1] - row["Py"]) < 1e-6


@test
def a_chosen_frame_is_shown_once_it_is_computed(bench):
    text = SLOW.replace('"slow", true', '"slow", false').replace("or 1 }", "or 50 }")
    browser = bench.open(text, "-f", "1-10")
    browser.wait("window.rapidView?.state.status?.ready.length && rapidView.state.status.last === 10")
    browser.run("rapidView.go(10)")
    browser.wait("document.body.dataset.frame === '10'")


@test
def plays_at_the_frames_a_second_of_the_scene(bench):
    browser = bench.ready(SCENE.replace("fps = 24", "fps = 40"), "-f", "1-60")
    go(browser, 5)
    browser.run("window.clock = performance.now(); performance.now = () => clock")
    browser.type(" ")
    for milliseconds, frame in ((50, 7), (25, 8), (200, 16)):
        browser.run("clock += arguments[0]", milliseconds)
        browser.wait(f"document.body.dataset.frame === '{frame}'")
    # A browser that was busy for long skips at most a quarter of a second.
    browser.run("clock += 5000")
    browser.wait("document.body.dataset.frame === '26'")
    browser.type(" ")


@test
def a_saved_mesh_runs_the_scene_again(bench):
    corners = "v {0} 0 0\nv {0} 1 0\nv {0} 0 1\nf 1 2 3\n"
    (bench.path / "place.obj").write_text(corners.format(2), encoding="utf-8")
    browser = bench.ready("""local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.read "place.obj", rate = 480 } :solve {}""", "-f", "1-8")
    go(browser, 8)
    assert abs(browser.run("return rapidView.picture.message.box[1][0]") - 2) < 1e-4
    run = browser.run("return rapidView.state.status.run")
    (bench.path / "place.obj").write_text(corners.format(3), encoding="utf-8")
    wait_for_run(browser, run)
    assert abs(browser.run("return rapidView.picture.message.box[1][0]") - 3) < 1e-4


@test
def a_slider_runs_the_scene_while_it_is_dragged(bench):
    browser = bench.ready()
    run = browser.run("return rapidView.state.status.run")
    browser.run("""const slider = document.querySelector('[data-name=count] input[type=range]');
      slider.value = 25; slider.dispatchEvent(new Event('input'));""")
    wait_for_run(browser, run)
    assert browser.run("return document.body.dataset.shown") == "25"
