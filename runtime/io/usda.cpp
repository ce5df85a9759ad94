// .usda: USD's text format, with a Points prim "points" that has a sample of each attribute at the frame's time code,
// as usdview, Houdini and Blender read it. Value clips join the files of a sequence.
//
//   point3f[] points.timeSamples = { 12: [(x, y, z), ...], }
//
// P is points, v is velocities, accel (Houdini's name) is accelerations, id is ids, pscale is half of widths, N is
// normals, Cd is primvars:displayColor, Alpha is primvars:displayOpacity. Any other attribute is primvars:NAME, and a
// group is bool[] primvars:group_NAME. Floats have 9 significant digits, which identify the float.
//
// Files of other programs are read in metres with the y axis up, by their metersPerUnit and upAxis, and where the
// transforms of the prim and of those around it put it. Values of primvars go by their indices.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <list>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/ordered_chunks.h"
#include "runtime/io/records.h"
#include "runtime/math/normal_map.h"
#include "runtime/points/token.h"

namespace rapid {
namespace {

// Reads the arrays of a Points prim in USD's text format: its default values, or its only time sample.
//
// Nothing in a file is trusted. Errors have the line but not the file's name; the caller adds it.

struct UsdArray {
    std::string name;
    ScalarType type;           // in memory: UInt8 (bools), Int32, Int64 or Double; strings are UInt32 tokens
    std::size_t tuple;         // numbers per row
    bool quaternion;           // real part first
    std::int64_t least, most;  // range of integers
    std::vector<unsigned char> bytes;
    bool strings = false;
    enum Role { Number, Point, Vector, Normal } role = Number;  // how a transform changes it

    std::size_t rows() const { return bytes.size() / (tuple * scalar_bytes(type)); }
};

struct UsdPoints {
    std::vector<UsdArray> arrays;
    Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  // to metres, y up
};

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
        array.strings = true;
        return array;
    }
    if (type == "bool") return integers_of(ScalarType::UInt8, std::int32_t{});
    if (type == "uchar") return integers_of(ScalarType::Int32, std::uint8_t{});
    if (type == "uint") return integers_of(ScalarType::Int64, std::uint32_t{});
    if (type == "int64") return integers_of(ScalarType::Int64, std::int64_t{});
    if (type == "uint64") return integers_of(ScalarType::Int64, std::uint64_t{});
    UsdArray array = integers_of(ScalarType::Double, std::int32_t{});
    array.quaternion = type.starts_with("quat");
    array.role = type.starts_with("point")    ? UsdArray::Point
                 : type.starts_with("vector") ? UsdArray::Vector
                 : type.starts_with("normal") ? UsdArray::Normal
                                              : UsdArray::Number;
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

// Throws Error if the array is too large. A number takes at least two bytes of text, and more memory while its
// array grows and is converted to a column.
void check_array_memory(const UsdArray& array)
{
    if (const double bytes = 4.0 * static_cast<double>(array.bytes.size()); !fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("an array of at least {} rows", array.rows()), bytes, "write .bgeo instead");
}

// Returns the map of an operation such as xformOp:rotateXYZ:pivot.
Eigen::Affine3d operation(std::string_view name, const std::vector<double>& numbers)
{
    name.remove_prefix(std::string_view("xformOp:").size());
    name = name.substr(0, name.find(':'));
    const auto check = [&](std::size_t count) {
        if (numbers.size() != count)
            throw Error(fmt::format("xformOp:{} has {} numbers; there must be {}", name, numbers.size(), count));
    };
    Eigen::Affine3d map = Eigen::Affine3d::Identity();
    if (name == "transform") {
        check(16);
        map.matrix() = Eigen::Map<const Eigen::Matrix4d>(numbers.data());  // of row vectors, row by row
    } else if (name == "orient") {
        check(4);
        map = Eigen::Quaterniond(numbers[0], numbers[1], numbers[2], numbers[3]).normalized();
    } else if (name == "translate" || name == "scale") {
        check(3);
        const Vec3d vector(numbers[0], numbers[1], numbers[2]);
        if (name == "scale")
            map = Eigen::Scaling(vector);
        else
            map = Eigen::Translation3d(vector);
    } else if (constexpr std::string_view rotate = "rotate"; name.starts_with(rotate)) {
        const std::string_view axes = name.substr(rotate.size());  // X, or XYZ: about x first
        check(axes.size());
        for (std::size_t k = 0; k < axes.size(); ++k) {
            const int axis = axes[k] - 'X';
            if (axis < 0 || axis > 2) throw Error(fmt::format("xformOp:{} is unknown", name));
            const double angle = numbers[axes.size() == 1 ? 0 : static_cast<std::size_t>(axis)];
            map = Eigen::AngleAxisd(angle * std::numbers::pi / 180, Vec3d::Unit(axis)) * map;
        }
    } else {
        throw Error(fmt::format("xformOp:{} is unknown", name));
    }
    return map;
}

class UsdaReader {
public:
    explicit UsdaReader(std::string_view text) : text_(text) {}

