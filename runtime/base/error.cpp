#include "runtime/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <utility>

#include "runtime/base/printable.h"

namespace rapid {

Error& Error::at(const Location& location)
{
    if (location_.file.empty()) location_ = location;
    compose();
    return *this;
}

Error& Error::in_node(std::string_view name)
{
    if (node_.empty()) node_ = name;
    compose();
    return *this;
}

Error& Error::with_trace(std::string trace)
{
    if (trace_.empty()) trace_ = std::move(trace);
    return *this;
}

Error Error::reworded(std::string message) const
{
    Error result = *this;
    result.message_ = std::move(message);
    result.compose();
    return result;
}

std::string error_text(const Location& location, std::string_view node, std::string_view message)
{
    constexpr std::size_t max_message_bytes = 4000, max_name_bytes = 200;  // bytes
    constexpr std::size_t max_path_bytes = 4096;                           // longer ones name no file
    std::string text;
    if (!location.file.empty()) {
        text += shortened(location.file, max_path_bytes);
        if (location.line > 0) text += fmt::format(":{}", location.line);
        text += ": ";
    }
    if (!node.empty()) text += fmt::format("node \"{}\": ", shortened(node, max_name_bytes));
    text += shortened(message, max_message_bytes);
    // what() would end there.
    for (std::size_t zero; (zero = text.find('\0')) != std::string::npos;) text.replace(zero, 1, "\\x00");
    return text;
}

namespace {

std::string lower_case(std::string_view text)
{
    std::string lower(text);
    for (char& c : lower)
        if (c >= 'A' && c <= 'Z') c += 'a' - 'A';
    return lower;
}

// Optimal string alignment distance: insertions, deletions, replacements and transpositions ("linaer" is one step from
// "linear").
std::size_t edit_distance(std::string_view a, std::string_view b)
{
    std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
    std::iota(above.begin(), above.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = std::exchange(above, row);
    }
    return above[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view name, const std::vector<std::string>& names)
{
    std::string nearest;
    const std::string target = lower_case(name);
    std::size_t least = std::max<std::size_t>(1, name.size() / 3) + 1;
    for (const std::string& candidate : names) {
        const std::size_t distance = edit_distance(target, lower_case(candidate));
        const bool alike = distance < std::max(name.size(), candidate.size());
        if (alike && distance < least) {
            least = distance;
            nearest = candidate;
        }
    }
    return nearest;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& names)
{
    const std::string nearest = nearest_name(name, names);
    return nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
}

void assertion_failed(const char* condition, const char* file, int line)
{
    std::fprintf(stderr, "%s:%d: this is a bug in Rapid: %s does not hold\n", file, line, condition);
    std::abort();
}

}  // namespace rapid
