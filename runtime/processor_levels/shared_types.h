// The types with packs or special alignment that hot files and other files pass to each other. Each file that includes
// this has its own table, with the layouts for the processor that the file is compiled for.
#pragma once

#include <span>

#include "runtime/lanes/lane_program.h"
#include "runtime/processor_levels/type_layout.h"
#include "runtime/simd.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/point_pack.h"
#include "runtime/solver/constraints/projected_point.h"
#include "runtime/solver/motion/ballistic_batch.h"
#include "runtime/solver/motion/packed_points.h"

namespace rapid {
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
