// The types of attributes. AttributeTypes is their only list: columns, values and type indices are derived from it.
#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <variant>

#include "runtime/points/column.h"
#include "runtime/points/token.h"

namespace rapid {

template <class... T>
struct TypeList {
    using Column = std::variant<rapid::Column<T>...>;
    using Value = std::variant<T...>;
    // Columns of a saved state, which also stores groups.
    using SavedColumn = std::variant<rapid::Column<T>..., rapid::Column<std::uint8_t>>;
};
using AttributeTypes = TypeList<float, Vec3f, std::int32_t, std::int64_t, Quatf, Token>;

using AnyColumn = AttributeTypes::Column;
using AttributeValue = AttributeTypes::Value;

// The index of a type in AttributeTypes.
enum class AttributeType { Float, Vec3, Int32, Int64, Quat, String };

// Returns "float", "vec3", "int32", "int64", "quat" or "string".
std::string_view type_name(AttributeType type);
inline AttributeType type_of(const AnyColumn& column) { return static_cast<AttributeType>(column.index()); }
inline AttributeType type_of(const AttributeValue& value) { return static_cast<AttributeType>(value.index()); }

// Components of a value: 1, 3 or 4.
template <class T>
inline constexpr std::size_t components_of = std::is_same_v<T, Vec3f>   ? 3
                                             : std::is_same_v<T, Quatf> ? 4
                                                                        : 1;

// Returns an empty column (AnyColumn, SavedColumn) of the type at this index of its list. Precondition: the index is
// valid.
template <class Any>
Any column_of_type(std::size_t place)
{
    Any column;
    const auto emplace = [&]<std::size_t... k>(std::index_sequence<k...>)
    {
        (void)((k == place && (column.template emplace<k>(), true)) || ...);
    };
    emplace(std::make_index_sequence<std::variant_size_v<Any>>());
    return column;
}

}  // namespace rapid
