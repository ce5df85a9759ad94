"""Points, regions, the spreadsheet, figures and warnings."""
import json
import math
import re
import struct
import time

from bench import choose, go, test


def bits(number):
    """Returns the 32-bit pattern of a single-precision number."""
    return struct.pack("f", float(number))


@test
def a_click_on_a_point_tells_its_values_as_run_writes_them(bench):
    browser = bench.ready()
    go(browser, 12)
    browser.type("f")
    rows = bench.rows(12)
    for row in (rows[3], rows[20]):
        place = browser.run("""const e = rapidView.picture.matrix().elements, p = arguments[0];
          const at = [0, 1, 3].map((k) => e[k] * p[0] + e[4 + k] * p[1] + e[8 + k] * p[2] + e[12 + k]);
          const box = document.getElementById('canvas').getBoundingClientRect();
          return [box.left + (0.5 + at[0] / at[2] / 2) * box.width, box.top + (0.5 - at[1] / at[2] / 2) * box.height];""",
                            [row["Px"], row["Py"], row["Pz"]])
        browser.click_at(*place)
        browser.wait("document.querySelector('#attributes [data-attribute=\"id\"] td')?.textContent === "
                     f"'{int(row['id'])}'")
        shown = browser.run("""return Object.fromEntries([...document.querySelectorAll('#attributes tr')].map((row) =>
          [row.dataset.attribute, row.querySelector('td').textContent]))""")
        for text, name in zip([*shown["P"].split(), shown["heat"], shown["pscale"]], ("Px", "Py", "Pz", "heat", "pscale")):
            assert bits(text) == bits(row[name]), (shown, row)  # the same value, in as few digits as identify it
        assert shown["pscale"] == "0.04"


@test
def tells_the_life_of_a_point(bench):
    browser = bench.ready()
    browser.run("rapidView.go(30)")
    browser.run("document.getElementById('sheet-tab').click()")
    browser.wait("document.querySelector('#sheet [data-id=\"5\"]')")
    browser.run("document.querySelector('#sheet [data-id=\"5\"]').click()")
    browser.wait("document.getElementById('trace')")
    browser.run("document.getElementById('trace').click()")
    browser.wait("document.querySelector('#life .contact')")
    contact = browser.run("return document.querySelector('#life .contact').innerText")
    # Gravity and the drag of still air, 1/s, until the bead of 0.04 m touches: y = 2 - g (t - 1 + exp(-t)).
    low, high = 0.0, 2.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if 9.81 * (middle - 1 + math.exp(-middle)) < 1.96 else (low, middle)
    reported = float(contact.split(",")[-1].split()[0])
    assert "meets floor" in contact and abs(reported - low) < 1e-3, (contact, low)
    assert "born in create1" in browser.run("return document.querySelector('#life .birth').innerText")


@test
def tells_the_life_of_a_point_of_merged_chains(bench):
    browser = bench.ready("""local rapid = require "rapid"
local function chain(name, x)
  return rapid.create { name = name, points = rapid.points.from { P = {{x, 1, 0}, {x, 2, 0}} } } :gravity {} :solve {}
end
return chain("left", -1):merge(chain("right", 1))""")
    go(browser, 8)
    rows = browser.promise("rapidView.ask('sheet', {frame: 8}).then((s) => s.rows.map((r) => [r.values.id, r.values.P]))")
    assert len(rows) == 4 and len({row[0] for row in rows}) == 4
    for ident, place in rows:
        life = browser.promise(f"rapidView.ask('trace', {{frame: 8, id: {ident}, last: 8}}).then((t) => t.lives)")
        assert len(life) == 1
        assert life[0]["simulation"] == ("left" if place[0] < 0 else "right")
        assert life[0]["steps"][-1]["values"]["P"] == place


@test
def the_path_of_a_point_is_drawn(bench):
    browser = bench.ready()
    go(browser, 20)
    browser.run("rapidView.choosePoint(4)")
    browser.wait("rapidView.picture.path.visible && document.querySelector('[data-curve=speed]')")
    path = browser.run("return [...rapidView.picture.path.geometry.getAttribute('position').array]")
    assert len(path) == 30 * 3
    for frame in (1, 11, 30):
        row = bench.rows(frame)[4]
        assert max(abs(path[3 * (frame - 1) + k] - row[n]) for k, n in enumerate(("Px", "Py", "Pz"))) < 1e-6
    box = browser.run("const b = document.querySelector('[data-curve=speed] canvas').getBoundingClientRect();"
                      "return [b.left, b.top, b.width, b.height]")
    browser.click_at(box[0] + box[2] * (8 - 1) / 29, box[1] + box[3] / 2)
    browser.wait("document.body.dataset.frame === '8'")


