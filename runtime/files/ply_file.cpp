#include "runtime/files/ply_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>

#include "runtime/base/error.h"

namespace rapid {
namespace {

constexpr std::string_view white_space = " \t\r\n";

std::vector<std::string> split(std::string_view line)
{
    std::vector<std::string> words;
    std::size_t begin = 0;
    while ((begin = line.find_first_not_of(white_space, begin)) != std::string_view::npos) {
        const std::size_t end = std::min(line.find_first_of(white_space, begin), line.size());
        words.emplace_back(line.substr(begin, end - begin));
        begin = end;
    }
    return words;
}

ScalarType scalar_type(const std::string& name)
{
    static const std::map<std::string, ScalarType> types = {
        {"char", ScalarType::Int8},     {"int8", ScalarType::Int8},     {"uchar", ScalarType::UInt8},
        {"uint8", ScalarType::UInt8},   {"short", ScalarType::Int16},   {"int16", ScalarType::Int16},
        {"ushort", ScalarType::UInt16}, {"uint16", ScalarType::UInt16}, {"int", ScalarType::Int32},
        {"int32", ScalarType::Int32},   {"uint", ScalarType::UInt32},   {"uint32", ScalarType::UInt32},
        {"float", ScalarType::Float},   {"float32", ScalarType::Float}, {"double", ScalarType::Double},
        {"float64", ScalarType::Double}};
    const auto found = types.find(name);
    if (found == types.end()) throw Error(fmt::format("not a valid PLY file: unknown type \"{}\"", name));
    return found->second;
}

// Returns true if a number from an ascii file is representable in the type.
bool is_of(ScalarType type, double number)
{
    if (is_floating(type)) return true;
    return with_scalar(type, [&](auto like) {
        using Limits = std::numeric_limits<decltype(like)>;
        return number >= static_cast<double>(Limits::min()) && number <= static_cast<double>(Limits::max()) &&
               number == std::floor(number);
    });
}

}  // namespace

bool PlyElement::has_lists() const
{
    return std::any_of(properties.begin(), properties.end(), [](const PlyProperty& p) { return p.list; });
}

std::size_t PlyElement::stride() const
{
    std::size_t bytes = 0;
    for (const PlyProperty& property : properties)
        bytes += scalar_bytes(property.list ? property.count_type : property.type);
    return bytes;
}

PlyFile::PlyFile(std::string_view text) : text_(text) { read_header(); }

PlyElement PlyElement::without_lists() const
{
    PlyElement scalars{name, count, {}};
    for (const PlyProperty& property : properties)
        if (!property.list) scalars.properties.push_back(property);
    return scalars;
}

double colour_scale(ScalarType type)
{
    if (is_floating(type)) return 1;
    return 1.0 / (type == ScalarType::UInt16 ? 65535 : 255);
}

// Throws Error if the header ends before a line does.
std::string_view PlyFile::take_line(std::string_view line_end)
{
    const std::size_t end = text_.find(line_end, at_);
    if (end == std::string_view::npos) throw Error("not a valid PLY file: its header has no \"end_header\"");
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = end + line_end.size();
    return line;
}

void PlyFile::read_header()
{
    if (!text_.starts_with("ply")) throw Error("not a PLY file: it does not begin with \"ply\"");
    // The first line shows how lines end. The data may begin with any byte, such as one that looks like a newline.
    const std::size_t first_end = std::min(text_.find_first_of("\r\n"), text_.size());
    const std::string_view line_end =
        text_.substr(first_end, 1) == "\r" && text_.substr(first_end, 2) != "\r\n" ? "\r" : "\n";
    bool formatted = false;
    for (int line = 1;; ++line) {
        const std::vector<std::string> words = split(take_line(line_end));
        if (words.empty() || words[0] == "ply" || words[0] == "comment" || words[0] == "obj_info") continue;
        if (words[0] == "end_header") break;
        formatted |= words[0] == "format";
        try {
            read_line(words);
        } catch (const std::invalid_argument&) {
            throw Error(fmt::format("not a valid PLY file: line {} of its header can't be understood", line));
        }
    }
    if (!formatted) throw Error("not a valid PLY file: its header has no \"format\"");
}

// Throws std::invalid_argument if the line is not valid in a header.
void PlyFile::read_line(const std::vector<std::string>& words)
{
    if (words[0] == "format" && words.size() >= 2) {
        static const std::map<std::string, Encoding> encodings = {{"ascii", Encoding::Ascii},
                                                                  {"binary_little_endian", Encoding::Little},
                                                                  {"binary_big_endian", Encoding::Big}};
        const auto found = encodings.find(words[1]);
        if (found == encodings.end()) throw std::invalid_argument("format");
        encoding_ = found->second;
    } else if (words[0] == "element" && words.size() == 3) {
        PlyElement& element = elements_.emplace_back();
        element.name = words[1];
        const char* const end = words[2].data() + words[2].size();
        const auto parsed = std::from_chars(words[2].data(), end, element.count);
        if (parsed.ec != std::errc() || parsed.ptr != end) throw std::invalid_argument("element");
    } else if (words[0] == "property" && words.size() == 3 && !elements_.empty()) {
        elements_.back().properties.push_back({words[2], scalar_type(words[1])});
    } else if (words[0] == "property" && words.size() == 5 && words[1] == "list" && !elements_.empty()) {
        elements_.back().properties.push_back({words[4], scalar_type(words[3]), true, scalar_type(words[2])});
    } else {
        throw std::invalid_argument(words[0]);
    }
}

// Checks that the file is long enough for the rows of an element, as far as that is known before its lists are read.
void PlyFile::check_promise(const PlyElement& element) const
{
    if (element.properties.empty()) return;
    // In an ascii file a number takes at least a digit and a separator, which the last one may lack.
    const bool ascii = encoding_ == Encoding::Ascii;
    const std::size_t row = ascii ? 2 * element.properties.size() : element.stride();
    const std::size_t held = (text_.size() - at_ + ascii) / row;
    if (element.count > held)
        throw Error(
            fmt::format("the file ends early: its header announces {} of the element \"{}\", but it contains {}{}",
                        element.count, element.name, element.has_lists() ? "at most " : "", held));
}

double PlyFile::parse_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type)
{
    const auto wrong = [&](const std::string& what) {
        return Error(fmt::format("{} {} of {}: {}", element.name, row, element.count, what));
    };
    at_ = std::min(text_.find_first_not_of(white_space, at_), text_.size());
    const char* const from = text_.data() + at_;
    const char* const end = text_.data() + text_.size();
    double number = 0;
    const auto parsed = rapid::parse_number(from, end, number);
    if (parsed.ec != std::errc())
        throw wrong(fmt::format("{} is missing; the file ends early or is damaged", property.name));
    ends_within_number_ = parsed.ptr == end;
    const std::string_view word(from, static_cast<std::size_t>(parsed.ptr - from));
    if ((parsed.ptr != end && white_space.find(*parsed.ptr) == std::string_view::npos) || !is_of(type, number))
        throw wrong(fmt::format("{} = {} is not a number of its type", property.name,
                                text_.substr(at_, std::max<std::size_t>(word.size(), 1))));
    at_ += word.size();
    return number;
}

