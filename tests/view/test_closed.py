"""What the server refuses, hostile names, the sandbox."""
import http.client
import json
import socket
import subprocess

from bench import choose, set_parameter, test, wait_for_run
from browser import View


def request(view, target, headers=None, method="GET"):
    connection = http.client.HTTPConnection("127.0.0.1", view.port, timeout=10)
    connection.putrequest(method, target, skip_host=True)
    for name, value in {"Host": f"127.0.0.1:{view.port}", **(headers or {})}.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer.status, text, answer


@test
def hostile_names_are_text(bench):
    evil = "<img src=x onerror=window.evil=1><script>window.evil=1</script>&quot;'\\\"{}"
    lua = evil.replace("\\", "\\\\").replace('"', '\\"')
    lines = ['local rapid = require "rapid"', "local made = {}"]
    lines += [f'rapid.param("{lua} p{i}", {i + 1}, "{lua}")' for i in range(70)]
    lines += ['local chain = rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }']
    lines += [f'chain = chain:gravity {{ name = "{lua} n{i}" }}' for i in range(60)]
    lines += ["return chain:solve {}"]
    browser = bench.open("\n".join(lines), "-f", "1-3")
    browser.wait("window.rapidView?.state.status?.state === 'done' && document.querySelectorAll('#graph .node').length > 60")
    assert browser.run("return document.querySelectorAll('.parameter').length") == 70
    assert browser.run("return document.querySelector('.parameter .name').textContent") == evil + " p0"
    assert browser.run("return [...document.querySelectorAll('#graph .node')].map((n) => n.dataset.node)")[1] == evil + " n0"
    assert browser.run("return document.querySelectorAll('#side img, #side script, #dock img, #dock script').length") == 0
    (bench.path / "scene.lua").write_text('local rapid = require "rapid"\nerror("' + lua + '")', encoding="utf-8")
    browser.wait("!document.getElementById('error').hidden")
    assert evil in browser.run("return document.getElementById('error').textContent")
    assert browser.run("return document.querySelectorAll('#error img, #error script').length") == 0
    assert browser.run("return window.evil === undefined")
    # Attributes of a scene have plain names; those of a file may have any.
    names = [f"<img src=x onerror=window.evil=1><b>&amp;{i}</b>" for i in range(70)]
    (bench.path / "evil.0001.csv").write_text(
        ",".join(["id", "Px", "Py", "Pz", "vx", "vy", "vz", *names]) + "\n" +
        "".join(",".join([str(k), "0", str(k), "0", "0", "0", "0", *[str(i * k) for i in range(70)]]) + "\n"
                for k in range(5)), encoding="utf-8")
    bench.end()
    bench.view = View(bench.rapid, "evil.####.csv", cwd=bench.path)
    browser.open(bench.view.address)
    browser.wait("document.querySelectorAll('#sheet th').length > 70")
    heads = browser.run("return [...document.querySelectorAll('#sheet th')].map((t) => t.textContent)")
    assert set(names) <= set(heads), heads
    choose(browser, "colour", names[7])
    browser.wait("!document.getElementById('legend').hidden")
    assert names[7] in browser.run("return document.getElementById('legend').textContent")
    browser.run("rapidView.choosePoint(3)")
    browser.wait("document.querySelectorAll('#attributes tr').length > 70")
    assert browser.run("return document.querySelectorAll('#view img, #bar img, #side img, #dock img, b:not(#error b)').length") == 0
    assert browser.run("return window.evil === undefined")


@test
def refuses_strangers(bench):
    bench.ready()
    view = bench.view
    cookie = {"Cookie": f"rapid_{view.port}={view.token}"}
    assert request(view, f"/?token={view.token}")[0] == 200
    assert request(view, "/page.js", cookie)[0] == 200
    assert request(view, "/three.module.js", cookie)[0] == 200
    wrong = view.token[:-1] + ("0" if view.token[-1] != "0" else "1")
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    origin = {"Origin": f"http://127.0.0.1:{view.port}"}
    for target, headers in [
            ("/", {}), ("/page.js", {}), (f"/?token={wrong}", {}), ("/?token=", {}),
            ("/page.js", {"Cookie": f"rapid_{view.port}={wrong}"}),
            (f"/?token={view.token}", {"Host": f"evil.example:{view.port}"}),
            ("/page.js", {**cookie, "Host": "evil.example"}),
            ("/page.js", {**cookie, "Host": "127.0.0.1.evil.example"}),
            ("/page.js", {**cookie, "Origin": "http://evil.example"}),
            ("/page.js", {**cookie, "Origin": "null"}),
            ("/socket", upgrade), ("/socket", {**upgrade, **origin}),
            ("/socket", {**upgrade, **cookie, "Origin": "http://evil.example"})]:
        status, text, _ = request(view, target, headers)
        assert status == 403, (target, headers, status)
        assert b"<" not in text
    for target in ("/../../../etc/passwd", "/..%2f..%2fetc/passwd", "/page/../../simulation.cpp", "//etc/passwd",
                   "/%2e%2e/server.cpp", "/scene.lua"):
        status, text, _ = request(view, target, cookie)
        assert status in (400, 404), (target, status)
        assert b"root:" not in text and b"#include" not in text and b"rapid.create" not in text
    assert request(view, "/socket", {**upgrade, **cookie})[0] == 404, "a socket without an Origin"
    assert request(view, "/socket", {**upgrade, **cookie, **origin})[0] == 101
    assert request(view, "/page.js", cookie, "POST")[0] == 405
    policy = request(view, f"/?token={view.token}")[2].getheader("Content-Security-Policy")
    assert "default-src 'none'" in policy and "unsafe" not in policy
    listening = subprocess.run(["grep", "-i", f":{view.port:04X} 00000000:0000 0A", "/proc/net/tcp"], check=True,
                               capture_output=True, text=True).stdout
    assert listening.split()[1].startswith("0100007F:"), listening


@test
def a_page_outlives_a_lost_connection(bench):
    browser = bench.ready()
    for _ in range(2):
        browser.run("rapidView.connection.socket.close()")
        browser.wait("rapidView.connection.socket.readyState === 1")
    assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3
    run = browser.run("return rapidView.state.status.run")
    set_parameter(browser, "count", 9)
    wait_for_run(browser, run)


@test
def damaged_requests_end_nothing(bench):
    browser = bench.ready()
    for text in ("", "{", "[]", "null", '{"re": 1}', '{"re": -1, "do": "frame"}', '{"re": "x"}', "\\u0000" * 100):
        browser.run("""const s = new WebSocket(`ws://${location.host}/socket`);
          s.onopen = () => { s.send(arguments[0]); };""".replace("arguments[0]", json.dumps(text)))
    for wish in ("{frame: 1e300}", "{frame: 'x'}", "{}", "{frame: 5, colour: 'nothing'}", "{frame: 5, group: 'none'}",
                 "{frame: 5, after: 'nobody'}", "{frame: -5}", "{frame: 5, output: 'else'}"):
        kept = browser.promise(f"rapidView.ask('frame', {wish}).then(() => 'told', (e) => 'refused')")
        assert kept == "refused", wish
    assert browser.promise("rapidView.ask('nothing').catch((e) => e.message)") == 'there is no request "nothing"'
    assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3