    // Throws Error if the text is not USD, has no Points prim or several, or has several time samples.
    UsdPoints read()
    {
        if (!text_.starts_with("#usda")) throw Error("not a USD text file: it does not begin with \"#usda\"");
        read_layer_metadata();
        prims_.emplace_back();
        while (skip_space(), at_ < text_.size()) {
            if (is_at('}') && prims_.size() > 1) {
                close_prim();
            } else {
                read_statement();
            }
        }
        if (prims_.size() > 1)
            throw wrong(
                fmt::format("the file ends within {}", prims_.back().is_points ? "the prim of points" : "a prim"));
        if (!found_) throw Error("there is no prim of the type Points");
        Eigen::Affine3d to_world = to_metres_;
        for (std::size_t k = maps_.size(); k-- > 0;) to_world = to_world * maps_[k];
        return {{std::move_iterator(arrays_.begin()), std::move_iterator(arrays_.end())}, to_world};
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
    // Skips a string, a path of a file or prim, or one other character.
    void skip_mark()
    {
        const auto skip_to = [&](std::string_view end, std::size_t from) {
            const std::size_t found = text_.find(end, from);
            if (found == std::string_view::npos) throw wrong(fmt::format("no {} follows", end));
            at_ = found + end.size();
        };
        const char c = text_[at_];
        if (c == '"' || c == '\'') {
            const std::string three(3, c);
            if (text_.substr(at_, 3) == three) return skip_to(three, at_ + 3);
            for (++at_; at_ < text_.size() && text_[at_] != c; ++at_)
                if (text_[at_] == '\\') ++at_;
            if (at_ >= text_.size()) throw wrong("a string has no end");
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
        if (!is_at('"') && !is_at('\'')) throw wrong("a string is missing");
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
                throw wrong("a closing bracket has no opening one");
            skip_mark();
        } while (depth > 0);
    }

    // A prim whose body is being read.
    struct Prim {
        bool is_points = false, holds_points = false;
        std::map<std::string, std::vector<double>> operations = {};  // xformOp:..., as numbers
        std::vector<std::string> order = {};                         // xformOpOrder
        std::size_t order_at = 0;
    };

    // Reads metadata in brackets. read_value(name) returns false for values that it leaves to be skipped.
    template <class F>
    void read_metadata(const F& read_value)
    {
        ++at_;
        while (skip_space(), !is_at(')')) {
            if (at_ >= text_.size()) throw wrong("the file ends within its metadata");
            const std::string_view name = at_word() ? word() : std::string_view();
            if (name.empty()) {
                skip_value();
                continue;
            }
            if (skip_space(), !is_at('=')) continue;
            ++at_;
            skip_space();
            if (!read_value(name)) skip_value();
        }
        ++at_;
    }

    // Reads the unit and axis of the layer.
    void read_layer_metadata()
    {
        double metres = 0;
        bool z_up = false;
        const auto read_value = [&](std::string_view name) {
            if (name == "metersPerUnit") {
                const std::vector<double> numbers = numbers_of_value();
                metres = numbers.size() == 1 ? numbers[0] : 0;
                if (!(metres > 0 && std::isfinite(metres))) throw wrong("metersPerUnit must be a number above 0");
            } else if (name == "upAxis") {
                z_up = text_value() == "Z";
            } else {
                return false;
            }
            return true;
        };
        if (skip_space(), is_at('(')) read_metadata(read_value);
        if (metres == 0) {
            SkippedContents::note(
                "it does not state metersPerUnit, so its unit is taken for 1 m; give unit = 0.01 for centimetres");
            metres = 1;
        }
        to_metres_ = Eigen::Scaling(metres);
        // z becomes y, and y becomes -z.
        if (z_up) to_metres_ = to_metres_ * Eigen::AngleAxisd(-std::numbers::pi / 2, Vec3d::UnitX());
        if (z_up) to_metres_.linear() = (to_metres_.linear() / metres).array().round().matrix() * metres;
    }

    // Begins the body of a prim, after its specifier. A class is only there where others refer to it, and an inactive
    // prim is not there.
    void open_prim(std::string_view specifier)
    {
        skip_space();
        const bool is_points = at_word() && word() == "Points";
        skip_space();
        if (is_at('"') || is_at('\'')) skip_mark();
        bool active = true;
        const auto read_active = [&](std::string_view name) {
            if (name == "active") active = word() != "false";
            return name == "active";
        };
        if (skip_space(), is_at('(')) read_metadata(read_active);
        if (skip_space(), !is_at('{')) throw wrong("a prim has no { }");
        if (specifier == "class" || !active) return skip_value();
        ++at_;
        if (is_points && std::exchange(found_, true))
            throw wrong("there are several prims of the type Points; there must be one");
        prims_.push_back({.is_points = is_points, .holds_points = is_points});
    }

    // Ends the body of a prim. Its operations may follow its children and their own order.
    void close_prim()
    {
        const Prim prim = std::move(prims_.back());
        prims_.pop_back();
        prims_.back().holds_points |= prim.holds_points;
        for (std::size_t k = prim.order.size(); k-- > 0 && prim.holds_points && !is_reset_;) {
            std::string name = prim.order[k];
            constexpr std::string_view inverse = "!invert!";
            is_reset_ = name == "!resetXformStack!";
            if (is_reset_) break;
            const bool inverted = name.starts_with(inverse);
            if (inverted) name.erase(0, inverse.size());
            const auto found = prim.operations.find(name);
            if (found == prim.operations.end()) {
                at_ = prim.order_at;
                throw wrong(fmt::format("{} has no value", name));
            }
            const Eigen::Affine3d map = operation(name, found->second);
            maps_.push_back(inverted ? map.inverse() : map);
        }
        ++at_;
    }

    // Returns all numbers of a value, or of its only time sample, whatever its brackets.
    std::vector<double> numbers_of_value()
    {
        std::vector<double> numbers;
        std::size_t depth = 0;
        do {
            skip_space();
            if (at_ >= text_.size()) throw wrong("the file ends within a value");
            const char c = text_[at_];
            if (c == '(' || c == '[') ++depth;
            if ((c == ')' || c == ']') && depth-- == 0) throw wrong("a closing bracket has no opening one");
            if (std::string_view("()[],").find(c) != std::string_view::npos) {
                ++at_;
                continue;
            }
            double number = 0;
            const auto parsed = parse_number(text_.data() + at_, text_.data() + text_.size(), number);
            if (parsed.ec != std::errc()) throw wrong("a number is missing");
            at_ = static_cast<std::size_t>(parsed.ptr - text_.data());
            numbers.push_back(number);
        } while (depth > 0);
        return numbers;
    }

    // Reads an operation of a transform, or the order of them.
    void read_transform(std::string_view name)
    {
        if (name == "xformOpOrder") {
            std::vector<std::string>& names = prims_.back().order;
            prims_.back().order_at = at_;
            names.clear();
            expect('[');
            while (skip_space(), !is_at(']')) {
                names.push_back(text_value());
                if (skip_space(), !is_at(']')) expect(',');
            }
            ++at_;
            return;
        }
        const auto read_operation = [&] { prims_.back().operations[std::string(name)] = numbers_of_value(); };
        if (!name.ends_with(samples)) return read_operation();
        name.remove_suffix(samples.size());
        read_samples(name, read_operation);
    }

    // Reads the only time sample in { }. Returns false if there is none.
    template <class F>
    bool read_samples(std::string_view name, const F& read_sample)
    {
        if (!is_at('{')) throw wrong("time samples have no { }");
        ++at_;
        bool found = false;
        while (skip_space(), !is_at('}')) {
            if (!at_word()) throw wrong("a time sample has no time");
            word();  // time, followed by a colon
            if (skip_space(), is_at(':')) ++at_;
            skip_space();
            if (std::exchange(found, true))
                throw wrong(fmt::format(
                    "{} has several time samples; give a file with one frame (usdcat can extract one)", name));
            read_sample();
            if (skip_space(), is_at(',')) ++at_;
        }
        ++at_;
        return found;
    }

    // Reads [custom] TYPE NAME [= VALUE] [(METADATA)], or the beginning of a prim.
    void read_statement()
    {
        std::string_view type, name;
        bool line = false;
        while (!line && at_word()) {
            type = name;
            name = word();
            if (type.empty() && (name == "def" || name == "over" || name == "class")) return open_prim(name);
            line = skip_space();
        }
        if (!line && is_at('=')) {
            ++at_;
            skip_space();
            read_value(type, name);
            line = skip_space();
        } else if (name.empty() && !is_at('"') && !is_at('(') && !is_at('{') && !is_at(';')) {
            throw wrong("the property of a prim is missing");
        } else if (!line && at_ < text_.size() && !is_at('}')) {
            skip_value();
            line = false;
        }
        if (!line && (is_at('(') || is_at('{'))) skip_value();
    }

    void read_value(std::string_view type, std::string_view name)
    {
        if (name == "xformOpOrder" || name.starts_with("xformOp:")) return read_transform(name);
        if (!prims_.back().is_points) return skip_value();
        std::optional<UsdArray> array = array_of(type);
        // Strings other than primvars describe how the prim is placed and drawn.
        if (!array || (array->strings && !name.starts_with("primvars:"))) {
            if (type.ends_with("[]")) SkippedContents::add(fmt::format("{} of the type {}", name, type));
            return skip_value();
        }
        if (!names_.insert(name).second) throw wrong(fmt::format("{} appears twice", name));
        if (!name.ends_with(samples)) {
            if (!is_at('[')) return skip_value();  // None
            array->name = std::string(name);
            read_numbers(*array);
            if (!by_name_.contains(name)) by_name_.emplace(name, arrays_.insert(arrays_.end(), std::move(*array)));
            return;
        }
        name.remove_suffix(samples.size());
        const bool found = read_samples(name, [&] { is_at('[') ? read_numbers(*array) : skip_value(); });
        array->name = std::string(name);
        if (const auto before = by_name_.find(name); before != by_name_.end()) {
            arrays_.erase(before->second);
            by_name_.erase(before);
        }
        if (found) by_name_.emplace(name, arrays_.insert(arrays_.end(), std::move(*array)));
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
        if (!is_at(c)) throw wrong(fmt::format("'{}' is missing", c));
        ++at_;
    }

    void read_number(UsdArray& array)
    {
        const char *from = text_.data() + at_, *end = text_.data() + text_.size();
        const auto put = [&](auto number) {
            if (array.bytes.size() == array.bytes.capacity()) check_array_memory(array);
            const auto* bytes = reinterpret_cast<const unsigned char*>(&number);
            array.bytes.insert(array.bytes.end(), bytes, bytes + sizeof number);
        };
        const auto parse = [&](auto number) {
            const auto parsed = parse_number(from, end, number);
            bool fits = parsed.ec == std::errc();
            if constexpr (std::is_integral_v<decltype(number)>) fits &= number >= array.least && number <= array.most;
            if (!fits) throw wrong("a number of its type is missing");
            at_ = static_cast<std::size_t>(parsed.ptr - text_.data());
            return number;
        };
        if (array.strings) return put(token_of(text_value()).number);
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
    static constexpr std::string_view samples = ".timeSamples";

    Eigen::Affine3d to_metres_ = Eigen::Affine3d::Identity();
    std::vector<Eigen::Affine3d> maps_;  // of the prim of points and those around it, the outermost last
    bool is_reset_ = false;              // by one of the prims, so that those around it do not count
    std::vector<Prim> prims_;            // the open ones, the innermost last
    bool found_ = false;
    std::list<UsdArray> arrays_;
    std::map<std::string_view, std::list<UsdArray>::iterator> by_name_;
    std::set<std::string_view> names_;  // of all arrays so far, with and without time samples
};

constexpr std::string_view primvar = "primvars:";

struct UsdName {
    std::string_view ours, theirs, type;
};
constexpr UsdName usd_names[] = {{"P", "points", "point3f"},
                                 {"v", "velocities", "vector3f"},
                                 {"accel", "accelerations", "vector3f"},
                                 {"id", "ids", "int64"},
                                 {"pscale", "widths", "float"},
                                 {"N", "normals", "normal3f"},
                                 {"Cd", "primvars:displayColor", "color3f"},
                                 {"Alpha", "primvars:displayOpacity", "float"}};

std::string_view usd_type(AttributeType type)
{
    static constexpr std::string_view names[] = {"float", "float3", "int", "int64", "quatf", "string"};
    static_assert(std::size(names) == std::variant_size_v<AnyColumn>);
    return names[static_cast<std::size_t>(type)];
}

// Returns USD's name and type of an attribute. If its type differs from that of USD's attribute of this name, it is a
// primvar.
UsdName usd_name(const std::string& name, AttributeType type, std::string& storage)
{
    const bool vec3 = type == AttributeType::Vec3;
    for (const UsdName& known : usd_names) {
        if (known.ours != name) continue;
        if (known.type == usd_type(type) || (vec3 && known.type.ends_with("3f"))) return known;
    }
    storage = std::string(primvar) + name;
    return {name, storage, usd_type(type)};
}

// Throws Error if the name is not a USD identifier.
void check_identifier(std::string_view name)
{
    const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const bool good = !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), [&](char c) {
        return is_letter(c) || (c >= '0' && c <= '9');
    });
    if (!good)
        throw Error(
            fmt::format("the name \"{}\" can't be written to .usda; it must consist of letters, digits and _, and must "
                        "not begin with a digit; rename the attribute or group",
                        name));
}

void put(std::string& text, float value)
{
    char number[24];
    if (std::isnan(value))
        text += "nan";
    else
        text.append(number, std::to_chars(number, std::end(number), value, std::chars_format::general, 9).ptr);
}
template <std::signed_integral Integer>
void put(std::string& text, Integer value)
{
    char number[24];
    text.append(number, std::to_chars(number, std::end(number), value).ptr);
}
void put(std::string& text, std::uint8_t value) { text += value ? '1' : '0'; }
void put_tuple(std::string& text, std::initializer_list<float> numbers)
{
    const char* before = "(";
    for (const float number : numbers) {
        text += std::exchange(before, ", ");
        put(text, number);
    }
    text += ')';
}
void put(std::string& text, const Vec3f& value) { put_tuple(text, {value.x(), value.y(), value.z()}); }
// Writes the real part first.
void put(std::string& text, const Quatf& value) { put_tuple(text, {value.w(), value.x(), value.y(), value.z()}); }

void put(std::string& text, Token value)
{
    text += '"';
    for (const char c : value.text()) {
        if (c == '"' || c == '\\')
            text += {'\\', c};
        else if (c == '\n')
            text += "\\n";
        else if (static_cast<unsigned char>(c) < ' ')
            text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        else
            text += c;
    }
    text += '"';
}

class UsdaWriter {
public:
    UsdaWriter(OutputFile& file, const PointSet& points, const FrameInfo& frame)
        : file_(file), points_(points), frame_(frame)
    {
    }

