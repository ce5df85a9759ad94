// The smallest voxel edge of a grid. OpenVDB refuses a map whose determinant is below 1e-15 m³.
#pragma once

namespace rapid {

constexpr double min_voxel = 2e-5;  // m

}  // namespace rapid
