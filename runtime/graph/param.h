// Parameters of nodes. Each is declared once, with its type, range, default, unit and documentation, for validation,
// `rapid nodes` and the annotations for editors.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/graph/value.h"
#include "runtime/points/per_point.h"
#include "runtime/points/range.h"
#include "runtime/shapes/motion/motion.h"

namespace rapid {

struct Param {
    std::string name, type;  // type for users: "number", "vec3", "shape"
    std::string unit, doc;
    Value fallback;  // the default; nil: the field stays empty
    Range range;
    std::vector<std::string> choices;
    bool required = false;
    bool per_point = false;       // accepts rapid.attr
    bool of_the_frame = true;     // accepts a function of the frame
    bool may_be_nil = false;      // its function of the frame may return nil
    bool keeps_function = false;  // the function itself is the value: a motion is also called between frames
    bool internal = false;        // set by the host of the scripting language, and not shown to users

    // Stores a value, which is not a function, in the node's field. Throws Error, with the value, if it has the wrong
    // type or is out of range.
    std::function<void(const Param& self, void* fields, const Value& value)> assign;
    // Returns the attribute from which the field is read; empty if it is a constant. Null if the type takes no
    // per-point numbers.
    std::function<std::string(const void* fields)> attribute;
};

// Reads a value into a field. Throws Error with the name of the parameter, the value and the expected values. A node
// may add an overload for a type of its own, in namespace rapid, before its declaration.
void read_value(const Param& param, const Value& value, double& field);
void read_value(const Param& param, const Value& value, float& field);
void read_value(const Param& param, const Value& value, int& field);
void read_value(const Param& param, const Value& value, bool& field);
void read_value(const Param& param, const Value& value, std::string& field);  // one of `choices` if there are any
void read_value(const Param& param, const Value& value, Vec3d& field);
void read_value(const Param& param, const Value& value, Vec3f& field);
void read_value(const Param& param, const Value& value, PerPoint<float>& field);
void read_value(const Param& param, const Value& value, PerPoint<Vec3f>& field);
void read_value(const Param& param, const Value& value, ObjectPtr& field);
// Reads a motion: an object, a function of the frame that returns one, or keys {[1] = m1, [24] = m2} of constant
// motions.
void read_value(const Param& param, const Value& value, MotionPtr& field);
// Reads the value of an attribute, which has the name of the parameter. A known attribute has its own type, any other
// the type of the value: a number is a float, {x, y, z} a vec3, {x, y, z, w} a quaternion, a string a string. Throws
// Error if the name is reserved (P, v, id, dt, ...).
void read_value(const Param& param, const Value& value, AttributeValue& field);
// Reads attribute values by name: {heat = 1, Cd = {1, .5, 0}}.
void read_value(const Param& param, const Value& value, std::map<std::string, AttributeValue>& field);
// Reads numbers by frame: {[1] = 100, [24] = 50}. A list {100, 50} means frames 1 and 2.
void read_value(const Param& param, const Value& value, std::map<std::int64_t, double>& field);
// Reads names: {"heat", "Cd"}, or one name.
void read_value(const Param& param, const Value& value, std::vector<std::string>& field);

// Reads a table with only named entries, of any type.
void read_value(const Param& param, const Value& value, std::map<std::string, Value>& field);

template <class T>
void read_value(const Param& param, const Value& value, std::optional<T>& field)
{
    if (value.is_nil()) return field.reset();
    T given{};
    read_value(param, value, given);
    field = std::move(given);
}

[[noreturn]] void wrong_type(const Param& param, const Value& value);
[[noreturn]] void out_of_range(const Param& param, double value);

template <class T>
void read_value(const Param& param, const Value& value, std::shared_ptr<const T>& field)
{
    if (value.is_nil()) return field.reset();
    field = value.object<T>();
    if (!field) wrong_type(param, value);
}

// Returns the name of a field's type for users.
template <class T>
constexpr std::string_view param_type()
{
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, float> || std::is_same_v<T, PerPoint<float>>)
        return "number";
    else if constexpr (std::is_same_v<T, int>)
        return "integer";
    else if constexpr (std::is_same_v<T, bool>)
        return "boolean";
    else if constexpr (std::is_same_v<T, std::string>)
        return "string";
    else if constexpr (std::is_same_v<T, Vec3d> || std::is_same_v<T, Vec3f> || std::is_same_v<T, PerPoint<Vec3f>>)
        return "vec3";
    else if constexpr (std::is_same_v<T, std::map<std::string, AttributeValue>>)
        return "attributes";
    else if constexpr (std::is_same_v<T, std::map<std::int64_t, double>>)
        return "numbers by frame";
    else if constexpr (std::is_same_v<T, std::vector<std::string>>)
        return "names";
    else if constexpr (std::is_same_v<T, std::map<std::string, Value>>)
        return "table";
    else if constexpr (requires { typename T::allocator_type; })
        return "list";
    else if constexpr (std::is_same_v<T, AttributeValue>)
        return "attribute value";
    else if constexpr (requires { typename T::value_type; })  // std::optional
        return param_type<typename T::value_type>();
    else if constexpr (requires { T::param_type; })  // a node's own type
        return T::param_type;
    else
        return T::element_type::param_type;  // a pointer to an object
}

// Reads a list, value by value.
template <class T>
void read_value(const Param& param, const Value& value, std::vector<T>& field)
{
    field.clear();
    if (value.is_nil()) return;
    const Table* table = value.table();
    if (!table || !table->numbered.empty() || !table->named.empty()) wrong_type(param, value);
    field.resize(table->list.size());
    for (std::size_t i = 0; i < field.size(); ++i) read_value(param, table->list[i], field[i]);
}

// Sets all fields from arguments by name, or from their defaults. Throws Error if a name is unknown or missing, or as
// read_value does.
void assign_arguments(const std::vector<Param>& params, const std::map<std::string, Value>& arguments, void* fields);

// Returns a parameter stored in a field of T. fallback: the default, in the user's unit; degrees ("deg") are stored as
// radians.
template <class T, class F>
Param param_of(F T::*field, std::string name, Value fallback, Range range, std::string unit, std::string doc)
{
    Param p;
    p.name = std::move(name);
    p.type = param_type<F>();
    p.fallback = std::move(fallback);
    p.range = range;
    p.unit = std::move(unit);
    p.doc = std::move(doc);
    p.per_point = std::is_same_v<F, PerPoint<float>> || std::is_same_v<F, PerPoint<Vec3f>> ||
                  std::is_same_v<F, std::optional<PerPoint<float>>>;
    p.keeps_function = std::is_same_v<F, MotionPtr>;
    p.assign = [field](const Param& param, void* fields, const Value& value) {
        F& read = static_cast<T*>(fields)->*field;
        read_value(param, value, read);
        if constexpr (std::is_same_v<F, double>)
            if (param.unit == "deg") read *= EIGEN_PI / 180;
    };
    if constexpr (std::is_same_v<F, PerPoint<float>>)
        p.attribute = [field](const void* fields) { return (static_cast<const T*>(fields)->*field).attribute; };
    if constexpr (std::is_same_v<F, std::optional<PerPoint<float>>>)
        p.attribute = [field](const void* fields) {
            const F& given = static_cast<const T*>(fields)->*field;
            return given ? given->attribute : std::string();
        };
    return p;
}

// Frames by number: {12, 48}.
struct FrameSet {
    static constexpr std::string_view param_type = "list of frames";
    std::set<std::int64_t> frames;
};

// Throws Error if a frame is not an integer.
void read_value(const Param& param, const Value& value, FrameSet& field);

}  // namespace rapid