    void write()
    {
        check_names();
        append(
            fmt::format("#usda 1.0\n(\n    defaultPrim = \"points\"\n    doc = \"Rapid points\"\n"
                        "    endTimeCode = {0}\n    framesPerSecond = {1}\n    metersPerUnit = 1\n"
                        "    startTimeCode = {0}\n    timeCodesPerSecond = {1}\n    upAxis = \"Y\"\n)\n\n"
                        "def Points \"points\"\n{{\n",
                        frame_.number, frame_.fps));
        write_extent();
        std::vector<std::string> attributes = further_attributes(points_);
        attributes.insert(attributes.begin(), {"P", "v", "id"});
        for (const std::string& name : attributes)
            std::visit([&](const auto& column) { write_attribute(name, column); }, *points_.find(name));
        for (const auto& [name, members] : points_.groups())
            write_array("bool", std::string(primvar) + std::string(group_prefix) + name, members,
                        [](std::uint8_t member) { return member; });
        append("}\n");
    }

private:
    void append(const std::string& text) { file_.append(text.data(), text.size()); }

    void check_names() const
    {
        std::vector<std::string> names;
        std::string storage;
        for (const auto& [name, column] : points_.columns()) {
            check_identifier(name);
            names.emplace_back(usd_name(name, type_of(column), storage).theirs);
        }
        for (const std::string& name : points_.group_names()) {
            check_identifier(name);
            names.push_back(std::string(primvar) + std::string(group_prefix) + name);
        }
        check_column_names(names, "");
    }