@test
def warnings_lead_to_their_first_frame(bench):
    browser = bench.open("""local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.shape.sphere { radius = 0.1 }, rate = 240 }
  :collide { shape = rapid.shape.sphere { radius = 1 }, response = "die" } :solve {}""")
    browser.wait("window.rapidView?.state.status?.state === 'done'")
    first = browser.run("return rapidView.state.status.warnings.filter((w) => w.frame > 0)[0]")
    assert first and first["frame"] > 1, browser.run("return rapidView.state.status.warnings")
    go(browser, 1)
    browser.run("document.querySelector('#messages li button').click()")
    browser.wait(f"document.body.dataset.frame === '{first['frame']}'")


@test
def a_region_tells_counts_and_ranges(bench):
    browser = bench.ready()
    go(browser, 1)
    browser.type("f")
    time.sleep(0.3)
    box = browser.run("const b = document.getElementById('canvas').getBoundingClientRect();"
                      "return [b.left, b.top, b.right, b.bottom]")
    browser.drag(box[0] + 3, box[1] + 3, box[2] - 3, box[3] - 3, shift=True)
    browser.wait("!document.getElementById('region').hidden")
    text = browser.run("return document.getElementById('region').innerText")
    assert "40 POINTS" in text.upper(), text
    speeds = [math.hypot(row["vx"], row["vy"], row["vz"]) for row in bench.rows(1)]
    heats = [row["heat"] for row in bench.rows(1)]
    for name, values in (("speed", speeds), ("heat", heats)):
        line = next(line for line in text.splitlines() if line.startswith(name))
        reported = [float(number) for number in line.split()[1:]]
        for number, value in zip(reported, (min(values), sum(values) / len(values), max(values))):
            assert abs(number - value) <= 1e-3 * abs(value), (line, value)


@test
def the_spreadsheet_sorts(bench):
    browser = bench.ready()
    go(browser, 12)
    browser.run("document.getElementById('sheet-tab').click()")
    browser.wait("document.querySelectorAll('#sheet [data-id]').length === 40")
    for _ in range(2):
        browser.run("[...document.querySelectorAll('#sheet th')].find((h) => h.textContent.startsWith('heat')).click()")
        time.sleep(0.2)
    browser.wait("document.querySelector('#sheet [data-id]').dataset.id === '39'")


@test
def figures_over_frames_lead_to_a_frame(bench):
    browser = bench.ready()
    browser.wait("rapidView.state.statistics.length === 30")
    browser.run("document.getElementById('figures-tab').click()")
    box = browser.wait("(() => { const c = document.querySelector('#figures figure:not([hidden]) canvas');"
                       "if (!c) return null; const b = c.getBoundingClientRect();"
                       "return [b.left, b.top, b.width, b.height]; })()")
    browser.click_at(box[0] + box[2] / 2, box[1] + box[3] / 2)
    browser.wait("Math.abs(Number(document.body.dataset.frame) - 15.5) < 1.5")


@test
def the_spreadsheet_shows_a_group_and_is_walked_by_keys(bench):
    browser = bench.ready()
    go(browser, 12)
    warm = [int(row["id"]) for row in bench.rows(12) if row["group:warm"]]
    assert 2 < len(warm) < 40
    browser.run("document.getElementById('sheet-tab').click()")
    choose(browser, "group", "warm")
    listed = "[...document.querySelectorAll('#sheet [data-id]')].map((row) => Number(row.dataset.id))"
    browser.wait(f"JSON.stringify({listed}) === '{json.dumps(warm, separators=(',', ':'))}'")
    browser.run("document.getElementById('sheet').focus()")
    for step, place in (("\ue015", 0), ("\ue015", 1), ("\ue013", 0)):  # down, down, up
        browser.type(step)
        browser.wait(f"rapidView.state.point === {warm[place]}")
        browser.wait(f"document.querySelector('#sheet .chosen')?.dataset.id === '{warm[place]}'")
    # The point in the middle of the picture, once the mark has left the previously selected one.
    row = bench.rows(12)[warm[0]]
    place = json.dumps([row[name] for name in ("Px", "Py", "Pz")])
    browser.wait(f"rapidView.picture.marked?.every((x, k) => Math.abs(x - {place}[k]) < 1e-6)")
    browser.type(".")
    browser.wait(f"rapidView.picture.target.toArray().every((x, k) => Math.abs(x - {place}[k]) < 1e-6)")


@test
def seconds_of_the_stages_are_those_of_the_frame(bench):
    browser = bench.ready()
    go(browser, 12)
    browser.wait("rapidView.state.statistics.length === 30")
    browser.run("document.getElementById('figures-tab').click()")
    reported = browser.wait("""[...document.querySelectorAll('#figures figure')].filter((f) => f.offsetParent)
      .map((f) => f.querySelector('figcaption').innerText).find((t) => t.includes('scripts'))""")
    expected = browser.run("return rapidView.state.statistics[11].seconds")
    units = {"µs": 1e-6, "ms": 1e-3, "s": 1.0}
    numbers = [float(number) * units[of] for number, of in re.findall(r"([\d.]+(?:e-?\d+)?) (µs|ms|s)\b", reported)]
    for number, stage in zip(numbers, ("solve", "script", "graph")):
        assert abs(number - expected[stage]) <= 0.01 * expected[stage] + 1e-6, (reported, expected)
