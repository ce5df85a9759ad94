// Runs tests of scenes in Lua, in busted's language (docs/lua-api.md), like `rapid test`: for a program's own test
// harness. They need busted, which is searched when a file is run.
#pragma once

#include <functional>
#include <string>

#include "include/rapid/scene.h"

namespace rapid {

// An event of a test, or of the file.
struct SceneTestEvent {
    // Kinds of events.
    enum Kind {
        Started = 0,
        Passed = 1,
        Failed = 2,
        Skipped = 3,
        Broken = 4,  // the file cannot be read or run, so its tests are unknown
    };
    Kind kind = Started;  // of the event
    std::string name;     // of the test, with its describe blocks
    std::string message;  // for Failed and Broken: FILE:LINE: the fault, maybe with more lines
};

// Options for the tests of a file.
struct SceneTestOptions {
    std::string filter;   // a Lua pattern that a test's name must match; empty: all
    int already_run = 0;  // number of tests to skip at the beginning of the file, if one ended the process
    int threads = 0;      // for scenes that do not set it; 0: all of the machine
    // Like SceneHooks::on_script_timeout, for scenes; the test fails if it returns.
    std::function<void(const std::string& message)> on_script_timeout;
};

// Runs the tests of a file in this process and reports each, in order, on the thread of the call. Scenes are confined
// as usual; the file's own Lua may do anything that a program may, including ending the process, and its time is not
// limited. Only one thread of the process may call this at a time: `threads` applies to the whole process meanwhile
// (tbb::global_control).
//
// Fails with WrongCall if options are not possible or busted is missing, or with the exception of `on_event`, after the
// last test.
Result<Done> run_scene_tests(const std::string& file, const SceneTestOptions& options,
                             const std::function<void(const SceneTestEvent& event)>& on_event);

}  // namespace rapid
