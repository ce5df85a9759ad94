"""Random requests to a viewer: valid ones, mutations of these, and bytes that no client sends."""
import json

# A scene whose parameters accept any value: each run is short, or an error.
SCENE = """local rapid = require "rapid"
local height = rapid.param("height", 2, "of the row, in metres")
local heavy = rapid.param("heavy", false, "whether gravity acts")
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 2, 0}, {2, 1, 1}} } }
  :attribute { pscale = 0.1, heat = 1, Cd = {1, 0.5, 0.2} }
  :group { name = "low", where = function(p) return p.P.y < 1.5 end }
  :points("lift", function(p) p.P = p.P + vec3(0, height * 0.01, 0) end)
  :gravity { g = heavy and vec3(0, -9.8, 0) or vec3(0, 0, 0) }
  :collide { shape = rapid.shape.sphere { radius = 0.3 } } :solve {}
"""
FRAMES = "1-6"

HOSTILE = [0, -1, 1, 0.5, -0.0, 1e308, -1e308, 1e-320, 2**31, -2**31, 2**32, 2**53 + 1, 2**63 - 1, -2**63, 2**64 - 1,
           2**64, 10**30, True, None, "", "x", "main", "\u0000", "\ud800", "é" * 100, "x" * 20000, [], {}, [[]],
           [1, 2, 3], ["a"], [1e308] * 16, [0] * 1000, {"a": {"b": [1, {"c": 2}]}}]
NAMES = ["P", "v", "heat", "speed", "error", "group:low", "Cd", "id", "nothing", "group:none", ""]


def points_of(random):
    """Returns the fields that select points."""
    fields = {"frame": random.randint(0, 7)}
    if random.random() < 0.3:
        fields["group"] = random.choice(["", "low", "none"])
    if random.random() < 0.3:
        fields["output"] = random.choice(["main", "else"])
    if random.random() < 0.2:
        fields["after"] = random.choice(["lift", "gravity1", "nobody"])
    if random.random() < 0.3:
        fields["most"] = random.choice([0, 1, 2, 1000])
    return fields


def numbers(random, count):
    return [random.choice([0, 1, -1, 0.5, random.uniform(-10, 10)]) for _ in range(count)]


def camera(random):
    return [*numbers(random, 6), random.choice([10, 35, 120])]


MAKERS = {
    "status": lambda r: {"since": 0, "graph": r.choice([0, 1, 99])},
    "frame": lambda r: {**points_of(r), "colour": r.choice(NAMES), "velocities": r.random() < 0.5},
    "shapes": lambda r: {"frame": r.randint(0, 7), "known": [r.randint(0, 9) for _ in range(r.randint(0, 4))]},
    "point": lambda r: {**points_of(r), r.choice(["id", "row"]): r.randint(0, 5)},
    "path": lambda r: {"id": r.randint(-1, 4)},
    "trails": lambda r: {**points_of(r), "frames": r.choice([-5, 0, 1, 6, 1000])},
    "trace": lambda r: {"frame": r.randint(1, 6), "last": r.randint(1, 6), "id": r.randint(-1, 4)},
    "sheet": lambda r: {**points_of(r), "sort": r.choice(NAMES), "descending": r.random() < 0.5,
                        "from": r.choice([0, 1, 1000]), "count": r.choice([0, 1, 500, 10**6])},
    "region": lambda r: {**points_of(r), "matrix": numbers(r, 16), "rectangle": numbers(r, 4)},
    "figures": lambda r: {"after": r.randint(-1, 7)},
    "arguments": lambda r: {"frame": r.randint(0, 7)},
    "picture": lambda r: {**points_of(r), "camera": camera(r), "width": r.randint(16, 64), "height": r.randint(16, 64)},
    "film": lambda r: {"extension": r.choice([".gif", ".png"]), "first": r.randint(1, 6), "last": r.randint(1, 6),
                       "width": 16, "height": 16, "fps": r.choice([1, 24, 0, -1])},
    "film_progress": lambda r: {},
    "film_data": lambda r: {},
    "film_cancel": lambda r: {},
    "set": lambda r: {"values": r.choice([{}, {"height": 3}, {"height": "x"}, {"heavy": True}, {"height": [1, 2, 3]},
                                          {"nobody": 1}])},
}