double PlyFile::take_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type)
{
    if (encoding_ == Encoding::Ascii) return parse_number(element, row, property, type);
    if (scalar_bytes(type) > text_.size() - at_)
        throw Error(fmt::format("the file ends within {} {} of {}", element.name, row, element.count));
    const auto* from = reinterpret_cast<const unsigned char*>(text_.data() + at_);
    at_ += scalar_bytes(type);
    return with_scalar(type,
                       [&](auto like) { return static_cast<double>(load_scalar<decltype(like)>(from, order())); });
}

PlyRecords PlyFile::read_records(const PlyElement& element)
{
    check_promise(element);
    PlyRecords records{{}, element.without_lists().stride(), order(), {}};
    if (encoding_ != Encoding::Ascii && !element.has_lists()) {
        records.bytes = {reinterpret_cast<const unsigned char*>(text_.data() + at_), element.count * records.stride};
        at_ += records.bytes.size();
        return records;
    }
    records.order = ByteOrder::Little;
    records.parsed.resize(element.count * records.stride);
    unsigned char* to = records.parsed.data();
    for (std::size_t row = 0; row < element.count; ++row)
        for (const PlyProperty& property : element.properties) {
            if (property.list) {
                skip_list(element, row, property, take_count(element, row, property));
                continue;
            }
            with_scalar(property.type, [&](auto like) {
                const auto number = static_cast<decltype(like)>(take_number(element, row, property, property.type));
                std::memcpy(to, &number, sizeof number);
                to += sizeof number;
            });
        }
    records.bytes = records.parsed;
    return records;
}

// Reads the length of a list. Throws Error if the file can't hold as many numbers.
std::size_t PlyFile::take_count(const PlyElement& element, std::size_t row, const PlyProperty& list)
{
    const double count = take_number(element, row, list, list.count_type);
    const bool ascii = encoding_ == Encoding::Ascii;
    const std::size_t least = ascii ? 2 : scalar_bytes(list.type);
    if (!(count >= 0 && count <= static_cast<double>((text_.size() - at_ + ascii) / least)))
        throw Error(fmt::format("{} {} of {}: a list of {} numbers is longer than the file", element.name, row,
                                element.count, count));
    return static_cast<std::size_t>(count);
}

void PlyFile::skip_list(const PlyElement& element, std::size_t row, const PlyProperty& list, std::size_t count)
{
    if (encoding_ != Encoding::Ascii)
        at_ += count * scalar_bytes(list.type);
    else
        for (; count > 0; --count) parse_number(element, row, list, list.type);
}

void PlyFile::read_lists(const PlyElement& element, std::size_t selected,
                         const std::function<void(std::span<const std::int64_t> list)>& row)
{
    check_promise(element);
    if (selected < element.properties.size() && is_floating(element.properties[selected].type))
        throw Error(fmt::format("{} of {} has floating-point numbers; it must have integers",
                                element.properties[selected].name, element.name));
    std::vector<std::int64_t> list;
    if (element.properties.empty()) return;
    numbers_.assign(element.properties.size(), 0);
    for (std::size_t i = 0; i < element.count; ++i) {
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            const PlyProperty& property = element.properties[p];
            if (!property.list) {
                numbers_[p] = take_number(element, i, property, property.type);
                continue;
            }
            const std::size_t count = take_count(element, i, property);
            if (p != selected) {
                skip_list(element, i, property, count);
                continue;
            }
            list.clear();
            for (std::size_t k = 0; k < count; ++k)
                list.push_back(static_cast<std::int64_t>(take_number(element, i, property, property.type)));
        }
        if (selected < element.properties.size()) row(list);
    }
}

void PlyFile::pass_over(const PlyElement& element)
{
    if (encoding_ != Encoding::Ascii && !element.has_lists())
        read_records(element);
    else
        read_lists(element, element.properties.size(), {});
}

}  // namespace rapid