    // Writes the bounding box, which viewers use for framing and culling.
    void write_extent()
    {
        if (points_.empty()) return;
        const Column<float>* radii = points_.find<float>("pscale");
        Box3f box;
        for (std::size_t i = 0; i < points_.size(); ++i) {
            const Vec3f radius = Vec3f::Constant(radii ? (*radii)[i] : 0);
            box.extend(Vec3f(points_.P()[i] - radius));
            box.extend(Vec3f(points_.P()[i] + radius));
        }
        std::string corners;
        put(corners, Vec3f(box.min()));
        corners += ", ";
        put(corners, Vec3f(box.max()));
        append(
            fmt::format("    float3[] extent.timeSamples = {{\n        {}: [{}],\n    }}\n", frame_.number, corners));
    }

    template <class T>
    void write_attribute(const std::string& name, const Column<T>& column)
    {
        std::string storage;
        const UsdName known = usd_name(name, type_of(AnyColumn(column)), storage);
        if constexpr (std::is_same_v<T, float>)  // USD's widths are diameters
            if (known.theirs == "widths") return write_array("float", "widths", column, [](float r) { return 2 * r; });
        write_array(known.type, known.theirs, column, [](const T& value) { return value; });
    }

    template <class T, class F>
    void write_array(std::string_view type, std::string_view name, const Column<T>& column, const F& stored)
    {
        // A primvar is constant unless it states otherwise. Uniform values are written for each point too, because
        // joined frames must have the same interpolation.
        if (name.starts_with(primvar))
            append(fmt::format("    {}[] {} (\n        interpolation = \"vertex\"\n    )\n", type, name));
        append(fmt::format("    {}[] {}.timeSamples = {{\n        {}: [", type, name, frame_.number));
        append_chunks(file_, points_.size(), [&](std::size_t begin, std::size_t end) {
            std::string text;
            for (std::size_t i = begin; i < end; ++i) {
                if (i > 0) text += ", ";
                put(text, stored(column[i]));
            }
            return text;
        });
        append("],\n    }\n");
    }

