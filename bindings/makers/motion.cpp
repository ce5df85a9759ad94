// rapid.translate, rapid.rotate, rapid.scale, their products, and what they move.
#include "runtime/shapes/motion.h"

#include "bindings/maker.h"
#include "runtime/shapes/mesh.h"

namespace rapid {
namespace {

struct Translate {
    Vec3d by;

    static Maker declare()
    {
        return maker<Translate>("motion.translate", "Moves along a vector.")
            .param(&Translate::by, "by", Value(), any_number(), "m", "the way")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return std::make_shared<Motion>(Eigen::Affine3d(Eigen::Translation3d(by))); }
};
RAPID_MAKER(Translate);

struct Rotate {
    Vec3d axis;
    double angle;  // rad

    static Maker declare()
    {
        return maker<Rotate>("motion.rotate", "Turns about an axis through the origin.")
            .param(&Rotate::axis, "axis", Value(), any_number(), "", "any length but zero")
            .required()
            .param(&Rotate::angle, "degrees", Value(), any_number(), "deg", "the angle, by the right-hand rule")
            .required();
    }
    ObjectPtr make(MakeContext&) const
    {
        if (axis.norm() == 0) throw Error("the axis has length 0; it needs a direction");
        return std::make_shared<Motion>(Eigen::Affine3d(Eigen::AngleAxisd(angle, axis.normalized())));
    }
};
RAPID_MAKER(Rotate);

struct Scale {
    double by;

    static Maker declare()
    {
        return maker<Scale>("motion.scale", "Scales about the origin.")
            .param(&Scale::by, "factor", Value(), above(0), "", "of all lengths")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return std::make_shared<Motion>(Eigen::Affine3d(Eigen::Scaling(by))); }
};
RAPID_MAKER(Scale);

struct Product {
    MotionPtr first, second;

    static Maker declare()
    {
        return maker<Product>("motion.product", "The right motion, then the left one.")
            .param(&Product::first, "first", Value(), any_number(), "", "done last")
            .required()
            .param(&Product::second, "second", Value(), any_number(), "", "done first")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return std::make_shared<Motion>(first->map * second->map); }
};
RAPID_MAKER(Product);

struct Transform {
    MeshPtr object;
    MotionPtr motion;

    static Maker declare()
    {
        return maker<Transform>("transform", "A mesh, moved.")
            .param(&Transform::object, "object", Value(), any_number(), "", "the mesh")
            .required()
            .param(&Transform::motion, "motion", Value(), any_number(), "",
                   "rapid.translate, .rotate, .scale, or a product")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return transformed(object, motion->map); }
};
RAPID_MAKER(Transform);

}  // namespace
}  // namespace rapid
