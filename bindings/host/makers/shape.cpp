// rapid.shape: shapes given by a formula.
#include "bindings/host/maker.h"
#include "runtime/shapes/analytic/analytic.h"

#include <fmt/format.h>

namespace rapid {
namespace {

struct PlaneShape {
    Vec3d normal;
    double offset;

    static Maker declare()
    {
        return maker<PlaneShape>("shape.plane",
                                 "The points with normal · x = offset; outside is where the normal points.")
            .param(&PlaneShape::normal, "normal", Vec3d(0, 1, 0), any_number(), "",
                   "out of the plane; any length but zero")
            .param(&PlaneShape::offset, "offset", 0.0, any_number(), "m", "along the normal");
    }
    ObjectPtr make(MakeContext&) const { return make_plane(normal, offset); }
};
RAPID_MAKER(PlaneShape);

struct SphereShape {
    double radius;
    Vec3d center;

    static Maker declare()
    {
        return maker<SphereShape>("shape.sphere", "A sphere.")
            .param(&SphereShape::radius, "radius", 1.0, above(0), "m", "of the sphere")
            .param(&SphereShape::center, "center", Vec3d(0, 0, 0), any_number(), "m", "its middle");
    }
    ObjectPtr make(MakeContext&) const { return make_sphere_shape(radius, center); }
};
RAPID_MAKER(SphereShape);

struct BoxShape {
    Vec3d size, center;

    static Maker declare()
    {
        return maker<BoxShape>("shape.box", "A box.")
            .param(&BoxShape::size, "size", Vec3d(1, 1, 1), any_number(), "m", "full edge lengths")
            .param(&BoxShape::center, "center", Vec3d(0, 0, 0), any_number(), "m", "its middle");
    }
    ObjectPtr make(MakeContext&) const
    {
        if (!(size.minCoeff() > 0))
            throw Error(fmt::format("size = {}: each edge must be above 0", describe(Value(size))));
        return make_box_shape(size, center);
    }
};
RAPID_MAKER(BoxShape);

}  // namespace
}  // namespace rapid
