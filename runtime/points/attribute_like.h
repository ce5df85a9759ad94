// The value that an attribute has for points that bring none of their own.
#pragma once

#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

// An attribute that some points have, with values of the type of `like`, as the others get it: a known one with its
// default, else zero, or white.
AttributeSpec attribute_like(const std::string& name, const AttributeValue& like);

}  // namespace rapid
