// Script-level tests: a file in busted's language, run in an unrestricted LuaJIT state with the module `rapid` of
// lua/testing. Scenes run in their own sessions, in this process.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace rapid {

struct TestEvent {
    enum Kind {
        Started,
        Passed,
        Failed,
        Skipped,
        Broken,  // the file cannot be read or run, so its tests are unknown
    } kind;
    std::string name;     // name of the test, with its describe blocks
    std::string message;  // of Failed and Broken: FILE:LINE: the fault, possibly more lines
};

struct TestOptions {
    std::string filter;   // a Lua pattern for names of tests; empty: all
    int already_run = 0;  // number of tests at the beginning of the file to skip
    int threads = 0;      // for scenes that do not set it; 0: all
    // Called from the watchdog's thread when a scene's script overruns, before it is stopped.
    std::function<void(const std::string& message)> on_timeout;
};

// Runs the tests of a file, and reports each event as it happens.
void run_test_file(const std::filesystem::path& file, const TestOptions& options,
                   const std::function<void(const TestEvent&)>& on_event);

}  // namespace rapid