    OutputFile& file_;
    const PointSet& points_;
    const FrameInfo& frame_;
};

void write_usda(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    UsdaWriter(file, points, frame).write();
}

std::string attribute_of_property(std::string_view name)
{
    for (const UsdName& known : usd_names)
        if (name == known.theirs) return std::string(known.ours);
    return std::string(name.starts_with(primvar) ? name.substr(primvar.size()) : name);
}

// Returns one string for all points, or one per point.
Column<Token> strings_of(const UsdArray& array, std::size_t size)
{
    std::vector<Token> strings(array.rows());
    if (!strings.empty()) std::memcpy(static_cast<void*>(strings.data()), array.bytes.data(), array.bytes.size());
    if (strings.size() != size) return Column<Token>(size, strings[0], Token());
    return Column<Token>(std::span<const Token>(strings));
}

// Replaces values by those that their indices select, and removes the indices.
void expand_indices(std::vector<UsdArray>& arrays)
{
    constexpr std::string_view suffix = ":indices";
    std::map<std::string, const UsdArray*> indices;
    for (const UsdArray& array : arrays)
        if (array.name.ends_with(suffix) && array.type == ScalarType::Int32)
            indices[array.name.substr(0, array.name.size() - suffix.size())] = &array;
    std::set<std::string> used;
    for (UsdArray& array : arrays) {
        const auto found = indices.find(array.name);
        if (found == indices.end()) continue;
        const std::size_t row = array.tuple * scalar_bytes(array.type), rows = array.rows();
        std::vector<unsigned char> expanded;
        for (std::size_t i = 0; i < found->second->rows(); ++i) {
            const auto index = load_scalar<std::int32_t>(found->second->bytes.data() + 4 * i, ByteOrder::Little);
            if (index < 0 || static_cast<std::size_t>(index) >= rows)
                throw Error(fmt::format("{} has the index {}; there are {} values, from 0", array.name, index, rows));
            const auto from = array.bytes.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(index) * row);
            expanded.insert(expanded.end(), from, from + static_cast<std::ptrdiff_t>(row));
        }
        used.insert(found->second->name);
        array.bytes = std::move(expanded);
    }
    std::erase_if(arrays, [&](const UsdArray& array) { return used.count(array.name) > 0; });
}

