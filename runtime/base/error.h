// Errors that a user can cause: exceptions that describe the fault, its location and the remedy.
//
//   FILE:LINE: node "NAME": what is wrong; what would be right
//
// An Error is thrown where the fault is found, and gets its node, file and line as it propagates. Its kind tells the
// caller how to react. Faults that only a bug of Rapid can cause are for RAPID_ASSERT.
#pragma once

#include <exception>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

struct Location {
    std::string file;  // as the user named it, or empty
    int line = 0;      // from 1, or 0 if unknown
};

// FILE:LINE: node "NAME": MESSAGE, as far as they are known, each shortened if it is endless.
std::string error_text(const Location& location, std::string_view node, std::string_view message);

enum class ErrorKind {
    Fault,        // a scene, an argument or a file is wrong, or the system refused something
    WrongCall,    // a program called a function at the wrong time or with a wrong argument; nothing has changed
    Cancelled,    // on request
    TooLong,      // a script exceeded its time
    OutOfMemory,  // the system has no more, or a limit does not allow it
};

class Error : public std::exception {
public:
    explicit Error(std::string message, ErrorKind kind = ErrorKind::Fault) : message_(std::move(message)), kind_(kind)
    {
        compose();
    }

    // Each sets only what is still empty, so the location nearest to the fault is kept.
    Error& at(const Location& location);
    Error& in_node(std::string_view name);

    // The script's call stack, which --verbose prints.
    Error& with_trace(std::string trace);

    // Returns the same error with another message.
    Error reworded(std::string message) const;

    const char* what() const noexcept override { return text_.c_str(); }
    ErrorKind kind() const { return kind_; }
    const std::string& message() const { return message_; }
    const Location& location() const { return location_; }
    const std::string& node() const { return node_; }
    const std::string& trace() const { return trace_; }

private:
    void compose() { text_ = error_text(location_, node_, message_); }

    std::string message_, node_, trace_, text_;
    Location location_;
    ErrorKind kind_;
};

// The name among `names` that `name` was probably meant to be: the one with the smallest edit distance, regardless of
// case, if that is at most a third of its length (at least 1) and less than the longer of both. Empty if none is near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& names);

// `; did you mean "NEAREST"?`, or an empty string.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& names);

[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace rapid

// Active in debug, sanitizer and RelWithDebInfo builds.
#ifdef RAPID_ASSERTIONS
#define RAPID_ASSERT(condition) ((condition) ? void() : ::rapid::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define RAPID_ASSERT(condition) void(sizeof(!(condition)))
#endif
