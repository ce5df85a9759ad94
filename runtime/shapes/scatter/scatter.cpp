#include "runtime/shapes/scatter/scatter.h"

#include <fmt/format.h>

#include "runtime/base/error.h"

namespace rapid {

ScatterPtr Shape::surface_scatter() const
{
    throw Error(fmt::format(
        "a {} has no finite surface that could emit points; use a mesh, a level set, a sphere or a box", kind()));
}

ScatterPtr Shape::volume_scatter() const
{
    throw Error(fmt::format(
        "a {} has no finite volume that could emit points; use a closed mesh, a level set, a sphere or a box", kind()));
}

ScatterPtr scatter_on_surface(const ShapePtr& shape) { return shape->surface_scatter(); }
ScatterPtr scatter_in_volume(const ShapePtr& shape) { return shape->volume_scatter(); }

}  // namespace rapid
