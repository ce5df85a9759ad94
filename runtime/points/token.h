// A text as a number, for columns of texts. Equal texts have equal numbers, in one process; 0 is the empty text.
//
// All texts of a process are in one table, which keeps each once and never lets one go. Numbers follow the order in
// which texts came, which is that of threads: nothing that is written or drawn may depend on them, but on their texts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rapid {

struct Token {
    std::uint32_t number = 0;

    // Valid as long as the process is. From any thread, for tokens of token_of().
    std::string_view text() const;
    bool operator==(const Token&) const = default;
};

// From any thread. Error: it is no UTF-8, or holds a 0; or there is no memory for one more.
Token token_of(std::string_view text);
// Of a program that embeds Rapid. Error: no text has this number.
Token token_of_number(std::uint32_t number);

}  // namespace rapid
