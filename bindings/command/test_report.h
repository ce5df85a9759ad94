// The output of `rapid test`: plain text, TAP 13 for test harnesses, or JUnit's XML for build servers.
#pragma once

#include <memory>
#include <string>

#include "bindings/scene/scene_tests.h"

namespace rapid {

struct TestResult {
    SceneTestEvent::Kind kind;  // not Started
    std::string file;
    std::string name;     // of the test; empty for a file that is Broken
    std::string message;  // of Failed and Broken
    double seconds = 0;
};

struct TestCounts {
    int passed = 0, failed = 0, skipped = 0, broken = 0;

    void add(SceneTestEvent::Kind kind);
};

class TestReport {
public:
    // verbose: reports tests that pass, too. slowest: that many tests are listed with their seconds, as text only.
    static std::unique_ptr<TestReport> make(const std::string& format, bool verbose, std::size_t slowest = 0);
    static constexpr const char* formats[] = {"text", "tap", "junit"};

    virtual ~TestReport() = default;
    virtual void add(const TestResult& result) = 0;
    virtual void end(const TestCounts& counts) = 0;
};

}  // namespace rapid
