#include "runtime/io/usda_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "runtime/error.h"
#include "runtime/files/left_out.h"
#include "runtime/memory_budget.h"
#include "runtime/points/token.h"

namespace rapid {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
bool is_word(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_:.+-").find(c) != std::string_view::npos;
}

// Returns an empty array for the name of its type ("point3f[]"), or nothing for unsupported types.
std::optional<UsdArray> array_of(std::string_view type)
{
    if (!type.ends_with("[]")) return {};
    type.remove_suffix(2);
    const auto integers_of = [](ScalarType scalar, auto like) {
        using Limits = std::numeric_limits<decltype(like)>;
        constexpr std::uint64_t held = std::numeric_limits<std::int64_t>::max();
        return UsdArray{"", scalar, 1, false, Limits::min(), std::int64_t(std::min<std::uint64_t>(Limits::max(), held)),
                        {}};
    };
    if (type == "string" || type == "token") {
        UsdArray array = integers_of(ScalarType::UInt32, std::uint32_t{});
        array.texts = true;
        return array;
    }
    if (type == "bool") return integers_of(ScalarType::UInt8, std::int32_t{});
    if (type == "uchar") return integers_of(ScalarType::Int32, std::uint8_t{});
    if (type == "uint") return integers_of(ScalarType::Int64, std::uint32_t{});
    if (type == "int64") return integers_of(ScalarType::Int64, std::int64_t{});
    if (type == "uint64") return integers_of(ScalarType::Int64, std::uint64_t{});
    UsdArray array = integers_of(ScalarType::Double, std::int32_t{});
    array.quaternion = type.starts_with("quat");
    static constexpr std::string_view integers[] = {"int", "int2", "int3", "int4"};
    static constexpr std::string_view floats[] = {
        "half", "float", "double", "point3", "vector3", "normal3", "color3", "color4",  "texCoord2", "texCoord3",
        "quat", "half2", "half3",  "half4",  "float2",  "float3",  "float4", "double2", "double3",   "double4"};
    const auto is_in = [](const auto& names, std::string_view name) {
        return std::find(std::begin(names), std::end(names), name) != std::end(names);
    };
    if (is_in(integers, type))
        array.type = ScalarType::Int32;
    else if (!is_in(floats, type) && !is_in(floats, type.substr(0, type.size() - !type.empty())))
        return {};
    const std::size_t digit = type.find_first_of("234");
    array.tuple = array.quaternion                  ? 4
                  : digit == std::string_view::npos ? 1
                                                    : static_cast<std::size_t>(type[digit] - '0');
    return array;
}

class UsdaReader {
public:
    explicit UsdaReader(std::string_view text) : text_(text) {}

