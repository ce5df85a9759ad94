"""The number of random cases of a test; tests/amount.lua is the same for Lua."""
import os


def of(name, quick):
    """Returns the environment variable `name`, or `quick` times RAPID_TEST_SCALE."""
    given = os.environ.get(name)
    return int(given) if given else quick * int(os.environ.get("RAPID_TEST_SCALE", "1"))
