"""Runs, parameters, the timeline, files, the cache."""
import csv
import subprocess
import time

from bench import SCENE, go, set_parameter, test, wait_for_run
from browser import View


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
def the_set_options_are_those_of_the_command(bench):
    browser = bench.ready()
    run = browser.run("return rapidView.state.status.run")
    set_parameter(browser, "height", 1.5)
    wait_for_run(browser, run)
    browser.click("#copy-set")
    browser.wait("/height=1.5/.test(document.getElementById('dock-note').textContent)")
    told = browser.run("return document.getElementById('dock-note').textContent").removeprefix("copied: ")
    (bench.path / "same.lua").write_text(SCENE, encoding="utf-8")
    subprocess.run(f"'{bench.rapid}' run same.lua -f 7 --quiet -o set.####.csv {told}", shell=True, cwd=bench.path, check=True)
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
