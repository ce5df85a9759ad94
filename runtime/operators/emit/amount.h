// How many points are born: a number, or an attribute of the points that they are born from.
#pragma once

#include <string>
#include <string_view>
#include <type_traits>

#include "runtime/graph/param.h"

namespace rapid {

// Of births a second (double), or of whole births (int).
template <class T>
struct Amount {
    static constexpr std::string_view param_type =
        std::is_same_v<T, int> ? "integer or rapid.attr" : "number or rapid.attr";
    T value{};
    std::string attribute;  // where not empty, each parent has its own

    // Of the points of a set, as numbers; all have the value where there is no attribute. Error: no such attribute, or
    // one of vectors.
    std::vector<double> of(const PointSet& points) const;
};

template <class T>
void read_value(const Param& param, const Value& value, Amount<T>& field)
{
    field = {};
    if (const auto* reference = value.get<AttributeRef>())
        field.attribute = reference->name;
    else
        read_value(param, value, field.value);
}

// The values of a float or integer attribute. Error: there is none of that name, or it holds vectors.
std::vector<double> numbers_of(const PointSet& points, const std::string& attribute);

template <class T>
std::vector<double> Amount<T>::of(const PointSet& points) const
{
    if (!attribute.empty()) return numbers_of(points, attribute);
    return std::vector<double>(points.size(), static_cast<double>(value));
}

}  // namespace rapid
