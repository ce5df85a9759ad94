"""Requests that the server refuses, hostile names, the sandbox."""
import http.client
import http.server
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time
import types

from bench import choose, SCENE, go, set_parameter, test, wait_for_run
from browser import PATIENCE, View, wait_for
from client import Client, frame_of, open_socket, upgrade


def request(view, target, headers=None, method="GET"):
    connection = http.client.HTTPConnection("127.0.0.1", view.port, timeout=PATIENCE)
    connection.putrequest(method, target, skip_host=True)
    for name, value in {"Host": f"127.0.0.1:{view.port}", **(headers or {})}.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer.status, text, answer


def confinement(view):
    with open(f"/proc/{view.process.pid}/status", encoding="ascii") as file:
        return dict(line.rstrip("\n").split(":\t", 1) for line in file if ":\t" in line)


def is_established(view, raw):
    """Returns true if the view's end of a connection is open, without reading received data."""
    here, there = f":{view.port:04X}", f":{raw.getsockname()[1]:04X}"
    with open("/proc/net/tcp", encoding="ascii") as file:
        rows = [line.split() for line in file][1:]
    return any(row[1].endswith(here) and row[2].endswith(there) and row[3] == "01" for row in rows)


def is_closed(raw):
    """Reads the received data, and returns true if the other end has closed."""
    try:
        while raw.recv(1 << 20):
            pass
    except ConnectionResetError:
        pass
    except socket.timeout:
        return False
    return True


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
    # The legend of the speed appears first.
    wait_for(lambda: names[7] in browser.run("return document.getElementById('legend').textContent"))
    browser.run("rapidView.choosePoint(3)")
    browser.wait("document.querySelectorAll('#attributes tr').length > 70")
    assert browser.run("return document.querySelectorAll('#view img:not(#rendered), #bar img, #side img, #dock img, b:not(#error b)').length") == 0
    assert browser.run("return window.evil === undefined")


@test
def refuses_strangers(bench):
    bench.ready()
    view = bench.view
    # The page's own files are public, but not embeddable in other sites, and contain no token.
    for target in ("/", f"/?token={view.token}", "/page.js", "/three.module.js"):
        status, text, answer = request(view, target)
        assert status == 200 and view.token.encode() not in text + bytes(answer.headers), target
        assert answer.getheader("Set-Cookie") is None
    wrong = view.token[:-1] + ("0" if view.token[-1] != "0" else "1")
    right = upgrade(view)
    nothing = {name: value for name, value in right.items() if name != "Sec-WebSocket-Protocol"}
    for target, headers in [
            ("/", {"Host": f"evil.example:{view.port}"}), ("/page.js", {"Host": "evil.example"}),
            ("/page.js", {"Host": "127.0.0.1.evil.example"}), ("/page.js", {"Origin": "http://evil.example"}),
            ("/page.js", {"Origin": "null"}), ("/socket", nothing),
            ("/socket", {**nothing, "Sec-WebSocket-Protocol": "rapid"}), ("/socket", upgrade(view, wrong)),
            ("/socket", {**nothing, "Sec-WebSocket-Protocol": view.token}),
            ("/socket", {**nothing, "Cookie": f"rapid_{view.port}={view.token}"}),
            (f"/socket?token={view.token}", nothing), ("/socket", {**right, "Origin": "http://evil.example"}),
            ("/socket", {**right, "Origin": f"http://127.0.0.1:{view.port + 1}"}),
            ("/socket", {**right, "Host": f"evil.example:{view.port}"})]:
        status, text, _ = request(view, target, headers)
        assert status == 403, (target, headers, status)
        assert b"<" not in text
    for target in ("/../../../etc/passwd", "/..%2f..%2fetc/passwd", "/page/../../simulation.cpp", "//etc/passwd",
                   "/%2e%2e/server.cpp", "/scene.lua"):
        status, text, _ = request(view, target)
        assert status in (400, 404), (target, status)
        assert b"root:" not in text and b"#include" not in text and b"rapid.create" not in text
    without_origin = {name: value for name, value in right.items() if name != "Origin"}
    assert request(view, "/socket", without_origin)[0] == 404
    status, _, answer = request(view, "/socket", right)
    assert status == 101 and answer.getheader("Sec-WebSocket-Protocol") == "rapid"
    # A header with the cookies of as many servers as a browser keeps.
    others = "; ".join(f"other_{port}={'0' * 32}" for port in range(20000, 20179))
    assert request(view, "/socket", {**right, "Cookie": others})[0] == 101
    assert request(view, "/page.js", method="POST")[0] == 405
    policy = request(view, f"/?token={view.token}")[2].getheader("Content-Security-Policy")
    assert "default-src 'none'" in policy and "unsafe" not in policy
    listening = subprocess.run(["grep", "-i", f":{view.port:04X} 00000000:0000 0A", "/proc/net/tcp"], check=True,
                               capture_output=True, text=True).stdout
    assert listening.split()[1].startswith("0100007F:"), listening


