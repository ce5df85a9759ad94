#include "runtime/base/printable.h"

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

TEST_CASE("an endless text is shortened in its middle, between characters", "[printable]")
{
    CHECK(shortened("short", 5) == "short");
    CHECK(shortened(std::string(50, 'a') + std::string(50, 'b'), 40) ==
          std::string(30, 'a').append(" [... 60 bytes ...] ").append(10, 'b'));
    // 12 bytes; each character in the middle takes two.
    CHECK(shortened("a\xc3\xa9\xc3\xa9\xc3\xa9\xc3\xa9\xc3\xa9"
                    "b",
                    8) == "a\xc3\xa9\xc3\xa9 [... 6 bytes ...] b");
    CHECK(width_of("name") == 4);
    CHECK(width_of(std::string(1000, 'n')) == 40);
}

TEST_CASE("a name from a file is one line of bounded length", "[printable]")
{
    CHECK(printable_name("caf\xc3\xa9") == "caf\xc3\xa9");
    CHECK(printable_name("a\n\tb\x1b[2J") == "a\\x0a\\x09b\\x1b[2J");
    CHECK(printable_name(std::string(60000, 'n')) ==
          std::string(150, 'n').append(" [... 59800 bytes ...] ").append(50, 'n'));
    CHECK(printable_name(std::string(60000, '\x1b')).size() < 1000);
}
