// The types with packs or special alignment that hot files and other files pass to each other. Each file that includes
// this has its own table, with the layouts for the processor that the file is compiled for.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "runtime/lanes/lane_program.h"
#include "runtime/math/simd.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/projected_point.h"
#include "runtime/solver/motion/ballistic_batch.h"
#include "runtime/solver/motion/packed_points.h"

namespace rapid {

// The size and the alignment of types that code for several processor levels shares (cmake/RapidLevels.cmake).

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

namespace {

#define RAPID_LAYOUT_OF(...) layout_of<__VA_ARGS__>(#__VA_ARGS__)
constexpr TypeLayout shared_types[] = {
    RAPID_LAYOUT_OF(Vectors<Floats>),       RAPID_LAYOUT_OF(Vectors<Doubles>), RAPID_LAYOUT_OF(PackedPoints<Floats>),
    RAPID_LAYOUT_OF(PackedPoints<Doubles>), RAPID_LAYOUT_OF(LaneRunner::Slot), RAPID_LAYOUT_OF(LaneRunner),
    RAPID_LAYOUT_OF(ProjectedPoint),        RAPID_LAYOUT_OF(PointPack),        RAPID_LAYOUT_OF(ContactPack),
    RAPID_LAYOUT_OF(BallisticBatch),
};
#undef RAPID_LAYOUT_OF

}  // namespace

// The table of a hot file, which is compiled for the processor level that the loader has chosen.
std::span<const TypeLayout> shared_types_of_level();

}  // namespace rapid
