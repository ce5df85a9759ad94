#include "runtime/points/token.h"

#include <fmt/format.h>
#include <tbb/concurrent_vector.h>

#include <limits>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

#include "runtime/base/memory_budget.h"

namespace rapid {
namespace {

constexpr std::size_t bytes_per_entry = 128;               // of a string, besides its characters
constexpr std::size_t bytes_between_checks = 64ull << 20;  // smaller amounts are not checked against the budget

// Returns the length of a UTF-8 character by its first byte: 1 to 4, or 0 if the byte starts no character.
std::size_t length_of(unsigned char first)
{
    if (first < 0x80) return 1;
    if (first < 0xc2) return 0;
    return first < 0xe0 ? 2 : first < 0xf0 ? 3 : first < 0xf5 ? 4 : 0;
}

// Checks against RFC 3629: no overlong forms, no surrogates, nothing above U+10FFFF.
bool is_utf8(std::string_view text)
{
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    for (std::size_t i = 0; i < text.size();) {
        const unsigned char first = byte(i);
        const std::size_t length = length_of(first);
        if (length == 0 || length > text.size() - i) return false;
        for (std::size_t k = 1; k < length; ++k)
            if ((byte(i + k) & 0xc0) != 0x80) return false;
        if (length > 2) {
            const unsigned char second = byte(i + 1);
            if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f)) return false;
            if ((first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f)) return false;
        }
        i += length;
    }
    return true;
}

// Returns the beginning of a string, with unprintable bytes as \xNN.
std::string shown(std::string_view text)
{
    std::string result;
    for (const char c : text.substr(0, 40))
        result += c >= ' ' && c <= '~' ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    return result + (text.size() > 40 ? "..." : "");
}

class Table {
public:
    Table() { add(""); }

    Token add(std::string_view text)
    {
        const std::lock_guard lock(mutex_);
        if (const auto found = numbers_.find(text); found != numbers_.end()) return {found->second};
        take(text.size() + bytes_per_entry);
        const auto entry = strings_.emplace_back(text);
        const auto number = static_cast<std::uint32_t>(entry - strings_.begin());
        numbers_.emplace(*entry, number);
        return {number};
    }

    // Strings do not move when others are added.
    std::string_view operator[](std::uint32_t number) const { return strings_[number]; }
    std::size_t size() const { return strings_.size(); }

private:
    void take(std::size_t bytes)
    {
        if (strings_.size() > std::numeric_limits<std::uint32_t>::max())
            throw Error("attributes have more than 2^32 different strings; use numbers to tell points apart");
        unchecked_ += bytes;
        if (unchecked_ < bytes_between_checks) return;
        const auto next = static_cast<double>(std::exchange(unchecked_, 0)) + bytes_between_checks;
        if (!fits_in_memory(next))
            throw memory_exceeded(fmt::format("{} different strings in attributes", strings_.size()), next,
                                  "use numbers to tell points apart");
    }

    std::mutex mutex_;
    tbb::concurrent_vector<std::string> strings_;  // by number
    std::unordered_map<std::string_view, std::uint32_t> numbers_;
    std::size_t unchecked_ = 0;  // bytes since the last check of the memory budget
};

// Returns the table of the process. It is leaked, because columns in static objects may outlive it.
Table& table()
{
    static Table& all = *new Table;
    return all;
}

}  // namespace

Token token_of(std::string_view text)
{
    if (text.empty()) return Token();
    if (!is_utf8(text) || text.find('\0') != std::string_view::npos)
        throw Error(
            fmt::format("the string \"{}\" of an attribute is not valid UTF-8 without zero bytes", shown(text)));
    return table().add(text);
}
std::string_view Token::text() const { return number == 0 ? std::string_view("") : table()[number]; }
Token token_of_number(std::uint32_t number)
{
    if (number >= table().size())
        throw Error(fmt::format("no string has the number {}; rapid_frame_token_of() returns valid ones", number));
    return {number};
}

}  // namespace rapid
