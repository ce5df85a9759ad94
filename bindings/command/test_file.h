// A file of tests that `rapid test` runs in a child process, so that one that crashes, hangs in a script or ends its
// process is only one failure. If a test ends the process, a new one continues with the next test of the file.
#pragma once

#include <sys/types.h>

#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bindings/command/test_report.h"
#include "runtime/files/file_error.h"

namespace rapid {

// The child's end of the pipe on which it reports its tests.
inline constexpr int test_report_descriptor = 3;

// The child: runs the tests of a file in this process and reports each to the parent.
void run_tests_as_child(const std::string& file, const SceneTestOptions& options);

class TestFile {
public:
    // Starts the process: this program with `words` and two words more, of which --already-run=N is the first and
    // the file the last. With `capture` its standard output and error are kept until take_results() prints them.
    TestFile(std::filesystem::path file, std::vector<std::string> words, bool capture);

    // Readable if receive() has something to do.
    int descriptor() const { return reports_.number(); }
    // Reads what the process has reported, and notices its end. Blocks if there is nothing.
    void receive();
    bool has_ended() const { return has_ended_; }

    // Passes on the results that were received since the last call, and prints the captured output that came before
    // each of them.
    void take_results(const std::function<void(const TestResult&)>& add);

private:
    // Output of the process on one of its standard streams.
    class Capture {
    public:
        void open();
        int descriptor() const { return file_.number(); }
        std::string take(off_t end);  // from the end of the last call
        std::string take_all();

    private:
        Descriptor file_;
        off_t taken_ = 0;
    };

    struct Received {
        std::optional<TestResult> result;  // none: the output after the last test
        std::string out, err;              // before the result
    };

    void start();
    void read_report(const std::string& line);
    void end_process();
    void end_file(std::optional<TestResult> result);

    std::filesystem::path file_;
    std::vector<std::string> words_;
    Capture out_, err_;
    std::deque<Received> received_;

    // State of the current process.
    pid_t child_ = 0;
    Descriptor reports_;
    std::string unread_;         // the beginning of a report
    std::string running_;        // the test that has started and not ended; empty: none
    int started_ = 0;            // tests, by this process and those before it
    bool all_reported_ = false;  // the process has nothing left to run
    bool has_ended_ = false;     // no process will follow
};

}  // namespace rapid
