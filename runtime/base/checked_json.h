// JSON with checked number conversions. With nlohmann's own types, a number that is too large for the requested type
// becomes an arbitrary one: 4294967297 becomes the int 1, and 1e30 is undefined.
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

// Integers, including enumerations. Throws json::type_error if the value is not a number, has a fraction, or is out of
// T's range.
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
            // Every integer of T lies in [-2^digits, 2^digits), whose ends a double can represent.
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

// JSON whose members keep their order.
using CheckedJson = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool, std::int64_t,
                                         std::uint64_t, double, std::allocator, CheckedNumber>;
// JSON with members sorted by name, for files from elsewhere: finding a member of an object of n takes log n.
using SortedCheckedJson = nlohmann::basic_json<std::map, std::vector, std::string, bool, std::int64_t, std::uint64_t,
                                               double, std::allocator, CheckedNumber>;

}  // namespace rapid
