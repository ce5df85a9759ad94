// A point set as a value in a graph: rapid.points.read, .grid, .from.
#pragma once

#include "runtime/base/object.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/motion/motion.h"

namespace rapid {

class PointsObject : public Object {
public:
    static constexpr std::string_view param_type = "points";
    std::string_view kind() const override { return "points"; }

    PointSet points;
};

// The result of `:transform` with a motion.
class AnimatedPoints : public Object {
public:
    AnimatedPoints(std::shared_ptr<const PointsObject> points, MotionPtr motion)
        : rest_(std::move(points)), motion_(std::move(motion))
    {
    }
    std::string_view kind() const override { return "moving points"; }
    bool varies() const override { return true; }

    const PointSet& rest() const { return rest_->points; }
    const MotionPtr& motion() const { return motion_; }
    // Returns a copy with another motion applied after its own.
    std::shared_ptr<const AnimatedPoints> transformed(const MotionPtr& motion) const
    {
        return std::make_shared<AnimatedPoints>(rest_, product(motion, motion_));
    }

private:
    std::shared_ptr<const PointsObject> rest_;
    MotionPtr motion_;
};

// Transforms P; v and N rotate with it, and v is scaled.
std::shared_ptr<const PointsObject> transformed(const PointsObject& points, const Pose& pose);

}  // namespace rapid
