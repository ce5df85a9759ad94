// An argument of a node that names attributes in its text, as the body of a function of a point does.
#pragma once

#include <string>

#include "runtime/error.h"

namespace rapid {

class AttributePlaces {
public:
    virtual ~AttributePlaces() = default;

    // Where it names an attribute first; line 0 where it does not.
    virtual Location place_of(const std::string& attribute) const = 0;

    // How many numbers it assigns to the attribute at a time: 3 of a vec3, 4 of a quaternion; 0 where it does not tell.
    virtual int numbers_of(const std::string& attribute) const = 0;
};

}  // namespace rapid
