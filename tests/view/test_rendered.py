"""The rendered picture equals that of rapid run: the same colours, camera and bytes."""
import base64
import json
import subprocess

from bench import choose, go, test
from browser import wait_for

# Points that add their light, in streaks, half transparent, among shapes that cast shadows.
LIT = """local rapid = require "rapid"
return rapid.create { seed = 2 }
  :emit { source = rapid.mesh.sphere { radius = 0.3, center = {0, 1, 0} }, rate = 300, life = 1, velocity = {0, 3, 0},
          spread = 20, attributes = { Cd = {0.9, 0.4, 0.1}, pscale = 0.05, Alpha = 0.4 } }
  :group { name = "bright", where = function(p) return p.id % 3 == 0 end }
  :gravity {}
  :collide { shape = rapid.shape.plane {} }
  :collide { shape = rapid.shape.box { size = {0.5, 0.5, 0.5}, center = {0.6, 0.25, 0} } } :solve {}
  :picture { shutter = 0.5, camera = { [1] = rapid.camera { position = {0.5, 1.5, 5}, target = {0, 0.8, 0} },
                                       [12] = rapid.camera { position = {2, 2, 4}, target = {0, 1, 0}, fov = 40 } } }
  :picture { group = "bright", blend = "add" }
"""

BALLS = """local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1.2, 1, 0}, {2.4, 1, 0}}, pscale = {0.5, 0.5, 0.5},
  Cd = {{0.5, 0.2, 0.03}, {0.18, 0.18, 0.18}, {0.8, 0.8, 0.8}} } } :solve {}
"""

# The largest difference of any channel between a .png and an image or canvas of the page, in boxes [x, y, width,
# height], or everywhere.
DIFFERENCE = """(async () => {
  const png = new Image(), shown = document.getElementById(%s);
  png.src = "data:image/png;base64,%s";
  await png.decode();
  const pixels = (source, width, height) => {
    const canvas = document.createElement("canvas");
    canvas.width = width; canvas.height = height;
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(source, 0, 0);
    return context;
  };
  const width = shown.naturalWidth || shown.width, height = shown.naturalHeight || shown.height;
  if (width !== png.naturalWidth || height !== png.naturalHeight) return `${width} x ${height}`;
  const a = pixels(png, width, height), b = pixels(shown, width, height);
  let most = 0;
  for (const box of %s ?? [[0, 0, width, height]]) {
    const x = a.getImageData(...box).data, y = b.getImageData(...box).data;
    for (let i = 0; i < x.length; ++i) most = Math.max(most, Math.abs(x[i] - y[i]));
  }
  return most;
})()"""


def difference(bench, frame, element, *arguments, boxes=None):
    """Returns the difference between the page's view of a frame and the .png of rapid run, at the size of the
    canvas."""
    width, height = bench.browser.run("const c = document.getElementById('canvas'); return [c.width, c.height]")
    subprocess.run([bench.rapid, "run", "scene.lua", "-f", str(frame), "--quiet", "-o", "same.####.png",
                    f"--size={width}x{height}", *arguments], cwd=bench.path, check=True)
    png = base64.b64encode((bench.path / f"same.{frame:04d}.png").read_bytes()).decode()
    return bench.browser.promise(DIFFERENCE % (json.dumps(element), png, json.dumps(boxes)))


def wait_for_rendered(browser, frame):
    browser.wait("!document.getElementById('rendered').hidden"
                 f" && document.getElementById('rendered').dataset.frame === '{frame}'")


@test
def in_pictures_the_page_shows_the_png_of_run(bench):
    browser = bench.ready(LIT, "-f", "1-12")
    choose(browser, "style", "picture")
    for frame in (5, 12):
        go(browser, frame)
        wait_for_rendered(browser, frame)
        assert difference(bench, frame, "rendered") == 0
    boxes = browser.run("""return ['canvas', 'rendered'].map((id) =>
      JSON.stringify(document.getElementById(id).getBoundingClientRect()))""")
    assert boxes[0] == boxes[1]
    # From another viewpoint: the picture disappears at once, and is rendered again.
    assert browser.run("rapidView.picture.look(0.3, 0.2); return document.getElementById('rendered').hidden")
    wait_for_rendered(browser, 12)
    camera = browser.run("return rapidView.picture.cameraText()")
    assert difference(bench, 12, "rendered", f"--camera={camera}") == 0
    # The page shows what a rendered picture lacks.
    choose(browser, "group", "bright")
    wait_for(lambda: browser.run("return document.body.dataset.shown < rapidView.picture.message.total"))
    assert browser.run("return document.getElementById('rendered').hidden")


@test
def spheres_have_the_colours_of_pictures(bench):
    browser = bench.ready(BALLS, "-f", "1-2")
    go(browser, 1)
    browser.run("rapidView.picture.setCamera([1.2, 2, 7, 1.2, 1, 0, 30])")
    browser.click("#ground")
    browser.wait("!rapidView.picture.due")  # it is drawn
    camera = browser.run("return rapidView.picture.cameraText()")
    centres = browser.run("""const p = rapidView.picture, m = p.matrix(), c = document.getElementById('canvas');
      return [0, 1.2, 2.4].map((x) => { const v = p.target.clone().set(x, 1, 0).applyMatrix4(m);
        return [Math.round((0.5 + v.x / 2) * c.width), Math.round((0.5 - v.y / 2) * c.height)]; });""")
    boxes = [[x - 12, y - 12, 25, 25] for x, y in centres]
    most = difference(bench, 1, "canvas", f"--camera={camera}", boxes=boxes)
    # One for the dither, and one for each of two roundings to bytes.
    assert most <= 3, most


@test
def the_page_looks_through_the_camera_of_the_scene(bench):
    browser = bench.ready(LIT, "-f", "1-12")
    go(browser, 1)
    seen = "rapidView.picture.cameraText().split(',').map(Number)"

    def is_at(position):
        return all(abs(a - b) < 1e-4 for a, b in zip(browser.run(f"return {seen}"), position))

    wait_for(lambda: is_at([0.5, 1.5, 5, 0, 0.8, 0]))
    go(browser, 12)
    wait_for(lambda: is_at([2, 2, 4, 0, 1, 0, 40]))
    browser.run("rapidView.picture.look(0.3, 0.2)")
    own = browser.run(f"return {seen}")
    go(browser, 1)
    browser.wait("rapidView.picture.sceneCamera[0] === 0.5")  # the frame's camera is known
    assert browser.run(f"return {seen}") == own
    browser.type("0")
    wait_for(lambda: is_at([0.5, 1.5, 5, 0, 0.8, 0]))