    std::vector<UsdArray> read()
    {
        if (!text_.starts_with("#usda")) throw Error("not USD's text: it does not begin with \"#usda\"");
        bool found = false;
        while (skip_space(), at_ < text_.size()) {
            if (!is_word(text_[at_])) {
                skip_mark();
                continue;
            }
            if (word() != "def" || (skip_space(), !at_word()) || word() != "Points") continue;
            if (std::exchange(found, true))
                throw wrong("there are several prims of the type Points; there must be one");
            skip_space();
            skip_value();  // name
            if (skip_space(), is_at('(')) skip_value();
            if (skip_space(), !is_at('{')) throw wrong("the prim of points has no { }");
            ++at_;
            read_properties();
        }
        if (!found) throw Error("there is no prim of the type Points");
        return {std::move_iterator(arrays_.begin()), std::move_iterator(arrays_.end())};
    }

private:
    Error wrong(const std::string& what) const
    {
        const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size()));
        return Error(fmt::format("line {}: {}", 1 + std::count(text_.begin(), end, '\n'), what));
    }
    bool is_at(char c) const { return at_ < text_.size() && text_[at_] == c; }
    bool at_word() const { return at_ < text_.size() && is_word(text_[at_]); }

    // Skips white space and comments. Returns true if a line ended.
    bool skip_space()
    {
        bool line = false;
        for (; at_ < text_.size(); ++at_) {
            if (text_[at_] == '#') at_ = std::min(text_.find('\n', at_), text_.size());
            if (at_ == text_.size() || !is_space(text_[at_])) break;
            line |= text_[at_] == '\n';
        }
        return line;
    }
    std::string_view word()
    {
        const std::size_t begin = at_;
        while (at_word()) ++at_;
        if (text_.substr(at_, 2) == "[]") at_ += 2;
        return text_.substr(begin, at_ - begin);
    }
    void skip_to(std::string_view end, std::size_t from)
    {
        const std::size_t found = text_.find(end, from);
        if (found == std::string_view::npos) throw wrong(fmt::format("no {} follows", end));
        at_ = found + end.size();
    }
    // Skips a string, a path of a file or prim, or one other character.
    void skip_mark()
    {
        const char c = text_[at_];
        if (c == '"' || c == '\'') {
            const std::string three(3, c);
            if (text_.substr(at_, 3) == three) return skip_to(three, at_ + 3);
            for (++at_; at_ < text_.size() && text_[at_] != c; ++at_)
                if (text_[at_] == '\\') ++at_;
            if (at_ >= text_.size()) throw wrong("a text has no end");
            ++at_;
        } else if (c == '@') {
            text_.substr(at_, 3) == "@@@" ? skip_to("@@@", at_ + 3) : skip_to("@", at_ + 1);
        } else if (c == '<') {
            skip_to(">", at_);
        } else {
            ++at_;
        }
    }
    // Returns a quoted string with escapes resolved.
    std::string text_value()
    {
        if (!is_at('"') && !is_at('\'')) throw wrong("there is no text where there should be one");
        const std::size_t begin = at_;
        skip_mark();
        const std::string_view quoted = text_.substr(begin, at_ - begin);
        const std::size_t quotes = quoted.size() >= 6 && quoted[1] == quoted[0] && quoted[2] == quoted[0] ? 3 : 1;
        std::string text;
        for (std::size_t i = quotes; i < quoted.size() - quotes; ++i) {
            if (quoted[i] != '\\') {
                text += quoted[i];
                continue;
            }
            const char c = quoted[++i];
            if (c == 'x' && i + 2 < quoted.size() - quotes) {
                unsigned byte = 0;
                std::from_chars(quoted.data() + i + 1, quoted.data() + i + 3, byte, 16);
                text += static_cast<char>(byte);
                i += 2;
            } else {
                text += c == 'n' ? '\n' : c == 't' ? '\t' : c == 'r' ? '\r' : c;
            }
        }
        return text;
    }
    // Skips a word, a string, a path, or everything between brackets.
    void skip_value()
    {
        if (at_word()) {
            word();
            return;
        }
        std::size_t depth = 0;
        do {
            skip_space();
            if (at_ >= text_.size()) throw wrong("the file ends within a value");
            if (std::string_view("([{").find(text_[at_]) != std::string_view::npos) ++depth;
            if (std::string_view(")]}").find(text_[at_]) != std::string_view::npos && depth-- == 0)
                throw wrong("a bracket closes that was not opened");
            skip_mark();
        } while (depth > 0);
    }

    void read_properties()
    {
        while (true) {
            skip_space();
            if (at_ >= text_.size()) throw wrong("the file ends within the prim of points");
            if (is_at('}')) {
                ++at_;
                return;
            }
            read_statement();
        }
    }

    // Reads [custom] TYPE NAME [= VALUE] [(METADATA)], or skips a prim within this one.
    void read_statement()
    {
        std::string_view type, name;
        bool line = false;
        while (!line && at_word()) {
            type = name;
            name = word();
            line = skip_space();
        }
        if (!line && is_at('=')) {
            ++at_;
            skip_space();
            read_value(type, name);
            line = skip_space();
        } else if (name.empty() && !is_at('"') && !is_at('(') && !is_at('{') && !is_at(';')) {
            throw wrong("there is no property of a prim where there should be one");
        } else if (!line && at_ < text_.size() && !is_at('}')) {
            skip_mark_or_brackets();
            line = false;
        }
        if (!line && (is_at('(') || is_at('{'))) skip_value();
    }
    void skip_mark_or_brackets() { is_at('(') || is_at('{') || is_at('[') ? skip_value() : skip_mark(); }

    void read_value(std::string_view type, std::string_view name)
    {
        constexpr std::string_view samples = ".timeSamples";
        std::optional<UsdArray> array = array_of(type);
        // Strings other than primvars describe how the prim is placed and drawn.
        if (!array || (array->texts && !name.starts_with("primvars:"))) {
            if (type.ends_with("[]")) LeftOut::add(fmt::format("{} of the type {}", name, type));
            return skip_value();
        }
        if (!names_.insert(name).second) throw wrong(fmt::format("{} is there twice", name));
        if (!name.ends_with(samples)) {
            if (!is_at('[')) return skip_value();  // None
            array->name = std::string(name);
            read_numbers(*array);
            if (!by_name_.contains(name)) add(name, std::move(*array));
            return;
        }
        name.remove_suffix(samples.size());
        if (!is_at('{')) throw wrong("time samples have no { }");
        ++at_;
        bool found = false;
        while (skip_space(), !is_at('}')) {
            if (!at_word()) throw wrong("a time sample has no time");
            word();  // time, followed by a colon
            if (skip_space(), is_at(':')) ++at_;
            skip_space();
            if (std::exchange(found, true))
                throw wrong(
                    fmt::format("{} has several time samples; give a file of one frame (usdcat can take one)", name));
            if (is_at('['))
                read_numbers(*array);
            else
                skip_value();
            if (skip_space(), is_at(',')) ++at_;
        }
        ++at_;
        array->name = std::string(name);
        if (const auto before = by_name_.find(name); before != by_name_.end()) {
            arrays_.erase(before->second);
            by_name_.erase(before);
        }
        if (found) add(name, std::move(*array));
    }
    void add(std::string_view name, UsdArray array)
    {
        by_name_.emplace(name, arrays_.insert(arrays_.end(), std::move(array)));
    }

    // Reads [1, 2] or [(1, 2, 3), (4, 5, 6)].
    void read_numbers(UsdArray& array)
    {
        ++at_;
        while (skip_space(), !is_at(']')) {
            const bool tuple = array.tuple > 1;
            if (tuple) expect('(');
            for (std::size_t c = 0; c < array.tuple; ++c) {
                if (c > 0) expect(',');
                skip_space();
                read_number(array);
            }
            if (tuple) expect(')');
            if (skip_space(), !is_at(']')) expect(',');
        }
        ++at_;
    }
    void expect(char c)
    {
        skip_space();
        if (!is_at(c)) throw wrong(fmt::format("there is no '{}' where there should be one", c));
        ++at_;
    }

    // Throws Error if the array is too large. A number takes at least two bytes of text, and more memory while its
    // array grows and is converted to a column.
    void check_memory(const UsdArray& array) const
    {
        if (const double bytes = 4.0 * static_cast<double>(array.bytes.size()); !fits_in_memory(bytes))
            throw beyond_memory(fmt::format("an array of at least {} rows", array.rows()), bytes,
                                "write .bgeo in its place");
    }

    void read_number(UsdArray& array)
    {
        const char *from = text_.data() + at_, *end = text_.data() + text_.size();
        const auto put = [&](auto number) {
            if (array.bytes.size() == array.bytes.capacity()) check_memory(array);
            const auto* bytes = reinterpret_cast<const unsigned char*>(&number);
            array.bytes.insert(array.bytes.end(), bytes, bytes + sizeof number);
        };
        const auto parse = [&](auto number) {
            const auto parsed = std::from_chars(from, end, number);
            bool fits = parsed.ec == std::errc();
            if constexpr (std::is_integral_v<decltype(number)>) fits &= number >= array.least && number <= array.most;
            if (!fits) throw wrong("there is no number of its type where there should be one");
            at_ = static_cast<std::size_t>(parsed.ptr - text_.data());
            return number;
        };
        if (array.texts) return put(token_of(text_value()).number);
        switch (array.type) {
            case ScalarType::Int32:
                return put(parse(std::int32_t{}));
            case ScalarType::Int64:
                return put(parse(std::int64_t{}));
            case ScalarType::UInt8:
                if (text_.substr(at_, 4) == "true" || text_.substr(at_, 5) == "false")
                    return put(std::uint8_t(word() == "true"));
                return put(std::uint8_t(parse(std::int32_t{}) != 0));
            default:
                return put(parse(double{}));
        }
    }

    std::string_view text_;
    std::size_t at_ = 0;
    std::list<UsdArray> arrays_;
    std::map<std::string_view, std::list<UsdArray>::iterator> by_name_;
    std::set<std::string_view> names_;  // of all arrays so far, with and without time samples
};

}  // namespace

std::vector<UsdArray> usda_points(std::string_view text) { return UsdaReader(text).read(); }

}  // namespace rapid
