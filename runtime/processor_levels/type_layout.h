// The size and the alignment of types that code for several processor levels shares (cmake/RapidLevels.cmake).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace rapid {

struct TypeLayout {
    std::string_view name;
    std::size_t size, alignment;  // bytes

    bool operator==(const TypeLayout&) const = default;
};

template <class T>
consteval TypeLayout layout_of(std::string_view name)
{
    // alignof is what std::vector allocates by, __alignof__ what the compiler relies on (simd.h).
    static_assert(alignof(T) == __alignof__(T), "a type of packs must state its alignment: alignas(...)");
    return {name, sizeof(T), alignof(T)};
}

// Describes the first type that differs between two tables of the same types, of hot files and of the others. Empty if
// none does.
std::string layout_difference(std::span<const TypeLayout> hot, std::span<const TypeLayout> cold);

}  // namespace rapid
