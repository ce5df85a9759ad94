"""Every request is answered, or its connection is closed; nothing that a page or another program sends ends the
view."""
import json
import os
import random
import socket

import amount
import random_requests
from bench import test
from browser import PATIENCE, View, wait_for
from client import Client, frame_of

MIB = 1 << 20

# Makes glibc use one heap, so that freed memory is visible as such.
ONE_HEAP = {"MALLOC_ARENA_MAX": "1"}


def random_view(bench, *arguments):
    (bench.path / "random.lua").write_text(random_requests.SCENE, encoding="utf-8")
    return View(bench.rapid, "random.lua", "-f", random_requests.FRAMES, *arguments, cwd=bench.path,
                environment=ONE_HEAP)


def answer_to(client, number):
    """Returns the answer to a request, or to a request without a usable number; skips others."""
    while True:
        opcode, data = client.receive()
        if opcode == 0x82:
            if int.from_bytes(data[:4], "little") == number:
                return data
            continue
        if opcode != 0x81:
            continue
        answer = json.loads(data)
        if answer["re"] in (number, None):
            return answer


def number_of(request):
    """Returns the number in the answer, or None if the request has none that fits 32 bits."""
    number = request.get("re")
    is_number = isinstance(number, (int, float)) and not isinstance(number, bool) and number == number // 1
    return int(number) if is_number and 0 <= number < 2**32 else None


def ends_or_answers(view, data):
    """Sends bytes on a separate connection and leaves it."""
    with socket.create_connection(("127.0.0.1", view.port), timeout=PATIENCE) as raw:
        try:
            raw.sendall(data)
            raw.shutdown(socket.SHUT_WR)
            while raw.recv(1 << 16):
                pass
        except TimeoutError:
            raise
        except OSError:
            pass  # the view has closed it


def send_random(view, client, source, number):
    """Sends one random request, and waits until it is done. Returns the client, or a new one if its connection was
    closed."""
    kind = source.randrange(8)
    if kind < 5:
        maker = [random_requests.valid, random_requests.mutated][kind > 1]
        request = maker(source, number)
        client.raw.sendall(frame_of(random_requests.text_of(request)))
        # A page that requests changes after a version waits for one.
        if not (request.get("do") == "status" and request.get("since")):
            answer_to(client, number_of(request))
        return client
    if kind == 5:
        client.raw.sendall(frame_of(random_requests.malformed(source, number)))
        return client
    if kind == 6:
        ends_or_answers(view, random_requests.http_request(source, view.port, view.token))
        return client
    with client.raw:
        client.raw.sendall(random_requests.frame_of_bytes(source))
    client.file.close()
    return Client(view)


@test
def random_requests_are_answered_and_end_nothing(bench):
    seed = int(os.environ.get("VIEW_REQUESTS_SEED", "1"))
    count = amount.of("VIEW_REQUESTS", 40)
    view = random_view(bench)
    client = Client(view)
    client.until_done()
    source, before, descriptors = random.Random(seed), 0, view.descriptors()
    for k in range(count):
        if k == count // 2:  # by then libraries are loaded, and caches full
            before = view.memory()
        try:
            client = send_random(view, client, source, k + 2)
        except Exception as error:
            raise AssertionError(f"request {k} of VIEW_REQUESTS_SEED={seed}: {error!r}") from error
        assert view.process.poll() is None, f"request {k} of VIEW_REQUESTS_SEED={seed} ended the view"
    client.close()
    client = Client(view)  # nothing was requested from it
    client.until_done(client.ask("set", values={})["run"])
    grown = view.memory() - before
    assert grown < 8 * MIB, f"{count // 2} requests keep {grown / MIB:.1f} MiB"
    wait_for(lambda: view.descriptors() < descriptors + 10)
    client.close()
    assert view.close() == 130


@test
def numbers_out_of_range_are_answered_with_an_error(bench):
    for arguments in ((), ("--untrusted",)):
        view = random_view(bench, *arguments)
        client = Client(view)
        client.until_done()
        for re in (2**32, 2**64, -1, 1.5, "1", None, [1], True):
            client.raw.sendall(frame_of(json.dumps({"re": re, "do": "status"})))
            assert isinstance(answer_to(client, -1)["error"], str), re
        frame = {"frame": 2}
        for request in ({"do": "trails", "frame": -2**63}, {"do": "trails", "frame": 2**63},
                        {"do": "arguments", "frame": 10**12}, {"do": "frame", "frame": 10**12, "after": "lift"},
                        {"do": "trace", "frame": 1, "last": 2**62, "id": 0},
                        {"do": "film", "extension": ".gif", "first": -2**63, "last": 2**63 - 1},
                        {"do": "picture", **frame, "width": 10**9}, {"do": "picture", **frame, "height": -1},
                        {"do": "picture", **frame, "camera": [0, 0, 0]},
                        {"do": "picture", **frame, "camera": [0, 0, 0, 0, 0, 0, 35]},
                        {"do": "picture", **frame, "camera": [0, 0, 5, 0, 0, 0, 1e300]},
                        {"do": "point", **frame, "row": -1}, {"do": "sheet", **frame, "count": 1e300},
                        {"do": "shapes", **frame, "known": [-1]}, {"do": "figures", "after": 2**63}):
            assert isinstance(client.ask(request.pop("do"), **request)["error"], str), request
        client.close()
        assert view.close() == 130


@test
def pictures_that_memory_has_no_room_for_are_refused(bench):
    view = random_view(bench, "--memory", "400M")
    client = Client(view)
    client.until_done()
    refused = client.ask("picture", frame=2, width=16384, height=16384)
    assert "pictures of 16384x16384 would need about" in refused["error"], refused
    assert client.ask("picture", frame=2, width=64, height=64)[8:12] == b"\x89PNG"
    client.close()
    assert view.close() == 130


@test
def settings_that_abandon_runs_keep_no_memory(bench):
    view = random_view(bench)
    client = Client(view)
    client.until_done()
    count, warm, before = amount.of("VIEW_SETTINGS", 30), 400, 0
    for k in range(count + warm):
        if k == warm:
            before = view.memory()
        client.ask("set", values={"height": str(2 + k % 50)})
    client.until_done(count + warm)
    grown = view.memory() - before
    assert grown < MIB, f"{count} settings keep {grown / MIB:.2f} MiB"
    client.close()
    assert view.close() == 130
