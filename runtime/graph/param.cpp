#include "runtime/graph/param.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "runtime/points/attribute_like.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

// Returns "a number", "an integer"; plurals ("points") have no article.
std::string with_article(std::string_view type)
{
    for (const std::string_view plain : {"points", "attributes", "numbers by frame", "names"})
        if (type == plain) return std::string(type);
    const bool vowel = std::string_view("aeiou").find(type.front()) != std::string_view::npos;
    return fmt::format("{} {}", vowel ? "an" : "a", type);
}

std::string right_type(const Param& param)
{
    std::string words = with_article(param.type);
    if (param.type == "vec3") words += " or {x, y, z}";
    if (param.type == "motion")
        words +=
            " (rapid.translate, rapid.rotate, rapid.scale, or a product), a function of the frame that returns one, "
            "or keys {[1] = ..., [24] = ...}";
    if (param.per_point) words += ", or rapid.attr \"name\"";
    return words;
}

double checked(const Param& param, double value)
{
    if (!param.range.accepts(value)) out_of_range(param, value);
    return value;
}

float to_float(const Param& param, double value)
{
    const float narrow = static_cast<float>(value);
    if (std::isfinite(value) && !std::isfinite(narrow)) out_of_range(param, value);
    return narrow;
}

double whole(const Param& param, double value, double lo, double hi)
{
    checked(param, value);
    if (value != std::floor(value))
        throw Error(fmt::format("{} = {} is not whole; it must be an integer", param.name, value));
    if (value < lo || value > hi)
        throw Error(fmt::format("{} = {} is out of range; it must be from {} to {}", param.name, value, lo, hi));
    return value;
}

template <class Int>
Int to_int(const Param& param, double value)
{
    return static_cast<Int>(whole(param, value, static_cast<double>(std::numeric_limits<Int>::min()),
                                  static_cast<double>(std::numeric_limits<Int>::max())));
}

// Returns the N numbers of a list; nothing for any other value.
template <std::size_t N>
std::optional<std::array<double, N>> numbers(const Value& value)
{
    const Table* table = value.table();
    if (!table || table->list.size() != N || !table->numbered.empty() || !table->named.empty()) return std::nullopt;
    std::array<double, N> result;
    for (std::size_t i = 0; i < N; ++i) {
        const double* number = table->list[i].get<double>();
        if (!number) return std::nullopt;
        result[i] = *number;
    }
    return result;
}

std::optional<Vec3d> to_vec3(const Value& value)
{
    if (const Vec3d* vector = value.get<Vec3d>()) return *vector;
    if (const auto list = numbers<3>(value)) return Vec3d((*list)[0], (*list)[1], (*list)[2]);
    return std::nullopt;
}

Vec3f to_vec3f(const Param& param, const Vec3d& value)
{
    return {to_float(param, value[0]), to_float(param, value[1]), to_float(param, value[2])};
}

template <class Map>
const Table& names_only(const Param& param, const Value& value, Map& field)
{
    field.clear();
    static const Table none;
    if (value.is_nil()) return none;
    const Table* table = value.table();
    if (!table || !table->list.empty() || !table->numbered.empty()) wrong_type(param, value);
    return *table;
}

// Throws Error if every point has the name, if it is that of groups, or if files and scripts cannot spell it.
void check_attribute_name(std::string_view name)
{
    if (name == "group" || find_point_name(name))
        throw Error(
            fmt::format("\"{}\" can't be an attribute, because Rapid uses this name; choose another one", name));
    const auto letter = [](unsigned char c) { return std::isalpha(c) || c == '_'; };
    const auto part = [&](unsigned char c) { return letter(c) || std::isdigit(c); };
    if (name.empty() || !letter(name.front()) || !std::all_of(name.begin(), name.end(), part))
        throw Error(fmt::format(
            "attribute name \"{}\" can't be used; use letters, digits and _, and no digit at the beginning", name));
}

}  // namespace

void wrong_type(const Param& param, const Value& value)
{
    if (value.is_nil()) throw Error(fmt::format("{} is nil; it must be {}", param.name, right_type(param)));
    std::string right = right_type(param);
    // Keys such as {[1] = 0, [24] = 100}.
    const Table* keys = value.table();
    const bool has_keys = keys && keys->named.empty() && (keys->list.size() == 1 || !keys->numbered.empty());
    if (has_keys && param.of_the_frame && (param.type.starts_with("number") || param.type.starts_with("integer")))
        right += ", or a function of the frame: function(frame) return ... end";
    throw Error(fmt::format("{} = {} has the wrong type; it must be {}", param.name, describe(value), right));
}

