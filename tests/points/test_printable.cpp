#include "runtime/printable.h"

#include "tests/test.h"

using namespace rapid;

TEST_CASE("what a terminal would take for a command is shown as a number, and all other text as it is", "[printable]")
{
    CHECK(printable("caf\xc3\xa9,\ttwo\nlines \"\\x\"") == "caf\xc3\xa9,\ttwo\nlines \"\\x\"");
    CHECK(printable("\x1b]0;title\x07") == "\\x1b]0;title\\x07");
    CHECK(printable("a\rb\x7f") == "a\\x0db\\x7f");
    CHECK(printable("\xc2\x9b"
                    "2J\xc2\xa0\xc2") == "\\x9b2J\xc2\xa0\xc2");
}
