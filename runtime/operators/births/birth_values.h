// The values of newborn points, by attribute: one for all; random between two, {min, max}; or random on a ramp, {{0,
// first}, ..., {1, last}}, linear between its keys. Strings {"a", "b", ...} are equally likely.
//
// A birth draws one number per attribute, keyed by the attribute's name, so that other attributes do not change it.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/param.h"
#include "runtime/math/items.h"

namespace rapid {

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

}  // namespace rapid
