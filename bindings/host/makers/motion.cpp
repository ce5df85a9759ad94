// rapid.translate, rapid.rotate, rapid.scale, their products, and transformed objects.
#include "runtime/shapes/motion/motion.h"

#include <fmt/format.h>

#include "bindings/host/maker.h"
#include "runtime/graph/points_object.h"
#include "runtime/shapes/level_set/level_set_tools.h"
#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/motion/curves.h"
#include "runtime/shapes/motion/deforming.h"

namespace rapid {
namespace {

struct Translate {
    Vec3d by;

    static Maker declare()
    {
        return maker<Translate>("motion.translate", "Returns a translation by a vector.")
            .param(&Translate::by, "by", Value(), any_number(), "m", "translation")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return constant_motion({by}); }
};
RAPID_MAKER(Translate);

struct Rotate {
    Vec3d axis;
    double angle;  // rad

    static Maker declare()
    {
        return maker<Rotate>("motion.rotate", "Returns a rotation about an axis through the origin.")
            .param(&Rotate::axis, "axis", Value(), any_number(), "", "axis of any nonzero length")
            .required()
            .param(&Rotate::angle, "degrees", Value(), any_number(), "deg", "angle by the right-hand rule")
            .required();
    }
    ObjectPtr make(MakeContext&) const
    {
        if (axis.norm() == 0) throw Error("the axis has length 0; give it a direction");
        const Turn turn{axis.normalized(), angle};
        return constant_motion({Vec3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn.axis))}, Turns{turn});
    }
};
RAPID_MAKER(Rotate);

struct Scale {
    double by;

    static Maker declare()
    {
        return maker<Scale>("motion.scale", "Returns a scaling about the origin.")
            .param(&Scale::by, "factor", Value(), above(0), "", "factor of all lengths")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return constant_motion({Vec3d::Zero(), Eigen::Quaterniond::Identity(), by}); }
};
RAPID_MAKER(Scale);

struct Product {
    MotionPtr first, second;

    static Maker declare()
    {
        return maker<Product>("motion.product", "Returns the right motion followed by the left one.")
            .param(&Product::first, "first", Value(), any_number(), "", "motion that is applied last")
            .required()
            .param(&Product::second, "second", Value(), any_number(), "", "motion that is applied first")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return product(first, second); }
};
RAPID_MAKER(Product);

struct Transform {
    ObjectPtr object;
    MotionPtr motion;

    static Maker declare()
    {
        return maker<Transform>("transform", "Moves a mesh, a shape, a curve or points.")
            .param(&Transform::object, "object", Value(), any_number(), "", "mesh, shape, curve or points")
            .required()
            .param(&Transform::motion, "motion", Value(), any_number(), "",
                   "rapid.translate, .rotate, .scale or a product of them, a function of the frame that returns one, "
                   "or keys")
            .required();
    }

    ObjectPtr make(MakeContext&) const
    {
        if (const auto moving = std::dynamic_pointer_cast<const AnimatedMesh>(object))
            return moving->transformed(motion);
        if (const auto moving = std::dynamic_pointer_cast<const AnimatedShape>(object))
            return std::make_shared<AnimatedShape>(moving->rest(), product(motion, moving->motion()));
        if (const auto deforming = std::dynamic_pointer_cast<const DeformingLevelSet>(object))
            return deforming->transformed(motion);
        if (const auto mesh = std::dynamic_pointer_cast<const Mesh>(object)) {
            if (motion->varies()) return std::make_shared<AnimatedMesh>(mesh, motion);
            return transformed(mesh, motion->at({}).affine());
        }
        if (const auto shape = std::dynamic_pointer_cast<const Shape>(object)) {
            if (motion->varies()) return std::make_shared<AnimatedShape>(shape, motion);
            if (const auto level_set = std::dynamic_pointer_cast<const LevelSet>(shape))
                return move_level_set(level_set, motion->at({}));
            return placed(shape, motion->at({}));
        }
        if (const auto moving = std::dynamic_pointer_cast<const AnimatedPoints>(object))
            return moving->transformed(motion);
        if (const auto points = std::dynamic_pointer_cast<const PointsObject>(object)) {
            if (motion->varies()) return std::make_shared<AnimatedPoints>(points, motion);
            return transformed(*points, motion->at({}));
        }
        if (const auto moving = std::dynamic_pointer_cast<const MovingCurves>(object))
            return moving->transformed(motion);
        if (const auto curves = std::dynamic_pointer_cast<const Curves>(object)) {
            if (motion->varies()) return std::make_shared<MovingCurves>(curves, nullptr, motion);
            return transformed(curves, motion->at({}).affine());
        }
        throw Error(fmt::format("{} can't be moved; it must be a mesh, a shape, a curve or points", describe(object)));
    }
};
RAPID_MAKER(Transform);

}  // namespace
}  // namespace rapid
