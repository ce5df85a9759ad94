#include "runtime/base/printable.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {
namespace {

// kept: control characters that are not escaped.
std::string without_commands(std::string_view text, std::string_view kept)
{
    std::string result;
    result.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
        if ((byte < 0x20 && kept.find(text[i]) == std::string_view::npos) || byte == 0x7f) {
            result += fmt::format("\\x{:02x}", byte);
        } else if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {
            result += fmt::format("\\x{:02x}", next);
            ++i;
        } else {
            result += text[i];
        }
    }
    return result;
}

}  // namespace

std::string printable(std::string_view text) { return without_commands(text, "\n\t"); }

std::string printable_name(std::string_view name)
{
    constexpr std::size_t most = 200;  // the limit for a node's name in an error
    return without_commands(shortened(name, most), "");
}

std::string shortened(std::string_view text, std::size_t most)
{
    if (text.size() <= most) return std::string(text);
    const auto is_inside = [&](std::size_t at) { return (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80; };
    std::size_t head = most * 3 / 4, tail = text.size() - most / 4;  // at boundaries of UTF-8 characters
    while (head > 0 && is_inside(head)) --head;
    while (tail < text.size() && is_inside(tail)) ++tail;
    return fmt::format("{} [... {} bytes ...] {}", text.substr(0, head), tail - head, text.substr(tail));
}

std::size_t width_of(std::string_view text) { return std::min<std::size_t>(text.size(), 40); }

}  // namespace rapid
