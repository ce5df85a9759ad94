// The parameters that emit and spawn share: time, speed, lifetime and attributes of births.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/graph/param.h"
#include "runtime/graph/point_function.h"
#include "runtime/math/items.h"

namespace rapid {

// The values of newborn points, by attribute: one for all; random between two, {min, max}; or random on a ramp, {{0,
// first}, ..., {1, last}}, linear between its keys. Strings {"a", "b", ...} are equally likely.
//
// A birth draws one number per attribute, keyed by the attribute's name, so that other attributes do not change it.
struct BirthValue {
    struct Key {
        double at;  // from 0 to 1
        AttributeValue value;
    };
    // All of one type; a single key if all newborn points have the same value.
    std::vector<Key> keys;
    bool counts = false;  // integers, all equally likely

    bool is_common() const { return keys.size() == 1; }
    const AttributeValue& first() const { return keys.front().value; }
    // u: uniform in [0, 1).
    template <class T>
    T at(double u) const;

private:
    template <class T>
    T between_keys(double u) const;
};

struct BirthValues {
    static constexpr std::string_view param_type = "attributes";
    std::map<std::string, BirthValue> of;

    bool has(const std::string& name) const { return of.count(name) > 0; }
};

void read_value(const Param& param, const Value& value, BirthValues& field);

// Assigns random values to `count` births, starting at `first` among the last n points of a column; births: their
// numbers.
using DrawValues = std::function<void(std::size_t first, std::size_t count, const Items& births)>;
// Returns the function for the attribute of this name, whose values differ between births. The value must outlive it.
DrawValues draw_values(const BirthValue& value, AnyColumn& column, std::size_t n, RandomKey key, std::string_view name);

template <class T>
T BirthValue::at(double u) const
{
    const auto value = [&](std::size_t k) { return std::get<T>(keys[k].value); };
    if constexpr (std::is_same_v<T, std::int32_t>) {
        const double low = value(0), high = value(keys.size() - 1);
        if (counts) return static_cast<T>(low + std::floor(u * (high - low + 1)));
    }
    if constexpr (std::is_same_v<T, Token>) {
        const auto choice = static_cast<std::size_t>(u * static_cast<double>(keys.size()));
        return value(std::min(choice, keys.size() - 1));
    } else {
        return between_keys<T>(u);
    }
}

template <class T>
T BirthValue::between_keys(double u) const
{
    const auto value = [&](std::size_t k) { return std::get<T>(keys[k].value); };
    if (keys.size() == 1 || u <= keys.front().at) return value(0);
    for (std::size_t k = 1; k < keys.size(); ++k) {
        if (u >= keys[k].at) continue;
        const double part = (u - keys[k - 1].at) / (keys[k].at - keys[k - 1].at);
        if constexpr (std::is_same_v<T, Quatf>)
            return value(k - 1).slerp(static_cast<float>(part), value(k));
        else if constexpr (std::is_arithmetic_v<T>)
            return static_cast<T>(value(k - 1) + part * (double(value(k)) - double(value(k - 1))));
        else
            return value(k - 1) + static_cast<float>(part) * (value(k) - value(k - 1));
    }
    return value(keys.size() - 1);
}

// A number of due births this close to an integer counts as that integer. 0.29 births per second for 100 s are
// 28.999999999999996 in doubles, and 29 to the user. Rounding stays below 1e-11 after 100,000 changes of the rate, and
// a birth is shifted by at most this fraction of the interval between two.
inline constexpr double whole_tolerance = 1e-9;

// Memory per newborn point with common attributes, in the state and in copies within a frame.
inline constexpr double bytes_per_birth = 2 * 64;

inline constexpr std::size_t trial_births = 64;  // per frame, in a trial (Evaluator::examine)

// One number for all points, or uniform between two: 2 or {1, 3}.
struct Interval {
    static constexpr std::string_view param_type = "number or {min, max}";
    double min = 0, max = 0;

    bool is_single() const { return min == max; }
    // u: uniform in [0, 1).
    double at(double u) const { return is_single() ? min : min + (max - min) * u; }
};

void read_value(const Param& param, const Value& value, Interval& field);

inline bool is_zero(const Interval& interval) { return interval.min == 0 && interval.max == 0; }
// Returns "2" or "{1, 3}".
std::string describe(const Interval& interval);

// The time within the frame's interval at which points are born, or a function that edits each newborn point, which is
// then born at a random time.
struct BirthMoment {
    // The host of the scripting language compiles functions to kernels; it detects them by the end of this string.
    static constexpr std::string_view param_type = "moment or function of a point";

    std::string when = "random";
    // Null if there is no function; both are the same object.
    std::shared_ptr<const PointFunction> function;
    std::shared_ptr<const PointEditor> edit;
};

void read_value(const Param& param, const Value& value, BirthMoment& field);

// Base of the parameter structs of emit and spawn.
struct Newborn {
    BirthMoment birth;
    Vec3d velocity;
    Interval speed;
    double spread;
    std::optional<Interval> life;
    std::string joins;
    BirthValues attributes;

    // Adds these parameters and the attributes of every newborn point. speed_along: the direction of `speed`.
    template <class T>
    static void declare_newborn(Declaration<T>& type, const std::string& speed_along);

    void use_newborn(Uses& uses) const;
    void check_attributes() const;

    // The attributes that the parameter `attributes` creates.
    std::vector<AttributeSpec> given() const;
    // Returns the value of a float attribute if `attributes` gives all newborn points the same one.
    std::optional<std::vector<float>> common_value(const std::string& attribute) const;
    bool may_end() const { return std::isfinite(life->min); }
    bool joins_group(const Evaluation& now) const { return !joins.empty() && now.keeps_group(joins); }
    // Returns the functions that draw values for the last n points, for attributes that differ between births.
    std::vector<DrawValues> draws_of(PointSet& points, std::size_t n, const Evaluation& now) const;
};

template <class T>
void Newborn::declare_newborn(Declaration<T>& type, const std::string& speed_along)
{
    type.varies()
        .stage(Stage::Emission)
        .writes("P")
        .writes("v")
        .writes("id")
        .param(&T::birth, "birth", "random", any_number(), "",
               "time of birth in the frame: at random, at its beginning or end, or evenly spaced; or a function(p, "
               "frame) of each newborn point")
        .choices({"random", "begin", "end", "even"})
        .constant()
        .param(&T::velocity, "velocity", Vec3d(0, 0, 0), any_number(), "m/s", "mean initial velocity")
        .param(&T::speed, "speed", 0.0, any_number(), "m/s",
               "speed along " + speed_along + ", added to velocity; a number or {min, max}")
        .param(&T::spread, "spread", 0.0, between(0, 180), "deg",
               "half angle of the cone in which velocity and speed are turned together, uniformly")
        .param(&T::life, "life", Value(), or_infinity(at_least(0)), "s",
               "age at which points die: a number or {min, max}; without it points live for ever")
        .param(&T::joins, "group", Value(), any_number(), "", "group that newborn points join")
        .constant()
        .param(&T::attributes, "attributes", Value(), any_number(), "",
               "values of newborn points instead of inherited ones, {heat = 1}: a value, a ramp, or a range {min, "
               "max}, of "
               "vectors on a line; for a box, birth = function(p)");
}

}  // namespace rapid
