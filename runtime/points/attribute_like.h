// The value that an attribute has for points that bring none of their own.
#pragma once

#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// The attributes whose types Houdini and its readers fix: Cd, Alpha, N, orient, scale, instance, name, with the
// value of points without one. They are made as any other is. Null for any other name.
const AttributeSpec* conventional_attribute(std::string_view name);

// How an attribute of this name is made by a node `attribute`: "Cd = {1, 1, 1}", "heat = 0". numbers: how many a value
// has, if the name does not tell: 3 of a vec3, 4 of a quaternion, else one.
std::string text_of_making(const std::string& name, int numbers = 1);

// What an error says of an attribute that nothing makes, with the nearest of the names that there are.
std::string no_attribute(const std::string& name, const std::vector<std::string>& names, int numbers = 1);

// An attribute that some points have, with values of the type of `like`, as the others get it: a known one with its
// default, else that by convention, else zero.
AttributeSpec attribute_like(const std::string& name, const AttributeValue& like);

}  // namespace rapid
