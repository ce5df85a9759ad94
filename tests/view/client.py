"""A page without a browser: a client of the viewer's WebSocket."""
import json
import socket
import time

from browser import PATIENCE


def upgrade(view, token=None):
    """Returns the headers of a request that opens the socket."""
    return {"Origin": f"http://127.0.0.1:{view.port}", "Connection": "Upgrade", "Upgrade": "websocket",
            "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
            "Sec-WebSocket-Protocol": f"rapid, rapid.token.{token or view.token}"}


def open_socket(view):
    """Opens the socket, and reads the answer to the upgrade."""
    raw = socket.create_connection(("127.0.0.1", view.port), timeout=PATIENCE)
    headers = {"Host": f"127.0.0.1:{view.port}", **upgrade(view)}
    raw.sendall(("GET /socket HTTP/1.1\r\n" + "".join(f"{name}: {value}\r\n" for name, value in headers.items()) +
                 "\r\n").encode())
    head = b""
    while b"\r\n\r\n" not in head:
        byte = raw.recv(1)
        assert byte, f"closed after {head}"
        head += byte
    assert b" 101 " in head.split(b"\r\n")[0], head
    return raw


def frame_of(text, opcode=1):
    data, mask = text.encode() if isinstance(text, str) else text, b"\0\0\0\0"
    size = len(data)
    length = bytes([0x80 | size]) if size < 126 else bytes([0xfe]) + size.to_bytes(2, "big") if size < 65536 else (
        bytes([0xff]) + size.to_bytes(8, "big"))
    return bytes([0x80 | opcode]) + length + mask + data


class Client:
    """A client that sends one request at a time."""

    def __init__(self, view):
        self.raw = open_socket(view)
        self.file = self.raw.makefile("rb")

    def ask(self, what, **given):
        """Sends a request and returns the answer: an object, or the bytes of a frame."""
        self.raw.sendall(frame_of(json.dumps({"re": 1, "do": what, **given})))
        opcode, data = self.receive()
        return json.loads(data) if opcode == 0x81 else data

    def receive(self):
        """Returns the next frame: its first byte, and its data."""
        head = self.file.read(2)
        assert len(head) == 2, "the connection is closed"
        opcode, size = head
        if size >= 126:
            size = int.from_bytes(self.file.read(2 if size == 126 else 8), "big")
        return opcode, self.file.read(size)

    def until_done(self, run=1, pulls=False):
        """Waits until a run is done and returns its status. pulls: also requests its newest frames, shapes and figures,
        as the page does."""
        version, end = 0, time.monotonic() + PATIENCE
        while True:
            status = self.ask("status", since=version, graph=1)
            version = status["version"]
            if pulls and status["ready"]:
                newest = status["ready"][-1][1]
                self.ask("frame", frame=newest)
                self.ask("shapes", frame=newest, known=[1, 2, 3, 4])
                self.ask("figures", after=newest - 1)
            if status["run"] >= run and status["state"] == "done":
                return status
            assert status["state"] in ("starting", "computing"), status["state"]
            assert time.monotonic() < end, f"waited {PATIENCE} s in vain; the last status was {status}"
            time.sleep(0.03 if pulls else 0.3)

    def close(self):
        self.file.close()
        self.raw.close()