// Moves the points to the world, with their velocities, normals, turns and radii.
void place(PointSet& points, const std::vector<UsdArray>& arrays, const Eigen::Affine3d& to_world)
{
    if (to_world.matrix().isIdentity(0)) return;
    const Eigen::Matrix3d linear = to_world.linear(), of_normals = normal_map(linear);
    const double scale = std::cbrt(std::abs(linear.determinant()));
    const auto turn = Eigen::Quaterniond(to_world.rotation()).cast<float>();
    for (const UsdArray& array : arrays) {
        const std::string name = attribute_of_property(array.name);
        if (auto* vectors = points.find<Vec3f>(name); vectors && array.role != UsdArray::Number) {
            for (Vec3f& value : vectors->write()) {
                const Vec3d before = value.cast<double>();
                const Vec3d after = array.role == UsdArray::Point    ? (to_world * before).eval()
                                    : array.role == UsdArray::Vector ? (linear * before).eval()
                                                                     : (of_normals * before).stableNormalized();
                value = after.cast<float>();
            }
        } else if (auto* radii = points.find<float>(name); radii && name == "pscale") {
            for (float& radius : radii->write()) radius = static_cast<float>(radius * scale);
        } else if (auto* turns = points.find<Quatf>(name)) {
            for (Quatf& value : turns->write()) value = turn * value;
        }
    }
}

