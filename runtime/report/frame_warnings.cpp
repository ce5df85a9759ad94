#include "runtime/report/frame_warnings.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Returns the end of the number that begins at a digit: 12, 1.5, 1e-06.
std::size_t end_of_number(std::string_view text, std::size_t at)
{
    const auto digit_at = [&](std::size_t i) { return i < text.size() && is_digit(text[i]); };
    while (digit_at(at)) ++at;
    if (at < text.size() && text[at] == '.' && digit_at(at + 1))
        for (++at; digit_at(at);) ++at;
    if (at + 1 < text.size() && text[at] == 'e') {
        const std::size_t exponent = at + (text[at + 1] == '-' || text[at + 1] == '+' ? 2 : 1);
        if (digit_at(exponent))
            for (at = exponent; digit_at(at);) ++at;
    }
    return at;
}

// Returns the end of FILE:LINE: at the beginning; 0 if there is none.
std::size_t end_of_location(std::string_view text)
{
    const std::size_t end = text.find(": ");
    if (end == std::string_view::npos || end == 0 || !is_digit(text[end - 1])) return 0;
    std::size_t line = end;
    while (line > 0 && is_digit(text[line - 1])) --line;
    return line > 0 && text[line - 1] == ':' ? end : 0;
}

}  // namespace

std::string kind_of_warning(std::string_view text)
{
    std::size_t at = end_of_location(text);
    std::string kind(text.substr(0, at));
    bool quoted = false;
    while (at < text.size()) {
        const char c = text[at];
        quoted ^= c == '"';
        if (!quoted && is_digit(c)) {
            if (!kind.empty() && kind.back() == '-') kind.pop_back();
            kind += '#';
            at = end_of_number(text, at);
        } else {
            kind += c;
            ++at;
        }
    }
    return kind;
}

bool FrameWarnings::add(const std::string& text, std::int64_t frame)
{
    const std::string name = kind_of_warning(text);
    if (kinds_.size() == max_kinds && !kinds_.contains(name)) {
        ++others_;
        return false;
    }
    Kind& kind = kinds_[name];
    if (std::find(kind.printed.begin(), kind.printed.end(), text) != kind.printed.end()) return false;
    if (kind.printed.size() < printed_of_each) {
        kind.printed.push_back(text);
        return true;
    }
    ++kind.suppressed;
    kind.last = text;
    kind.frame = frame;
    return false;
}

std::vector<std::string> FrameWarnings::suppressed() const
{
    std::vector<const Kind*> kinds;
    for (const auto& [name, kind] : kinds_)
        if (kind.suppressed > 0) kinds.push_back(&kind);
    std::stable_sort(kinds.begin(), kinds.end(), [](const Kind* a, const Kind* b) { return a->frame < b->frame; });
    std::vector<std::string> lines;
    for (const Kind* kind : kinds)
        lines.push_back(fmt::format("{} more warnings of this kind, the last in frame {}: {}", kind->suppressed,
                                    kind->frame, kind->last));
    if (others_ > 0) lines.push_back(fmt::format("{} more warnings of other kinds", others_));
    return lines;
}

}  // namespace rapid
