"""A headless browser (Debian's chromium) controlled by WebDriver, and a `rapid view` that it shows."""
import base64
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


# Seconds after which every wait fails: far longer than even a busy machine needs.
PATIENCE = 240


def wait_for(what, seconds=PATIENCE, every=0.02):
    """Returns the first true value of what(). Fails after this many seconds."""
    end = time.monotonic() + seconds
    while True:
        value = what()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"waited {seconds} s in vain; the last value was {value!r}")
        time.sleep(every)


class Browser:
    """A chromium process whose pages have WebGL in software."""

    def __init__(self, width=1280, height=800):
        # The browser outlives its driver, so a signal must also end the tests through close().
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
        self.port = free_port()
        words = ["setpriv", "--pdeathsig", "TERM", "chromedriver", f"--port={self.port}"]
        self.driver = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                       start_new_session=True)
        wait_for(self.is_up)
        options = {"args": ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                            "--disable-dev-shm-usage", "--disable-background-timer-throttling",
                            "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding",
                            f"--window-size={width},{height}"]}
        made = self.call("POST", "/session", {"capabilities": {"alwaysMatch": {"goog:chromeOptions": options}}}, "")
        self.session = f"/session/{made['sessionId']}"
        self.call("POST", "/timeouts", {"script": 1000 * PATIENCE})

    def is_up(self):
        try:
            return self.call("GET", "/status", None, "")["ready"]
        except OSError:
            return False

    def call(self, method, path, body=None, session=None):
        prefix = self.session if session is None else session
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{prefix}{path}", data, method=method,
                                         headers={"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=2 * PATIENCE) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(json.load(error)["value"]["message"]) from None

    def open(self, address):
        self.call("POST", "/url", {"url": address})

    def size(self, width, height):
        """Sets the size of the page itself, without the browser's frame."""
        def is_so():
            inner = self.run("return [innerWidth, innerHeight]")
            if inner == [width, height]:
                return True
            rect = self.call("GET", "/window/rect")
            self.call("POST", "/window/rect", {"width": rect["width"] + width - inner[0],
                                               "height": rect["height"] + height - inner[1]})
            return False

        wait_for(is_so, every=0.2)

    def run(self, script, *arguments):
        return self.call("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, expression, seconds=PATIENCE):
        """Waits until an expression of the page is true, and returns it."""
        return wait_for(lambda: self.run(f"return {expression}"), seconds)

    def promise(self, expression):
        """Returns the value of a promise. Fails if the promise is rejected."""
        kept = self.call("POST", "/execute/async", {
            "script": f"const done = arguments[arguments.length - 1]; Promise.resolve({expression})"
                      ".then((value) => done([value]), (error) => done(String(error)));", "args": []})
        assert isinstance(kept, list), kept
        return kept[0]

    def draw_nothing(self):
        """Lets WebGL fill its buffers but draw nothing, from the next page on."""
        self.before_pages("WebGLRenderingContext.prototype.drawArrays = WebGL2RenderingContext.prototype.drawArrays = "
                          "WebGLRenderingContext.prototype.drawElements = "
                          "WebGL2RenderingContext.prototype.drawElements = () => {}")

    def element(self, selector):
        return next(iter(self.call("POST", "/element", {"using": "css selector", "value": selector}).values()))

    def click(self, selector):
        self.call("POST", f"/element/{self.element(selector)}/click", {})

    def type(self, text):
        """Types keys into the element that has the focus."""
        actions = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self.call("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def click_at(self, x, y):
        self.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [
            {"type": "pointerMove", "duration": 0, "x": round(x), "y": round(y)},
            {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]}]})

    def drag(self, x0, y0, x1, y1, shift=False, button=0):
        """button: 0 is the left, 1 the middle, 2 the right one."""
        keys = [{"type": "keyDown", "value": "\ue008"}, {"type": "pause"}, {"type": "pause"}, {"type": "pause"},
                {"type": "keyUp", "value": "\ue008"}]
        actions = [{"type": "pointer", "id": "mouse", "actions": [
            {"type": "pointerMove", "duration": 0, "x": round(x0), "y": round(y0)},
            {"type": "pointerDown", "button": button},
            {"type": "pointerMove", "duration": 50, "x": round(x1), "y": round(y1)},
            {"type": "pointerUp", "button": button}]}]
        if shift:
            actions[0]["actions"].insert(0, {"type": "pause"})
            actions.append({"type": "key", "id": "keys", "actions": keys})
        self.call("POST", "/actions", {"actions": actions})

    def wheel(self, x, y, by):
        self.call("POST", "/actions", {"actions": [{"type": "wheel", "id": "wheel", "actions": [
            {"type": "scroll", "x": round(x), "y": round(y), "deltaX": 0, "deltaY": by}]}]})

    def before_pages(self, source):
        """Runs a script before those of each page from now on, until the returned function is called."""
        made = self.call("POST", "/goog/cdp/execute", {"cmd": "Page.addScriptToEvaluateOnNewDocument",
                                                       "params": {"source": source}})
        return lambda: self.call("POST", "/goog/cdp/execute", {"cmd": "Page.removeScriptToEvaluateOnNewDocument",
                                                               "params": made})

    def screenshot(self, file):
        """Saves a screenshot. Tries again, because the driver gives up after ten seconds and the first one of a page
        that draws in software may take longer."""
        for attempt in range(5):
            try:
                data = self.call("GET", "/screenshot")
                break
            except AssertionError as error:
                if attempt == 4 or "timeout" not in str(error):
                    raise
        with open(file, "wb") as out:
            out.write(base64.b64decode(data))

    def close(self):
        try:
            self.call("DELETE", "")
        except (OSError, AssertionError):
            pass
        self.driver.terminate()
        self.driver.wait()
        try:
            os.killpg(self.driver.pid, signal.SIGKILL)  # a browser that does not react
        except ProcessLookupError:
            pass


class View:
    """A `rapid view`, and its address."""

    def __init__(self, rapid, *arguments, cwd=None, prefix=(), environment=None):
        """prefix: words before the command; environment: variables in addition to those of this process."""
        # A shell's background jobs ignore SIGINT, and so would a view, which it must end.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        words = ["setpriv", "--pdeathsig", "KILL", *prefix, rapid, "view", *arguments, "--no-open"]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd,
                                        env={**os.environ, **(environment or {})})
        self.address = self.process.stdout.readline().strip()
        match = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=([0-9a-f]{32})", self.address)
        if not match:
            raise AssertionError(f"no address: {self.address!r} {self.process.stderr.read()}")
        self.port, self.token = int(match[1]), match[2]

    def memory(self):
        """Returns the resident memory in bytes."""
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def close(self):
        self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


def is_installed():
    return shutil.which("chromium") and shutil.which("chromedriver")
