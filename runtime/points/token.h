// A string represented as a number, for string columns. Within a process, equal strings have equal numbers; 0 is the
// empty string.
//
// A process-wide table stores each string once and never removes it. Numbers follow the order in which strings arrive,
// which depends on thread timing: output and images must depend on the strings alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rapid {

struct Token {
    std::uint32_t number = 0;

    // Returns the string. It is valid for the life of the process. Thread-safe for tokens from token_of().
    std::string_view text() const;
    bool operator==(const Token&) const = default;
};

// Thread-safe. Throws Error if the text is not UTF-8, contains a zero byte, or does not fit in memory.
Token token_of(std::string_view text);
// Converts a number from an embedding program. Throws Error if no string has this number.
Token token_of_number(std::uint32_t number);

}  // namespace rapid
