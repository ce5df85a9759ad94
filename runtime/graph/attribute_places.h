// An argument of a node that names attributes in its text, as the body of a function of a point does.
#pragma once

#include <string>

#include "runtime/base/error.h"

namespace rapid {

class AttributePlaces {
public:
    virtual ~AttributePlaces() = default;

    // Where it names an attribute first; line 0 where it does not.
    virtual Location place_of(const std::string& attribute) const = 0;

    // The number of components of what it assigns to the attribute: 3 for a vec3, 4 for a quaternion, 0 if unknown.
    virtual int numbers_of(const std::string& attribute) const = 0;
};

}  // namespace rapid
