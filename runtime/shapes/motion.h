// A motion: an affine map of space, as rapid.translate, .rotate and .scale make it.
#pragma once

#include "runtime/object.h"
#include "runtime/vec.h"

namespace rapid {

class Motion : public Object {
public:
    static constexpr std::string_view param_type = "motion";

    explicit Motion(const Eigen::Affine3d& affine) : map(affine) {}
    std::string_view kind() const override { return "motion"; }

    const Eigen::Affine3d map;
};

using MotionPtr = std::shared_ptr<const Motion>;

}  // namespace rapid
