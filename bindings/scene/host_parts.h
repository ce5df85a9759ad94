// Converts the kinds of objects that a program offers. Throws Error if an array is missing or wrong.
#pragma once

#include "include/rapid/offers.h"
#include "runtime/base/object.h"

namespace rapid {

ObjectPtr make_shape(const std::string& name, const HostShape& shape, bool guarded);
// name: under which the program offers it.
ObjectPtr make_mesh(const HostMesh& mesh, const std::string& name);
ObjectPtr make_points(const HostPoints& points);

}  // namespace rapid
