// The mass of points without the attribute.
#pragma once

namespace rapid {

inline constexpr float unit_mass = 1;  // kg

}  // namespace rapid
