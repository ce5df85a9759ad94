// Tests of scenes in Lua, in busted's language (docs/lua-api.md), as `rapid test` runs them: for a harness of a
// program's own. They need busted, which is found when a file is run.
#pragma once

#include <functional>
#include <string>

#include "include/rapid/scene.h"

namespace rapid {

// What is told of a test, or of the file.
struct SceneTestEvent {
    // What has happened.
    enum Kind {
        Started = 0,
        Passed = 1,
        Failed = 2,
        Skipped = 3,
        Broken = 4,  // the file can't be read or run, so its tests are not known
    };
    Kind kind = Started;  // of the event
    std::string name;     // of the test, with its describe blocks
    std::string message;  // of Failed and Broken: FILE:LINE: the fault, maybe with more lines
};

// How the tests of a file are run.
struct SceneTestOptions {
    std::string filter;   // a Lua pattern that a test's name must match; empty: all
    int already_run = 0;  // tests at the beginning of the file that are left out: of a process that has ended in one
    int threads = 0;      // of scenes that do not set it; 0: all that the machine has
    // As SceneHooks::late, of scenes; the test fails where it returns.
    std::function<void(const std::string& message)> late;
};

// Runs the tests of a file in this process and tells of each, in order, on the thread of the call. Scenes that they run
// are confined as others are; the file's own Lua may do all that a program may, the end of the process included, and
// nothing limits its time. From one thread of the process at a time: `threads` is set for the whole process meanwhile
// (tbb::global_control).
//
// Error: WrongCall: options that can't be, busted is not there; what `tell` threw,
// behind the last test.
Result<Done> run_scene_tests(const std::string& file, const SceneTestOptions& options,
                             const std::function<void(const SceneTestEvent& event)>& tell);

}  // namespace rapid
