// Lua tests run by a program: the callbacks for each test, and scripts that never end.
#include <algorithm>
#include <string>
#include <vector>

#include "bindings/scene/scene_tests.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using test::good;

struct Reported {
    std::vector<SceneTestEvent> events;

    std::function<void(const SceneTestEvent& event)> listener()
    {
        return [this](const SceneTestEvent& event) { events.push_back(event); };
    }
    // "started NAME", "passed NAME", ...
    std::vector<std::string> lines() const
    {
        constexpr const char* kinds[] = {"started ", "passed ", "failed ", "skipped ", "broken "};
        std::vector<std::string> lines;
        for (const SceneTestEvent& event : events) lines.push_back(kinds[event.kind] + event.name);
        return lines;
    }
};

const char* const three =
    "describe('a file', function()\n"
    "  it('holds', function() assert.is_true(true) end)\n"
    "  it('fails', function() assert.equal(1, 2) end)\n"
    "  pending('waits')\n"
    "end)\n";

}  // namespace

TEST_CASE("the start and end of each test of a file are reported", "[tests]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("test_three.lua", three);
    Reported reported;
    good(run_scene_tests(file, {}, reported.listener()));
    CHECK(reported.lines() == std::vector<std::string>{"started a file holds", "passed a file holds",
                                                       "started a file fails", "failed a file fails",
                                                       "started a file waits", "skipped a file waits"});
    CHECK_THAT(reported.events[3].message, Contains("test_three.lua:3: "));
}

TEST_CASE("tests are chosen by name, and those before one that ended its process are skipped", "[tests]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("test_three.lua", three);
    Reported named, rest;
    good(run_scene_tests(file, {"file h", 0, 0, {}}, named.listener()));
    CHECK(named.lines() == std::vector<std::string>{"started a file holds", "passed a file holds"});
    good(run_scene_tests(file, {"", 2, 0, {}}, rest.listener()));
    CHECK(rest.lines() == std::vector<std::string>{"started a file waits", "skipped a file waits"});
}

TEST_CASE("a scene that a test runs is stopped when its script takes too long, and the next test runs", "[tests]")
{
    const test::TemporaryFolder folder;
    const std::string scene = folder.write("endless.lua",
                                           "local rapid = require 'rapid'\n"
                                           "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }"
                                           ":points('turn', function(p) while true do end end) :solve {}");
    const std::string file = folder.write("test_endless.lua", "it('ends', function() rapid.run('" + scene +
                                                                  "', { frames = {1, 2}, script_timeout = 0.2 }) end)\n"
                                                                  "it('goes on', function() end)\n");
    Reported reported;
    std::string late;
    SceneTestOptions options;
    options.on_script_timeout = [&](const std::string& message) { late = message; };
    good(run_scene_tests(file, options, reported.listener()));
    CHECK(reported.lines() ==
          std::vector<std::string>{"started ends", "failed ends", "started goes on", "passed goes on"});
    CHECK_THAT(reported.events[1].message, Contains("ran for more than 0.2 s"));
    CHECK_THAT(late, Contains("ran for more than 0.2 s"));
}

TEST_CASE("a file that can't be run is broken, and wrong options are refused", "[tests]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("test_bad.lua", "it('never ends', function()\n");
    Reported reported;
    good(run_scene_tests(file, {}, reported.listener()));
    REQUIRE(reported.events.size() == 1);
    CHECK(reported.events[0].kind == SceneTestEvent::Broken);
    CHECK_THAT(reported.events[0].message, Contains("test_bad.lua"));

    CHECK(run_scene_tests(file, {"", -1, 0, {}}, {}).error().kind == SceneError::WrongCall);
    CHECK(run_scene_tests(file, {"", 0, -1, {}}, {}).error().kind == SceneError::WrongCall);
}

TEST_CASE("an exception of the program's callback is an error after the last test", "[tests]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("test_three.lua", three);
    int reported = 0;
    const Result<Done> done = run_scene_tests(file, {}, [&](const SceneTestEvent&) {
        ++reported;
        throw std::runtime_error("not now");
    });
    REQUIRE_FALSE(done);
    CHECK(reported == 1);
    CHECK_THAT(done.error().message, Contains("the program's listener threw: not now"));
}

}  // namespace rapid