@test
def an_untrusted_scene_is_shown_in_the_sandbox(bench):
    browser = bench.ready(SCENE, "-f", "1-12", "--untrusted")
    assert confinement(bench.view)["Seccomp"] == "2" and confinement(bench.view)["NoNewPrivs"] == "1"
    go(browser, 9)
    row = bench.rows(9)[3]
    point = browser.promise("rapidView.ask('point', {frame: 9, id: 3})")
    assert abs(point["values"]["P"][1] - row["Py"]) < 1e-7
    # The page itself lays out the graph; films would need another program.
    assert browser.run("return document.querySelectorAll('#graph .node').length") == 11
    browser.type("o")
    assert browser.run("return document.getElementById('out-film').offsetParent === null")
    refused = browser.promise("rapidView.ask('film', {extension: '.gif', first: 1, last: 2}).catch((e) => e.message)")
    assert "--untrusted" in refused, refused
    # The view still accepts changes, and reads nothing outside of its folder.
    run = browser.run("return rapidView.state.status.run")
    with tempfile.TemporaryDirectory() as elsewhere:
        stolen = pathlib.Path(elsewhere, "secret.obj")
        stolen.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
        (bench.path / "scene.lua").write_text(SCENE.replace(
            'require "rapid"\n', f'require "rapid"\nlocal stolen = rapid.mesh.read "{stolen}"\n', 1), encoding="utf-8")
        browser.wait(f"rapidView.state.status.run > {run} && rapidView.state.status.state === 'failed'")
    assert "secret.obj" in browser.run("return document.getElementById('error').innerText")
    (bench.path / "scene.lua").write_text(SCENE, encoding="utf-8")
    wait_for_run(browser, run + 1)
    assert request(bench.view, "/socket", upgrade(bench.view, "0" * 32))[0] == 403


