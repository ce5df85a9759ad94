// An argument of a node whose text names attributes, such as the body of a function of a point.
#pragma once

#include <string>

#include "runtime/base/error.h"

namespace rapid {

class AttributeLocations {
public:
    virtual ~AttributeLocations() = default;

    // Returns the first location that names the attribute; line 0 if there is none.
    virtual Location location_of(const std::string& attribute) const = 0;

    // Returns the number of components of the value that it assigns to the attribute: 3 for a vec3, 4 for a
    // quaternion, 0 if unknown.
    virtual int numbers_of(const std::string& attribute) const = 0;
};

}  // namespace rapid
