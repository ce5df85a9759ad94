"""How many random cases a test tries; tests/amount.lua has the same for tests in Lua."""
import os


def of(name, quick):
    """The value of the environment variable `name`, or `quick` times RAPID_TEST_SCALE."""
    given = os.environ.get(name)
    return int(given) if given else quick * int(os.environ.get("RAPID_TEST_SCALE", "1"))
