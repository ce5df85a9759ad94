#include "runtime/shapes/analytic/shape_type.h"

#include <algorithm>

namespace rapid {
namespace {

using Declare = ShapeType (*)();

std::vector<Declare>& declarations()
{
    static std::vector<Declare> all;
    return all;
}

}  // namespace

ShapeRegistration::ShapeRegistration(Declare declare) { declarations().push_back(declare); }

std::vector<ShapeType> shape_types()
{
    std::vector<ShapeType> types;
    for (const Declare declare : declarations()) types.push_back(declare());
    std::sort(types.begin(), types.end(), [](const ShapeType& a, const ShapeType& b) { return a.name < b.name; });
    return types;
}

}  // namespace rapid
