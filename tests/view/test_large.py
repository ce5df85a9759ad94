"""Graphs and runs of realistic sizes, for a long time."""
from bench import go, test
from client import Client


@test
def a_scene_of_ten_thousand_frames_is_walked_through(bench):
    browser = bench.open("""local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} }, fps = 24 } :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 1 } :solve {}""", "-f", "1-10000")
    browser.wait("window.rapidView?.state.statistics.length === 10000")
    browser.run("document.getElementById('figures-tab').click()")
    for frame in (10000, 1, 7777):
        go(browser, frame)
    for k in range(20):
        browser.run(f"rapidView.go({1 + k * 499})")
    browser.wait("document.body.dataset.frame === '9482'")
    # The curves extend to the last frame, whichever is shown.
    browser.wait("""(() => { const c = [...document.querySelectorAll('#figures canvas')].find((c) => c.offsetParent);
      const data = c.getContext('2d').getImageData(c.width - 3, 0, 2, c.height).data;
      return data.some((value, k) => k % 4 === 3 && value > 0); })()""")
    box = browser.run("const b = document.querySelector('#timeline canvas').getBoundingClientRect();"
                      "return [b.left, b.top, b.width, b.height]")
    browser.click_at(box[0] + box[2] - 6, box[1] + box[3] / 2)
    browser.wait("document.body.dataset.frame === '10000'")


@test
def scrubbing_grows_nothing(bench):
    browser = bench.ready()
    scrub = """(async () => { for (let i = 0; i < 1500; ++i)
      await rapidView.ask('frame', {frame: 1 + i * 7 % 30, colour: ['', 'heat', 'speed'][i % 3]}); return 1; })()"""
    browser.promise(scrub)
    before = bench.view.memory()
    browser.promise(scrub)
    assert bench.view.memory() - before < 4 << 20, bench.view.memory() - before


@test
def a_run_takes_the_pages_of_the_one_before(bench):
    def faults():
        with open(f"/proc/{bench.view.process.pid}/stat", encoding="ascii") as file:
            return int(file.read().rsplit(")", 1)[1].split()[7])

    bench.open("""local rapid = require "rapid"
local rate = rapid.param("rate", 1e6, "points per second")
return rapid.create { fps = 24, seed = 3 } :emit { source = rapid.mesh.torus {}, rate = rate, life = 0.1 } :gravity {}
  :solve {}""", "-f", "1-40")
    client = Client(bench.view)
    values = client.until_done()["values"]
    first = faults()
    client.ask("set", values={**values, "rate": 1000001})
    client.until_done(run=2)
    client.close()
    assert faults() - first < first / 5, (first, faults() - first)
