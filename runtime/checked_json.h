// JSON whose numbers are read as they are written. nlohmann's own types give any number for one that is too large for
// the type that is asked for: 4294967297 is the int 1, and 1e30 undefined.
#pragma once

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>

namespace rapid {

template <class T, class = void>
struct CheckedNumber : nlohmann::adl_serializer<T> {
};

// Integers, enumerations among them. json::type_error: the value is no number, has a fraction, or is out of T's range.
template <class T>
struct CheckedNumber<T, std::enable_if_t<(std::is_integral_v<T> && !std::is_same_v<T, bool>) || std::is_enum_v<T>>> {
    template <class Json>
    static void to_json(Json& json, T value)
    {
        nlohmann::to_json(json, value);
    }

    template <class Json>
    static void from_json(const Json& json, T& value)
    {
        if constexpr (std::is_enum_v<T>) {
            value = static_cast<T>(json.template get<std::underlying_type_t<T>>());
        } else {
            const auto refuse = [&](const std::string& what) {
                throw nlohmann::json::type_error::create(302, what + json.dump(), &json);
            };
            // Every integer of T lies in [-2^digits, 2^digits), whose ends a double holds.
            const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);
            const double least = std::is_signed_v<T> ? -beyond : 0.0;
            if (json.is_number_unsigned()) {
                const auto number = json.template get_ref<const typename Json::number_unsigned_t&>();
                if (!std::in_range<T>(number)) refuse("an integer is out of range: ");
                value = static_cast<T>(number);
            } else if (json.is_number_integer()) {
                const auto number = json.template get_ref<const typename Json::number_integer_t&>();
                if (!std::in_range<T>(number)) refuse("an integer is out of range: ");
                value = static_cast<T>(number);
            } else if (json.is_number_float()) {
                const double number = json.template get_ref<const typename Json::number_float_t&>();
                if (!(number >= least && number < beyond)) refuse("an integer is out of range: ");
                if (number != std::trunc(number)) refuse("must be an integer: ");
                value = static_cast<T>(number);
            } else {
                throw nlohmann::json::type_error::create(302, std::string("must be a number, is ") + json.type_name(),
                                                         &json);
            }
        }
    }
};

// Members in the order in which they stand.
using CheckedJson = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool, std::int64_t,
                                         std::uint64_t, double, std::allocator, CheckedNumber>;
// Members by name, for what others write: a member of an object of n is found in log n.
using SortedCheckedJson = nlohmann::basic_json<std::map, std::vector, std::string, bool, std::int64_t, std::uint64_t,
                                               double, std::allocator, CheckedNumber>;

}  // namespace rapid
