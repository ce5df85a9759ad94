// Checks of whole point sets, for assertions: each returns the first fault as a text, or nothing.
#pragma once

#include <optional>
#include <string>

#include "bindings/host/testing/tested_points.h"

namespace rapid {

// A value that is neither finite nor the life of a point that never dies.
std::optional<std::string> first_not_finite(const TestedPoints& points);

// A difference in sizes, names, types or bits.
std::optional<std::string> first_difference(const TestedPoints& a, const TestedPoints& b);

}  // namespace rapid