@test
def a_server_on_another_port_gets_no_token(bench):
    browser = bench.ready()
    got = []

    class Other(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            got.append(f"{self.requestline}\n{self.headers}")
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<p>other</p>")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Other)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        assert browser.run("return document.cookie") == ""
        browser.open(f"http://127.0.0.1:{server.server_port}/")
        assert browser.run("return sessionStorage.length + document.cookie.length") == 0
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
    assert got and bench.view.token not in "".join(got), got
    # The browser tab has stored the token for the view.
    browser.open(f"http://127.0.0.1:{bench.view.port}/")
    browser.wait("window.rapidView?.state.status?.state === 'done'")


@test
def oversized_messages_end_their_connection_alone(bench):
    browser = bench.ready()
    raw = open_socket(bench.view)
    before = bench.view.memory()
    raw.sendall(bytes([0x81, 0xff]) + (1 << 40).to_bytes(8, "big") + b"\0\0\0\0" + b"x" * 1000)
    assert is_closed(raw)
    with open_socket(bench.view) as raw:
        try:
            raw.sendall(frame_of("x" * (2 << 20)))
        except (ConnectionResetError, BrokenPipeError):
            pass
        assert is_closed(raw)
    assert bench.view.memory() - before < 8 << 20
    for target, size in ((f"/?{'x' * 40000}", 0), ("/", 1 << 20)):
        connection = http.client.HTTPConnection("127.0.0.1", bench.view.port, timeout=PATIENCE)
        try:
            connection.putrequest("GET", target, skip_host=True)
            connection.putheader("Host", f"127.0.0.1:{bench.view.port}")
            if size:
                connection.putheader("Content-Length", str(size))
            connection.endheaders()
            connection.send(b"x" * size)
            assert connection.getresponse().status in (400, 403, 413, 431)
        except (ConnectionError, http.client.HTTPException):
            pass  # closed without an answer
        finally:
            connection.close()
    assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3


@test
def a_reader_that_does_not_read_slows_nobody(bench):
    browser = bench.ready("""local rapid = require "rapid"
local P = {}
for i = 1, 200000 do P[i] = {i * 1e-5, 0, 0} end
return rapid.create { points = rapid.points.from { P = P } } :gravity {} :solve {}""", "-f", "1-6")
    before = bench.view.memory()
    with open_socket(bench.view) as raw:
        for k in range(400):  # of 1.6 MB each
            raw.sendall(frame_of(json.dumps({"re": k, "do": "frame", "frame": 1 + k % 6})))
        for frame in (2, 5, 3):
            go(browser, frame)
        assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3
        wait_for(lambda: not is_established(bench.view, raw))  # a connection that was read earlier would stay open
        wait_for(lambda: bench.view.memory() - before < 256 << 20)
        assert is_closed(raw), "it waits for ever"
    wait_for(lambda: bench.view.memory() - before < 64 << 20)


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
        browser.run("""const s = new WebSocket(`ws://${location.host}/socket`, rapidView.connection.protocols());
          s.onopen = () => { s.send(arguments[0]); };""".replace("arguments[0]", json.dumps(text)))
    for wish in ("{frame: 1e300}", "{frame: 'x'}", "{}", "{frame: 5, colour: 'nothing'}", "{frame: 5, group: 'none'}",
                 "{frame: 5, after: 'nobody'}", "{frame: -5}", "{frame: 5, output: 'else'}"):
        kept = browser.promise(f"rapidView.ask('frame', {wish}).then(() => 'told', (e) => 'refused')")
        assert kept == "refused", wish
    assert browser.promise("rapidView.ask('nothing').catch((e) => e.message)") == 'there is no request "nothing"'
    assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3


@test
def closed_pages_leave_nothing_behind(bench):
    bench.ready()
    before = bench.view.descriptors()
    for k in range(400):
        with open_socket(bench.view) as raw:  # waits for data that never arrives
            raw.sendall(frame_of(json.dumps({"re": k, "do": "status", "since": 1 << 60})))
        if k % 20 == 19:
            wait_for(lambda: bench.view.descriptors() < before + 20)


@test
def idle_connections_leave_descriptors_to_the_simulation(bench):
    bench.end()
    (bench.path / "scene.lua").write_text(SCENE, encoding="utf-8")
    view = View(bench.rapid, "scene.lua", "-f", "1-6", cwd=bench.path, prefix=("prlimit", "--nofile=64:64"))
    client = Client(view)
    client.until_done()
    idle = [socket.create_connection(("127.0.0.1", view.port), timeout=PATIENCE) for _ in range(200)]
    try:
        for raw in idle[:100]:
            raw.sendall(b"GET / HTTP/1.1\r\n")  # and no end of the headers
    except ConnectionError:
        pass
    run = client.ask("set", values={"height": 3})["run"]
    client.until_done(run)
    assert view.descriptors() <= 40
    assert request(view, "/page.js")[0] == 200
    with open_socket(view):  # another page
        pass
    # The last ones are also closed after their time limit.
    assert all(is_closed(raw) for raw in idle)
    for raw in idle:
        raw.close()
    # Pages with a token are limited too.
    sockets = [open_socket(view) for _ in range(7)]
    wait_for(lambda: request(view, "/socket", upgrade(view))[0] == 503)
    assert view.descriptors() <= 40
    client.until_done(client.ask("set", values={"height": 4})["run"])
    for raw in sockets:
        raw.close()
    wait_for(lambda: request(view, "/socket", upgrade(view))[0] == 101)
    client.close()
    assert view.close() == 130


@test
def a_page_that_asks_for_more_than_is_answered_waits(bench):
    browser = bench.ready()
    before = bench.view.memory()
    long = frame_of(json.dumps({"re": 1, "do": "nothing", "x": [1] * 340000}))  # takes longer to read than to send
    with open_socket(bench.view) as raw:
        end = time.monotonic() + 5
        while time.monotonic() < end:
            raw.sendall(long)
            assert bench.view.memory() - before < 64 << 20
    assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3


@test
def requests_nested_without_end_end_nothing(bench):
    browser = bench.ready()
    deep = "[" * 400000 + "]" * 400000
    for request_of in ('{"re": 1, "do": "sheet", "frame": 5, "x": %s}', '{"re": 1, "do": "set", "values": {"count": %s}}',
                       '{"re": 1, "do": "region", "frame": 5, "matrix": %s, "rectangle": []}', "%s"):
        with open_socket(bench.view) as raw:
            raw.sendall(frame_of(request_of % deep))
            raw.sendall(frame_of("{}", opcode=9))
            assert raw.recv(1)
    assert browser.promise("rapidView.ask('point', {frame: 5, id: 3}).then((p) => p.values.id)") == 3


@test
def the_browser_that_it_starts_gets_an_address_for_once_and_no_sockets(bench):
    browser = bench.ready()
    reported = bench.path / "told"
    for folder, path in ((bench.path / "programs", str(bench.path / "programs")), (bench.path, ":.")):
        folder.mkdir(exist_ok=True)
        (folder / "xdg-open").write_text(
            f"#!/bin/sh\nls -l /proc/$$/fd >{reported}.new\necho \"$1\" >>{reported}.new\nmv {reported}.new {reported}\n",
            encoding="ascii")
        (folder / "xdg-open").chmod(0o755)
        reported.unlink(missing_ok=True)
        environment = {**os.environ, "DISPLAY": ":0", "PATH": path + ":/usr/bin:/bin"}
        if folder == bench.path:  # the scene's folder
            environment["PATH"] = ":."
        view = subprocess.Popen([bench.rapid, "view", "scene.lua", "-f", "1"], cwd=bench.path, env=environment, text=True,
                                stdout=subprocess.PIPE)
        try:
            port, token = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=(\w+)\n", view.stdout.readline()).groups()
            if folder == bench.path:
                wait_for(lambda: answers(int(port)))
                assert not reported.exists(), "the program of the current folder was run"
                continue
            wait_for(reported.exists)
            *files, address = reported.read_text(encoding="utf-8").splitlines()
            assert "socket:" not in "".join(files), files
            another = re.fullmatch(rf"http://127\.0\.0\.1:{port}/\?token=(\w+)", address)[1]
            assert another != token
            browser.open(address)
            browser.wait("window.rapidView?.state.status?.state === 'done'")
            # The token of the address is used; the page has got the permanent one, and is reloaded.
            assert socket_status(int(port), another) == 403
            browser.open(f"http://127.0.0.1:{port}/")
            browser.wait("window.rapidView?.state.status?.state === 'done'")
            assert browser.run("return rapidView.connection.token") == token
        finally:
            view.send_signal(signal.SIGTERM)
            view.wait()


def answers(port):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", "/")
    return connection.getresponse().status == 200


def socket_status(port, token):
    view = types.SimpleNamespace(port=port, token=token)
    return request(view, "/socket", upgrade(view))[0]
