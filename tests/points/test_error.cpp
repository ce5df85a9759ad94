#include "runtime/base/error.h"

#include "tests/test.h"

namespace rapid {

TEST_CASE("an error says file, line and node before the fault", "[error]")
{
    Error error("bounce = 1.4 is out of range; it must be from 0 to 1");
    CHECK(std::string(error.what()) == "bounce = 1.4 is out of range; it must be from 0 to 1");

    error.in_node("collide1");
    CHECK(std::string(error.what()) == "node \"collide1\": bounce = 1.4 is out of range; it must be from 0 to 1");

    error.at({"graphs/sparks.lua", 14});
    CHECK(std::string(error.what()) ==
          "graphs/sparks.lua:14: node \"collide1\": bounce = 1.4 is out of range; it must be from 0 to 1");
}

TEST_CASE("an error is not longer for names, files and messages without end", "[error]")
{
    const std::string endless(1'000'000, 'x');
    const std::string text = Error(endless).in_node(endless).at({endless, 14}).what();
    CHECK(text.size() < 9000);
    CHECK(text.find("bytes ...] ") != std::string::npos);
    const std::string path(4000, 'x');  // a long text that may be a path
    CHECK(std::string(Error("it is empty").at({path}).what()) == path + ": it is empty");
}

TEST_CASE("an error does not end at a byte 0 of a name", "[error]")
{
    const std::string name("a\0b\0", 4);
    CHECK(std::string(Error("no " + name).in_node(name).at({name}).what()) ==
          "a\\x00b\\x00: node \"a\\x00b\\x00\": no a\\x00b\\x00");
}

TEST_CASE("a file without a known line is named without one", "[error]")
{
    CHECK(std::string(Error("it is empty").at({"bunny.obj"}).what()) == "bunny.obj: it is empty");
}

TEST_CASE("as an error rises, the line and the node nearest to the fault stay", "[error]")
{
    Error error("x");
    error.at({"lift.lua", 16}).in_node("lift1").at({"sparks.lua", 3}).in_node("outer");
    CHECK(std::string(error.what()) == "lift.lua:16: node \"lift1\": x");
}

TEST_CASE("an error in other words is the same one", "[error]")
{
    Error error("x", ErrorKind::OutOfMemory);
    error.at({"lift.lua", 16}).in_node("lift1").with_trace("lift.lua:16: in run");
    const Error reworded = error.reworded("x (frame 3)");
    CHECK(std::string(reworded.what()) == "lift.lua:16: node \"lift1\": x (frame 3)");
    CHECK(reworded.kind() == ErrorKind::OutOfMemory);
    CHECK(reworded.trace() == error.trace());
}

TEST_CASE("a script's call stack is kept apart from the message", "[error]")
{
    Error error("x");
    error.with_trace("inner").with_trace("outer");
    CHECK(error.trace() == "inner");
    CHECK(std::string(error.what()) == "x");
}

TEST_CASE("the nearest name is the one with the fewest slips of the finger", "[error]")
{
    const std::vector<std::string> names = {"age", "bounce", "drag", "gravity", "linear", "life", "P", "quadratic"};

    CHECK(nearest_name("linaer", names) == "linear");  // neighbouring letters swapped
    CHECK(nearest_name("liner", names) == "linear");   // a missing letter
    CHECK(nearest_name("bounnce", names) == "bounce");
    CHECK(nearest_name("gravitas", names) == "gravity");  // two of eight letters differ
    CHECK(nearest_name("Drag", names) == "drag");
    CHECK(nearest_name("p", names) == "P");
}

TEST_CASE("a name that is like none has no nearest name", "[error]")
{
    const std::vector<std::string> names = {"drag", "P", "v"};

    CHECK(nearest_name("turbulence", names).empty());
    CHECK(nearest_name("x", names).empty());  // every single letter is one edit away
    CHECK(nearest_name("", names).empty());
    CHECK(nearest_name("drag", {}).empty());
}

TEST_CASE("a suggestion is made only where there is one", "[error]")
{
    CHECK(did_you_mean("linaer", {"linear"}) == "; did you mean \"linear\"?");
    CHECK(did_you_mean("linaer", {"quadratic"}).empty());
}

TEST_CASE("a name is found again through one slip anywhere in it", "[error]")
{
    rc::prop("one letter replaced", [] {
        const std::string name = *rc::gen::container<std::string>(8, rc::gen::inRange('a', 'z'));
        std::string slip = name;
        slip[*rc::gen::inRange(0, 8)] = *rc::gen::inRange('a', 'z');
        RC_ASSERT(nearest_name(slip, {"0123456789", name, "ABSENT"}) == name);
    });
}

}  // namespace rapid