def valid(random, number):
    what = random.choice(list(MAKERS))
    return {"re": number, "do": what, **MAKERS[what](random)}


def mutated(random, number):
    """Returns a valid request in which one to three fields are hostile, missing or unknown."""
    request = valid(random, number)
    for _ in range(random.randint(1, 3)):
        name = random.choice([*request, "unknown"])
        if name != "re" and random.random() < 0.2:
            request.pop(name, None)
        elif isinstance(request.get(name), (list, dict)) and request[name] and random.random() < 0.5:
            inner = request[name]
            inner[random.choice(list(inner) if isinstance(inner, dict) else range(len(inner)))] = random.choice(HOSTILE)
        elif name != "do" or random.random() < 0.3:
            request[name] = random.choice(HOSTILE)
    return request


def text_of(request):
    return json.dumps(request).encode()  # lone surrogates as escapes, which are valid JSON


def malformed(random, number):
    """Returns a text that is not a request: truncated, damaged, nested without end, or not an object."""
    text = text_of(valid(random, number))
    kind = random.randrange(5)
    if kind == 0:
        return text[:random.randrange(len(text))]
    if kind == 1:
        at = random.randrange(len(text))
        return text[:at] + bytes([random.randrange(1, 127)]) + text[at + 1:]
    if kind == 2:
        depth = random.choice([10, 1000, 100000])
        return b'{"re": %d, "do": "region", "frame": 1, "matrix": %s}' % (number, b"[" * depth + b"]" * depth)
    if kind == 3:
        return text_of(random.choice(HOSTILE))
    return text[:-1] + b', "re": ' + text_of(random.choice(HOSTILE)) + b"}"


def frame_of_bytes(random):
    """Returns a WebSocket frame that breaks the protocol, or does not contain text."""
    kind = random.randrange(6)
    if kind == 0:
        return bytes(random.randrange(256) for _ in range(random.randint(1, 200)))
    first = random.choice([0x01, 0x80, 0x82, 0x83, 0x8b, 0x88, 0x89, 0x8a, 0xc1, 0x91])
    if kind == 1:  # a length without data
        return bytes([first, 0xff]) + random.choice([1 << 63, 1 << 40, (1 << 64) - 1, 200]).to_bytes(8, "big")
    if kind == 2:  # without a mask
        return bytes([first, 5]) + b"hello"
    size = random.randint(0, 125)
    return bytes([first, 0x80 | size]) + b"\0\0\0\0" + bytes(random.randrange(256) for _ in range(size))


def http_request(random, port, token):
    """Returns bytes for the server's port that do not open a socket with a token."""
    host = random.choice([f"127.0.0.1:{port}"] * 4 + ["localhost", "evil.example", "[::1]", "", ":", "x" * 3000])
    method = random.choice(["GET"] * 5 + ["POST", "HEAD", "OPTIONS", "", "G\u00e9T", "PRI"])
    target = random.choice(["/", "/page.js", "/three.module.js", "/socket", "/../../etc/passwd", "/%2e%2e/x", "//", "",
                            "*", "/" + "x" * random.choice([100, 40000]), "/?token=" + token, "http://evil.example/"])
    headers = [f"Host: {host}"]
    for header in ["Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Content-Length: 5", "Content-Length: 99999999999999",
                   "Content-Length: -1", "Transfer-Encoding: chunked", f"Origin: http://127.0.0.1:{port}",
                   "Origin: null", "Sec-WebSocket-Protocol: rapid, rapid.token.0", "Sec-WebSocket-Protocol: ,;=\"",
                   f"Cookie: rapid_{port}={token}", "Expect: 100-continue", "X: " + "y" * 9000, "no header", " : "]:
        if random.random() < 0.25:
            headers.append(header)
    text = f"{method} {target} HTTP/{random.choice(['1.1', '1.1', '1.0', '2', '9.9'])}\r\n" + "\r\n".join(headers)
    data = text.encode() + random.choice([b"\r\n\r\n", b"\r\n\r\n", b"\r\n\r\nhello", b"\n\n", b""])
    if random.random() < 0.2:
        at = random.randrange(len(data))
        data = data[:at] + bytes([random.randrange(256)]) + data[at + 1:]
    return data
