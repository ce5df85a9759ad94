// Script-level tests: a file in busted's language, run by our own LuaJIT in a state without restrictions, with the
// module `rapid` of lua/testing. Scenes run in sessions of their own, in this process.
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
        Broken,  // the file can't be read or does not run: its tests are not known
    } kind;
    std::string name;     // of the test, with its describe blocks
    std::string message;  // of Failed and Broken: FILE:LINE: what is wrong, possibly more lines
};

struct TestOptions {
    std::string filter;   // a Lua pattern that a test's name must match; empty: all
    int already_run = 0;  // tests at the beginning of the file that are passed over
    int threads = 0;      // of scenes that do not say; 0: all
    // A scene's script overran, on the watchdog's thread; must not return.
    std::function<void(const std::string& message)> on_timeout;
};

// Runs the tests of a file, and tells of each as it happens.
void run_test_file(const std::filesystem::path& file, const TestOptions& options,
                   const std::function<void(const TestEvent&)>& tell);

}  // namespace rapid