void out_of_range(const Param& param, double value)
{
    std::string right = param.range.right();
    if (std::isfinite(value) && param.range.contains(value))  // too large for float
        right = fmt::format("within ±{:.3g}", std::numeric_limits<float>::max());
    throw Error(fmt::format("{} = {} is out of range; it must be {}", param.name, value, right));
}

void read_value(const Param& param, const Value& value, double& field)
{
    const double* number = value.get<double>();
    if (!number) wrong_type(param, value);
    field = checked(param, *number);
}

void read_value(const Param& param, const Value& value, float& field)
{
    double wide = 0;
    read_value(param, value, wide);
    field = to_float(param, wide);
}

void read_value(const Param& param, const Value& value, int& field)
{
    const double* number = value.get<double>();
    if (!number) wrong_type(param, value);
    field = to_int<int>(param, *number);
}

void read_value(const Param& param, const Value& value, bool& field)
{
    const bool* truth = value.get<bool>();
    if (!truth) wrong_type(param, value);
    field = *truth;
}

void read_value(const Param& param, const Value& value, std::string& field)
{
    if (value.is_nil()) return field.clear();
    const std::string* text = value.get<std::string>();
    if (!text) wrong_type(param, value);
    if (!param.choices.empty() && std::find(param.choices.begin(), param.choices.end(), *text) == param.choices.end()) {
        const std::string nearest = did_you_mean(*text, param.choices);
        throw Error(fmt::format(
            "{} = \"{}\" is unknown{}", param.name, *text,
            nearest.empty() ? fmt::format("; it must be one of {}", fmt::join(param.choices, ", ")) : nearest));
    }
    field = *text;
}

void read_value(const Param& param, const Value& value, Vec3d& field)
{
    const std::optional<Vec3d> vector = to_vec3(value);
    if (!vector) wrong_type(param, value);
    for (int axis = 0; axis < 3; ++axis) checked(param, (*vector)[axis]);
    field = *vector;
}

void read_value(const Param& param, const Value& value, Vec3f& field)
{
    Vec3d wide;
    read_value(param, value, wide);
    field = to_vec3f(param, wide);
}

void read_value(const Param& param, const Value& value, PerPoint<float>& field)
{
    if (const AttributeRef* attribute = value.get<AttributeRef>()) {
        field = PerPoint<float>::of(attribute->name);
        return;
    }
    float constant = 0;
    read_value(param, value, constant);
    field = PerPoint<float>(constant);
}

void read_value(const Param& param, const Value& value, PerPoint<Vec3f>& field)
{
    if (const AttributeRef* attribute = value.get<AttributeRef>()) {
        field = PerPoint<Vec3f>::of(attribute->name);
        return;
    }
    Vec3f constant;
    read_value(param, value, constant);
    field = PerPoint<Vec3f>(constant);
}

void read_value(const Param& param, const Value& value, ObjectPtr& field)
{
    if (value.is_nil()) return field.reset();
    const ObjectPtr* object = value.get<ObjectPtr>();
    if (!object) wrong_type(param, value);
    field = *object;
}

