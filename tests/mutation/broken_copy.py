"""A copy of the checkout and of its build, in which sources are broken, and the tests that run there."""
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path.cwd()
WORK = ROOT / "build/mutation"
TREE = WORK / "tree"
TEMPORARY = WORK / "tmp"
BUILD = pathlib.Path("build/test")
NOTES = pathlib.Path("build/reached")
NAMESPACE = ["unshare", *([] if os.geteuid() == 0 else ["--map-root-user"]), "--mount", "--pid", "--fork",
             "--kill-child", "--mount-proc"]
MOST_MEMORY = 8 << 30  # bytes of a process: a broken loop may append without end


def limit_memory():
    """Sets only the soft limit, because tests may set their own."""
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, resource.getrlimit(resource.RLIMIT_DATA)[1]))


def inside(command, seconds=None, **variables):
    """Runs a command in the copy, which is mounted over the checkout: paths in objects and precompiled headers fit, and
    no broken program finds the checkout. Returns the status, or None after a timeout, and the output."""
    mounts = 'mount --bind "$3" /tmp && mount --bind "$1" "$2" && cd "$2" && shift 3 && exec "$@"'
    log = WORK / "log"
    with open(log, "wb") as output:
        process = subprocess.Popen(
            [*NAMESPACE, "sh", "-c", mounts, "_", str(TREE), str(ROOT), str(TEMPORARY), *command],
            stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, env={**os.environ, **variables},
            start_new_session=True,
            preexec_fn=limit_memory)
        try:
            status = process.wait(seconds)
        except subprocess.TimeoutExpired:
            status = None
        finally:
            if process.poll() is None:  # all processes of the namespace end with it
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    return status, log.read_text(encoding="utf-8", errors="replace")


def make():
    """Copies the files that git tracks or would add, and build/test, with their times, so the build is up to date."""
    subprocess.run(["ninja", "-C", str(BUILD), "rapid_tests"], check=True, stdout=subprocess.DEVNULL)
    shutil.rmtree(WORK, ignore_errors=True)
    TEMPORARY.mkdir(parents=True)
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], check=True,
                            capture_output=True).stdout.decode().split("\0")
    for name in listed:
        if os.path.lexists(name):
            (TREE / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(name, TREE / name, follow_symlinks=False)
    (TREE / BUILD).parent.mkdir()
    subprocess.run(["cp", "--archive", "--reflink=auto", str(BUILD), str(TREE / BUILD)], check=True)
    shutil.copy(ROOT / "tests/mutation/mutant.h", TREE / BUILD / "include")


def batches():
    """Returns the sources of each batch, which are compiled as one."""
    for unity in sorted(BUILD.rglob("Unity/*.cxx")):
        if any(part.startswith("rapid_abi") for part in unity.parts):
            continue
        included = re.findall(r'#include "(.*\.cpp)"', unity.read_text(encoding="utf-8"))
        yield [pathlib.Path(path).relative_to(ROOT) for path in included if path.startswith(f"{ROOT}/")]


def write(path, changed, top=""):
    """Writes a source with some lines replaced, by their numbers from 0."""
    lines = (ROOT / path).read_text(encoding="utf-8").splitlines(keepends=True)
    for i, line in changed.items():
        lines[i] = line + "\n"
    (TREE / path).write_text(top + "".join(lines), encoding="utf-8")


def build():
    """Builds the tests. Returns the positions of compiler errors as (file, line); empty if everything was built."""
    status, said = inside(["ninja", "-C", str(BUILD), "-k", "0", "rapid_tests"])
    if status == 0:
        return set()
    places = {(pathlib.Path(path), int(line) - 1)
              for path, line in re.findall(rf"{re.escape(str(ROOT))}/([\w/]+\.cpp):(\d+):", said)}
    if not places:
        sys.exit(said)
    return places


class Suite:
    """The tests run by one command. It stops at the first failure if it can."""

    def __init__(self, name, command):
        self.name, self.command = name, command
        self.seconds, self.reached = 0, set()

    def passes(self, seconds=None, **variables):
        shutil.rmtree(TEMPORARY)
        TEMPORARY.mkdir()
        TEMPORARY.chmod(0o1777)
        started = time.monotonic()
        status, said = inside(self.command, seconds, **variables)
        self.took = time.monotonic() - started
        self.said = said if status is not None else f"no end after {self.took:.0f} s"
        return status == 0

    def measure(self, count):
        """Runs the unbroken tests, and records which of the `count` lines they execute. Returns False if they fail."""
        notes = TREE / NOTES
        notes.write_bytes(bytes(count))
        passed = self.passes(RAPID_MUTANT_REACHED=str(ROOT / NOTES))
        self.seconds, self.reached = self.took, {i for i, byte in enumerate(notes.read_bytes()) if byte}
        return passed

    def max_seconds(self):
        return 30 + 5 * self.seconds


def catch(folder, chosen="~[long]~[.]"):
    return Suite(f"test_{folder}", [f"{BUILD}/bin/test_{folder}", "--filenames-as-tags", "--abort", chosen])


def suites():
    """Returns the suites of tests/run, except those that read the sources or have their own builds."""
    found = [catch(path.name.removeprefix("test_")) for path in sorted((BUILD / "bin").glob("test_*"))]
    for path in sorted(pathlib.Path("tests").rglob("test_*.lua")):
        if path.parts[1] != "farm":
            found.append(Suite(str(path), [f"{BUILD}/bin/rapid", "test", str(path)]))
    found.append(Suite("tests/python/run", ["tests/python/run", str(BUILD)]))
    found.append(Suite("tests/c/example", ["tests/c/example", str(BUILD)]))
    found.append(Suite("tests/view/run", ["tests/view/run", f"{BUILD}/bin/rapid", "--quick"]))
    return found


def own_first(known, source):
    """Sorts suites: first the test file of a source, then the suites that belong to it (tests/selected), then the
    others by time, fastest first."""
    selected = subprocess.run(["tests/selected", str(source)], check=False, capture_output=True, text=True).stdout
    filters, own = [], set()
    for kind, what, *rest in (line.split() for line in selected.splitlines()):
        if kind == "catch":
            filters.append((f"test_{what}", catch(what, *rest)))
            own.add(f"test_{what}")
        elif kind != "target":
            own.add(what)
    by_name = {suite.name: suite for suite in known}
    first = []
    for name, suite in filters:
        if name in by_name and suite.command != by_name[name].command:
            suite.seconds = by_name[name].seconds
            first.append(suite)

    def is_others(suite):
        return not any(suite.name == name or suite.name.startswith(f"{name}/") for name in own)

    return first + sorted(known, key=lambda suite: (is_others(suite), suite.seconds))
