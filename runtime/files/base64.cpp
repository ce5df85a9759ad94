#include "runtime/files/base64.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "runtime/base/error.h"

namespace rapid {

std::vector<unsigned char> from_base64(std::string_view text, std::size_t bytes, std::size_t& length)
{
    static const std::array<std::int8_t, 256> values = [] {
        std::array<std::int8_t, 256> table;
        table.fill(-1);
        const std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (std::size_t i = 0; i < digits.size(); ++i)
            table[static_cast<unsigned char>(digits[i])] = static_cast<std::int8_t>(i);
        return table;
    }();
    if (bytes > text.size() / 4 * 3) throw Error("the array ends early");
    length = (bytes + 2) / 3 * 4;
    std::vector<unsigned char> result;
    result.reserve(length / 4 * 3);
    for (std::size_t at = 0; at < length; at += 4) {
        std::uint32_t word = 0;
        for (std::size_t c = 0; c < 4; ++c) {
            const std::int8_t value = values[static_cast<unsigned char>(text[at + c])];
            const bool padding = text[at + c] == '=' && at + 4 == length && c >= 2;
            if (value < 0 && !padding) throw Error("the array is not valid base64");
            word = word << 6 | static_cast<std::uint32_t>(padding ? 0 : value);
        }
        for (int shift = 16; shift >= 0; shift -= 8) result.push_back(static_cast<unsigned char>(word >> shift));
    }
    result.resize(bytes);
    return result;
}

std::vector<unsigned char> from_base64(std::string_view text)
{
    const auto padding = static_cast<std::size_t>(
        std::count(text.end() - std::min<std::ptrdiff_t>(2, std::ssize(text)), text.end(), '='));
    std::size_t length = 0;
    const std::size_t all = text.size() / 4 * 3;
    return from_base64(text, all - std::min(padding, all), length);
}

}  // namespace rapid
