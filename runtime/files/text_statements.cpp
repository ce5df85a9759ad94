#include "runtime/files/text_statements.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/error.h"
#include "runtime/files/scalars.h"

namespace rapid {
namespace {

constexpr std::string_view line_ends = "\r\n", any_space = " \t\v\f\r\n";

bool is_white_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

template <class Number>
Number parsed(std::string_view word, std::size_t line)
{
    Number number{};
    const auto [end, error] = parse_number(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size())
        throw Error(fmt::format("line {}: \"{}\" is not a number", line, word.substr(0, 40)));
    return number;
}

}  // namespace

bool TextStatements::next()
{
    do {
        if (at_ >= text_.size()) return false;
        line_ = lines_ + 1;
        const std::size_t begin = at_;
        std::size_t end;
        bool continued;
        do {
            end = std::min(text_.find_first_of(line_ends, at_), text_.size());
            continued = end > at_ && end < text_.size() && text_[end - 1] == '\\';
            at_ = end + (text_.substr(end, 2) == "\r\n" ? 2 : 1);
            ++lines_;
        } while (continued);
        rest_ = text_.substr(begin, end - begin);
        keyword_ = word();
    } while (keyword_.empty());
    return true;
}

std::string_view TextStatements::word()
{
    const auto continues = [&](std::size_t at) {  // a backslash before the end of a line
        return rest_[at] == '\\' && at + 1 < rest_.size() && line_ends.find(rest_[at + 1]) != std::string_view::npos;
    };
    std::size_t begin = 0;
    while (begin < rest_.size() && (is_white_space(rest_[begin]) || continues(begin))) ++begin;
    if (begin == rest_.size() || rest_[begin] == '#') return rest_ = {};
    std::size_t end = begin;
    while (end < rest_.size() && !is_white_space(rest_[end]) && !continues(end)) ++end;
    const std::string_view word = rest_.substr(begin, end - begin);
    rest_.remove_prefix(end);
    return word;
}

std::string_view TextStatements::rest_of_line() const
{
    const std::size_t begin = rest_.find_first_not_of(any_space);
    if (begin == std::string_view::npos) return {};
    return rest_.substr(begin, rest_.find_last_not_of(any_space) + 1 - begin);
}

float TextStatements::number() { return parsed<float>(word(), line_); }

Vec3f TextStatements::vector()
{
    Vec3f vector;
    for (int axis = 0; axis < 3; ++axis) vector[axis] = number();
    return vector;
}

std::int64_t TextStatements::index(std::string_view word, std::size_t count, std::string_view what) const
{
    const auto index = parsed<std::int64_t>(word, line_);
    if (index > 0) return index - 1;
    if (index == 0 || index < -static_cast<std::int64_t>(count))
        throw Error(fmt::format("line {}: there is no {} {} of {}; they count from 1, or backwards from -1", line_,
                                what, index, count));
    return static_cast<std::int64_t>(count) + index;
}

}  // namespace rapid
