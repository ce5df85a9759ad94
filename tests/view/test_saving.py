"""Pictures and films."""
import glob
import json
import os
import subprocess
import tempfile

from bench import choose, test


@test
def makes_films_of_a_range(bench):
    browser = bench.ready()
    browser.type("o")
    browser.wait("!document.getElementById('out').hidden")
    browser.run("""window.saved = []; rapidView.out.save = (data, name) => saved.push([name, data.slice()]);
      for (const [id, value] of [['out-width', 160], ['out-height', 90], ['out-first', 3], ['out-last', 14]])
        document.getElementById(id).value = value;""")
    heads = {".mp4": (4, b"ftyp"), ".webm": (0, b"\x1a\x45\xdf\xa3"), ".gif": (0, b"GIF8")}
    for k, (kind, (at, head)) in enumerate(heads.items()):
        choose(browser, "out-kind", kind)
        browser.click("#out-film")
        browser.wait(f"saved.length === {k + 1} && !document.getElementById('out-film').disabled")
        name, data = browser.run(f"return [saved[{k}][0], [...saved[{k}][1]]]")
        assert name == "scene" + kind and bytes(data)[at:at + 4] == head, (name, bytes(data[:12]))
        (bench.path / name).write_bytes(bytes(data))
        probe = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
                                "stream=width,height,nb_read_frames", "-of", "json", name], cwd=bench.path, check=True,
                               capture_output=True, text=True).stdout
        stream = json.loads(probe)["streams"][0]
        assert (stream["width"], stream["height"], int(stream["nb_read_frames"])) == (160, 90, 12), stream
    # The film uses the same renderer: its frames equal those of run, within the colour precision of films.
    subprocess.run([bench.rapid, "run", "scene.lua", "-f", "3-14", "--quiet", "-o", "run.mp4", "--size=160x90",
                    "--camera=" + browser.run("return rapidView.picture.cameraText()")], cwd=bench.path, check=True)
    assert (bench.path / "run.mp4").stat().st_size > 1000
    frames = [subprocess.run(["ffmpeg", "-v", "error", "-i", name, "-f", "rawvideo", "-pix_fmt", "gray", "-"],
                             cwd=bench.path, check=True, capture_output=True).stdout for name in ("scene.mp4", "run.mp4")]
    assert len(frames[0]) == len(frames[1]) == 12 * 160 * 90
    assert sum(abs(a - b) for a, b in zip(*frames)) / len(frames[0]) < 1


@test
def a_film_can_be_given_up(bench):
    browser = bench.ready()
    browser.run("""document.getElementById('save').click();
      for (const [id, value] of [['out-width', 3840], ['out-height', 2160], ['out-first', 1], ['out-last', 30]])
        document.getElementById(id).value = value;""")
    browser.click("#out-film")
    browser.wait("/of 30/.test(document.getElementById('out-text').textContent)")
    browser.click("#out-cancel")
    browser.wait("!document.getElementById('out-film').disabled && document.getElementById('out-progress').offsetParent === null")
    assert browser.promise("rapidView.ask('film_progress').catch((e) => e.message)") == "no film is being made"
    assert not glob.glob(os.path.join(tempfile.gettempdir(), "rapid-film-*")), "the film's folder is left"
    refused = browser.promise("rapidView.ask('film', {extension: '.mp4', first: 1, last: 3, width: 161, height: 90})"
                              ".catch((e) => e.message)")
    assert "even" in refused, refused


@test
def a_frame_is_saved_by_the_renderer(bench):
    browser = bench.ready()
    head = browser.promise("rapidView.ask('picture', {frame: 5, width: 320, height: 180})"
                           ".then(({data}) => [...data.slice(0, 24)])")
    assert bytes(head[:8]) == b"\x89PNG\r\n\x1a\n"
    assert head[16:24] == [0, 0, 1, 64, 0, 0, 0, 180]
