#include "bindings/command/test_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "bindings/command_line/command.h"

namespace rapid {
namespace {

// The text with a prefix before each line.
std::string prefixed(const std::string& prefix, std::string text)
{
    const std::string next = '\n' + prefix;
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += next.size())
        text.replace(at, 1, next);
    return prefix + text + '\n';
}

class TextReport : public TestReport {
public:
    TextReport(bool verbose, std::size_t slowest) : verbose_(verbose), slowest_(slowest) {}

    void add(const TestResult& result) override
    {
        const std::string& name = result.name.empty() ? result.file : result.name;
        if (result.kind == SceneTestEvent::Failed || result.kind == SceneTestEvent::Broken)
            print(fmt::format("{} {}\n{}", result.kind == SceneTestEvent::Failed ? "FAILED" : "BROKEN", name,
                              prefixed("  ", result.message)));
        else if (verbose_)
            print(fmt::format("{} {}\n", result.kind == SceneTestEvent::Passed ? "passed" : "skipped", name));
        if (slowest_ > 0) durations_.emplace_back(result.seconds, fmt::format("{} ({})", name, result.file));
    }

    void end(const TestCounts& counts) override
    {
        std::sort(durations_.begin(), durations_.end(), std::greater<>());
        durations_.resize(std::min(durations_.size(), slowest_));
        // The format is Catch2's.
        for (const auto& [seconds, name] : durations_) print(fmt::format("{:.3f} s: {}\n", seconds, name));
        print(fmt::format("{} passed, {} failed, {} skipped\n", counts.passed, counts.failed, counts.skipped));
    }

private:
    bool verbose_;
    std::size_t slowest_;
    std::vector<std::pair<double, std::string>> durations_;  // of all tests, if some are to be listed
};

// Test Anything Protocol, version 13: a line for each test as it ends, messages as comments, the plan last.
class TapReport : public TestReport {
public:
    TapReport() { print("TAP version 13\n"); }

    void add(const TestResult& result) override
    {
        std::string name;
        for (const char c : result.name.empty() ? result.file : result.name) {
            if (c == '#' || c == '\\') name += '\\';
            name += c == '\n' ? ' ' : c;
        }
        const bool ok = result.kind == SceneTestEvent::Passed || result.kind == SceneTestEvent::Skipped;
        print(fmt::format("{} {} - {}{}\n{}", ok ? "ok" : "not ok", ++number_, name,
                          result.kind == SceneTestEvent::Skipped ? " # SKIP" : "",
                          ok ? "" : prefixed("# ", result.message)));
    }

    void end(const TestCounts&) override { print(fmt::format("1..{}\n", number_)); }

private:
    int number_ = 0;
};

std::string xml(const std::string& text)
{
    std::string escaped;
    for (const char c : text) {
        switch (c) {
            case '&':
                escaped += "&amp;";
                break;
            case '<':
                escaped += "&lt;";
                break;
            case '>':
                escaped += "&gt;";
                break;
            case '"':
                escaped += "&quot;";
                break;
            case '\n':
                escaped += "&#10;";
                break;
            default:  // XML has no other control characters, not even escaped
                escaped += static_cast<unsigned char>(c) < ' ' && c != '\t' ? '?' : c;
        }
    }
    return escaped;
}

// One suite per file. Its counts come before its tests, so it is printed when all tests have ended.
class JUnitReport : public TestReport {
public:
    void add(const TestResult& result) override
    {
        if (suites_.empty() || suites_.back().file != result.file) suites_.push_back({result.file, {}, 0, {}});
        Suite& suite = suites_.back();
        suite.counts.add(result.kind);
        suite.seconds += result.seconds;
        suite.cases += fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\"", xml(result.file),
                                   xml(result.name), result.seconds);
        if (result.kind == SceneTestEvent::Passed) {
            suite.cases += "/>\n";
            return;
        }
        const std::string first_line = result.message.substr(0, result.message.find('\n'));
        if (result.kind == SceneTestEvent::Skipped)
            suite.cases += ">\n      <skipped/>\n";
        else
            suite.cases += fmt::format(">\n      <{0} message=\"{1}\">{2}</{0}>\n",
                                       result.kind == SceneTestEvent::Failed ? "failure" : "error", xml(first_line),
                                       xml(result.message));
        suite.cases += "    </testcase>\n";
    }

    void end(const TestCounts& counts) override
    {
        double seconds = 0;
        for (const Suite& suite : suites_) seconds += suite.seconds;
        print(fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"rapid test\" {}>\n",
                          attributes(counts, seconds)));
        for (const Suite& suite : suites_)
            print(fmt::format("  <testsuite name=\"{}\" {}>\n{}  </testsuite>\n", xml(suite.file),
                              attributes(suite.counts, suite.seconds), suite.cases));
        print("</testsuites>\n");
    }

private:
    struct Suite {
        std::string file;
        TestCounts counts;
        double seconds;
        std::string cases;
    };

    static std::string attributes(const TestCounts& counts, double seconds)
    {
        return fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3f}\"",
                           counts.passed + counts.failed + counts.skipped + counts.broken, counts.failed, counts.broken,
                           counts.skipped, seconds);
    }

    std::vector<Suite> suites_;
};

}  // namespace

void TestCounts::add(SceneTestEvent::Kind kind)
{
    passed += kind == SceneTestEvent::Passed;
    failed += kind == SceneTestEvent::Failed;
    skipped += kind == SceneTestEvent::Skipped;
    broken += kind == SceneTestEvent::Broken;
}

std::unique_ptr<TestReport> TestReport::make(const std::string& format, bool verbose, std::size_t slowest)
{
    if (format == "tap") return std::make_unique<TapReport>();
    if (format == "junit") return std::make_unique<JUnitReport>();
    return std::make_unique<TextReport>(verbose, slowest);
}

}  // namespace rapid
