// Default values for attributes of points that do not set their own.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns the attribute whose type is fixed by Houdini and its readers (Cd, Alpha, N, orient, scale, instance, name),
// with its default value. Null for any other name. These attributes are created like any other.
const AttributeSpec* conventional_attribute(std::string_view name);

// Returns the parameters with which a node `attribute` creates this attribute: "Cd = {1, 1, 1}", "heat = 0". numbers:
// the components of a value if the name does not determine them: 3 for a vec3, 4 for a quaternion, otherwise 1.
std::string advice_for_making(const std::string& name, int numbers = 1);

// Returns Rapid's attribute name for a word common elsewhere ("color" gives "Cd"); empty if the word is not a known
// synonym.
std::string_view name_of_synonym(std::string_view word);

// Type of parameters that name an attribute with one number per point.
constexpr std::string_view number_attribute_type = "name of a number attribute";

// Returns the error message for an attribute that no node creates, with a suggestion from `names`.
std::string no_attribute(const std::string& name, const std::vector<std::string>& names, int numbers = 1);

// Returns the attribute that gives other points a column of the same type as `like`. The default is that of the known
// attribute, then that of the conventional one, then zero.
AttributeSpec attribute_like(const std::string& name, const AttributeValue& like);

}  // namespace rapid
