// The parameters that emit and spawn share: time, speed, lifetime and attributes of births.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/graph/point_function.h"
#include "runtime/operators/births/birth_values.h"

namespace rapid {

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
