// What a user can cause: an exception that says what is wrong, where, and what would be right.
//
//   FILE:LINE: node "NAME": what is wrong; what would be right
//
// It is thrown where the fault is known and given its node, file and line as it rises. What only a bug of Rapid can
// cause is RAPID_ASSERT.
#pragma once

#include <exception>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

struct Location {
    std::string file;  // as the user named it; empty where there is none
    int line = 0;      // from 1; 0 where unknown
};

class Error : public std::exception {
public:
    explicit Error(std::string message) : message_(std::move(message)) { compose(); }

    // Each fills in what is not known yet: the place nearest to the fault is the one that is kept.
    Error& at(const Location& location);
    Error& in_node(std::string_view name);

    // For --verbose alone: the script's call stack.
    Error& with_trace(std::string trace);

    const char* what() const noexcept override { return text_.c_str(); }
    const std::string& message() const { return message_; }
    const Location& location() const { return location_; }
    const std::string& node() const { return node_; }
    const std::string& trace() const { return trace_; }

private:
    void compose();

    std::string message_, node_, trace_, text_;
    Location location_;
};

// The name among `names` that `name` was most likely meant to be: the smallest edit distance, upper and lower case
// alike, if that is at most a third of its length (at least 1) and leaves something of both. Empty when none is near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& names);

// `; did you mean "NEAREST"?`, or nothing.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& names);

[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace rapid

// On in debug, sanitizer and RelWithDebInfo builds.
#ifdef RAPID_ASSERTIONS
#define RAPID_ASSERT(condition) ((condition) ? void() : ::rapid::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define RAPID_ASSERT(condition) void(sizeof(!(condition)))
#endif