void read_value(const Param& param, const Value& value, AttributeValue& field)
{
    check_attribute_name(param.name);
    const AttributeSpec* known = known_attribute(param.name);
    if (!known) known = conventional_attribute(param.name);

    // Lua has one number type: an unknown name becomes a float, so that 1 and 1.5 give the same column.
    const bool is_scalar =
        !known || (!std::holds_alternative<Vec3f>(known->fallback) && !std::holds_alternative<Quatf>(known->fallback) &&
                   !std::holds_alternative<Token>(known->fallback));
    if (const double* number = value.get<double>(); number && is_scalar) {
        if (known && std::holds_alternative<std::int64_t>(known->fallback)) {
            field = static_cast<std::int64_t>(whole(param, *number, -0x1p53, 0x1p53));
            return;
        }
        if (known && std::holds_alternative<std::int32_t>(known->fallback)) {
            field = to_int<std::int32_t>(param, *number);
            return;
        }
        Param ranged = param;
        ranged.range = range_of_attribute(param.name);
        field = to_float(ranged, checked(ranged, *number));
        return;
    }
    if (!known || std::holds_alternative<Vec3f>(known->fallback)) {
        if (const std::optional<Vec3d> vector = to_vec3(value)) {
            for (int axis = 0; axis < 3; ++axis) checked(param, (*vector)[axis]);
            field = to_vec3f(param, *vector);
            return;
        }
    }
    if (const auto xyzw = numbers<4>(value); xyzw && (!known || std::holds_alternative<Quatf>(known->fallback))) {
        for (const double component : *xyzw) checked(param, component);
        const auto at = [&](int i) { return to_float(param, (*xyzw)[i]); };
        field = Quatf(at(3), at(0), at(1), at(2));  // Eigen's arguments begin with w
        return;
    }

    const bool is_text = !known || std::holds_alternative<Token>(known->fallback);
    if (const std::string* text = value.get<std::string>(); text && is_text) {
        try {
            field = token_of(*text);
        } catch (const Error& error) {
            throw Error(fmt::format("{}: {}", param.name, error.what()), error.kind());
        }
        return;
    }

    const std::string right = !known ? "a number, a vec3 or {x, y, z}, a quaternion {x, y, z, w} or a string"
                              : std::holds_alternative<Vec3f>(known->fallback) ? "a vec3 or {x, y, z}"
                              : std::holds_alternative<Quatf>(known->fallback) ? "a quaternion {x, y, z, w}"
                              : std::holds_alternative<Token>(known->fallback) ? "a string in quotes"
                                                                               : "a number";
    throw Error(fmt::format("{} = {} has the wrong type; it must be {}", param.name, describe(value), right));
}

void read_value(const Param& param, const Value& value, std::map<std::string, AttributeValue>& field)
{
    for (const auto& [name, given] : names_only(param, value, field).named) {
        Param one = param;
        one.name = name;
        read_value(one, given, field[name]);
    }
}

void read_value(const Param& param, const Value& value, std::map<std::int64_t, double>& field)
{
    field.clear();
    if (value.is_nil()) return;
    const Table* table = value.table();
    if (!table || !table->named.empty()) wrong_type(param, value);

    const auto put = [&](std::int64_t frame, const Value& given) {
        Param one = param;
        one.name = fmt::format("{}[{}]", param.name, frame);
        one.type = "number";
        read_value(one, given, field[frame]);
    };
    for (std::size_t i = 0; i < table->list.size(); ++i) put(static_cast<std::int64_t>(i) + 1, table->list[i]);
    for (const auto& [frame, given] : table->numbered) put(frame, given);
}

void read_value(const Param& param, const Value& value, std::vector<std::string>& field)
{
    field.clear();
    if (value.is_nil()) return;
    if (const std::string* one = value.get<std::string>()) return field.push_back(*one);
    const Table* table = value.table();
    if (!table || !table->numbered.empty() || !table->named.empty()) wrong_type(param, value);
    for (const Value& entry : table->list) {
        const std::string* name = entry.get<std::string>();
        if (!name) wrong_type(param, value);
        field.push_back(*name);
    }
}

void read_value(const Param& param, const Value& value, std::map<std::string, Value>& field)
{
    const Table* table = value.table();
    if (!table || !table->list.empty() || !table->numbered.empty()) wrong_type(param, value);
    field = table->named;
}

void assign_arguments(const std::vector<Param>& params, const std::map<std::string, Value>& arguments, void* fields)
{
    std::vector<std::string> names;
    for (const Param& param : params) names.push_back(param.name);
    for (const auto& [name, value] : arguments)
        if (std::find(names.begin(), names.end(), name) == names.end())
            throw Error(fmt::format("unknown option \"{}\"{}", name, did_you_mean(name, names)));
    for (const Param& param : params) {
        const auto given = arguments.find(param.name);
        if (given != arguments.end())
            param.assign(param, fields, given->second);
        else if (param.required)
            throw Error(fmt::format("{} is missing: {}", param.name, param.doc));
        else if (!param.fallback.is_nil())
            param.assign(param, fields, param.fallback);
    }
}

void read_value(const Param& param, const Value& value, FrameSet& field)
{
    std::vector<double> numbers;
    read_value(param, value, numbers);
    field.frames.clear();
    for (const double number : numbers) {
        if (number != std::floor(number))
            throw Error(fmt::format("{} has the frame {}; frames must be whole numbers", param.name, number));
        field.frames.insert(static_cast<std::int64_t>(number));
    }
}

}  // namespace rapid
