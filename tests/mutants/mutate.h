// Damaged copies of a file, reproducible from a seed.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>

namespace rapid::test {

class Mutator {
public:
    explicit Mutator(std::uint64_t seed) : random_(seed) {}

    // Damages a text in one to eight ways: bits, bytes and words, numbers in text, pieces removed, doubled or moved.
    std::string operator()(std::string text)
    {
        for (std::size_t left = 1 + below(8); left > 0; --left) damage(text);
        return text;
    }

    // Replaces one or two numbers, in bytes or in text, by ones so large that as counts they would need much memory.
    std::string with_large_numbers(std::string text)
    {
        static constexpr std::array<std::string_view, 6> numbers = {"1048576",    "16777216",   "268435456",
                                                                    "2147483647", "4294967296", "1099511627776"};
        for (std::size_t left = 1 + below(2); left > 0; --left) {
            const std::size_t at = below(text.size());
            if (below(2) == 0)
                replace_number(text, at, numbers[below(numbers.size())]);
            else
                overwrite(text, at, std::uint64_t{1} << (16 + below(32)), std::size_t{2} << below(3));
        }
        return text;
    }

private:
    std::size_t below(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random_() % n); }

    void damage(std::string& text)
    {
        static constexpr std::array<std::uint64_t, 10> words = {
            0, 1, 0x7f, 0xff, 0x7fffffff, 0x80000000, 0xffffffff, 0x7fc00000, 0x7ff8000000000000, ~std::uint64_t{0}};
        static constexpr std::array<std::string_view, 10> numbers = {
            "-1", "0", "1000000", "99999999999", "18446744073709551615", "nan", "1e400", "0.5", "", "x"};
        const std::size_t at = below(text.size());
        switch (below(8)) {
            case 0:
                if (!text.empty()) text[at] = static_cast<char>(text[at] ^ 1 << below(8));
                break;
            case 1:
                if (!text.empty()) text[at] = static_cast<char>(below(256));
                break;
            case 2: {
                const std::uint64_t word = words[below(words.size())];
                overwrite(text, at, word, std::size_t{1} << below(4));
                break;
            }
            case 3:
                text.resize(at);
                break;
            case 4:
                text.erase(at, 1 + below(64));
                break;
            case 5:
                text.insert(at, text.substr(below(text.size()), 1 + below(256)));
                break;
            case 6:
                replace_number(text, at, numbers[below(numbers.size())]);
                break;
            case 7: {
                const std::size_t other = below(text.size());
                for (std::size_t b = below(32); b > 0 && at + b < text.size() && other + b < text.size(); --b)
                    std::swap(text[at + b], text[other + b]);
                break;
            }
        }
    }

    // Writes the low bytes of a word, in either byte order.
    void overwrite(std::string& text, std::size_t at, std::uint64_t word, std::size_t bytes)
    {
        const bool swapped = below(2) == 1;
        for (std::size_t b = 0; b < bytes && at + b < text.size(); ++b)
            text[at + b] = static_cast<char>(word >> 8 * (swapped ? bytes - 1 - b : b));
    }

    static void replace_number(std::string& text, std::size_t at, std::string_view number)
    {
        const std::size_t begin = text.find_first_of("0123456789", at);
        if (begin == std::string::npos) return;
        const std::size_t end = std::min(text.find_first_not_of("0123456789", begin), text.size());
        text.replace(begin, end - begin, number);
    }

    std::mt19937_64 random_;
};

}  // namespace rapid::test