PointSet read_usda(const std::filesystem::path& path)
{
    const InputFile file(path);
    UsdPoints prim = UsdaReader(file.text()).read();
    std::vector<UsdArray>& arrays = prim.arrays;
    expand_indices(arrays);
    const auto of_points =
        std::find_if(arrays.begin(), arrays.end(), [](const UsdArray& a) { return a.name == "points"; });
    if (of_points == arrays.end() || of_points->tuple != 3)
        throw Error("the prim of points has no positions of three numbers");

    PointSet points;
    points.append(of_points->rows());
    bool has_id = false;
    std::vector<std::string> names;
    for (const UsdArray& array : arrays) {
        const bool constant = array.rows() == 1;
        if (array.name == "extent") continue;  // not a value per point
        if (array.rows() != points.size() && !constant) {
            SkippedContents::add(
                fmt::format("{} of {} values, but there are {} points", array.name, array.rows(), points.size()));
            continue;
        }
        if (array.strings) {
            points.set(attribute_of_property(array.name), strings_of(array, points.size()));
            names.push_back(array.name);
            continue;
        }
        RecordAttribute attribute;
        attribute.name = attribute_of_property(array.name);
        attribute.type = array.type;
        attribute.group =
            array.type == ScalarType::UInt8 && array.tuple == 1 && attribute.name.starts_with(group_prefix);
        if (attribute.group) attribute.name.erase(0, group_prefix.size());
        if (array.name == "widths") attribute.scale = 0.5;
        const std::size_t number = scalar_bytes(attribute.type);
        for (std::size_t c = 0; c < array.tuple; ++c) attribute.offsets.push_back(c * number);
        // Rapid's quaternions have the real part last.
        if (array.quaternion)
            std::rotate(attribute.offsets.begin(), attribute.offsets.begin() + 1, attribute.offsets.end());
        const std::size_t stride = constant ? 0 : array.tuple * number;
        read_attribute(points, {array.bytes, points.size(), stride, ByteOrder::Little}, attribute);
        has_id |= attribute.name == "id" && array.tuple == 1 && !attribute.group;
        names.push_back(array.name);
    }
    check_column_names(names, "");
    if (!has_id) number_points(points);
    place(points, arrays, prim.to_world);
    return points;
}

RAPID_FORMAT(Format{".usda", "USD text, points at the frame's time code; all types", write_usda, read_usda});

}  // namespace
}  // namespace rapid
