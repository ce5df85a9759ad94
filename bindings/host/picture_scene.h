// The shapes of a picture: those that a plan's points collide with or are born from.
#pragma once

#include <map>
#include <memory>

#include "runtime/graph/plan.h"
#include "runtime/picture/scene.h"

namespace rapid {

class SceneOfPlan {
public:
    explicit SceneOfPlan(const Plan& plan) : plan_(plan) {}

    // Functions of the frame and motions are evaluated at the frame's time. A level set is turned into a mesh once, and
    // again where it was not in the frame before.
    std::shared_ptr<const PictureScene> at(std::int64_t frame);
    // Whether the scene may have colliders in any frame; evaluates nothing.
    bool may_have_colliders() const;

private:
    void add(PictureScene& scene, const ObjectPtr& object, const Eigen::Affine3d& place, PictureScene::Body::Role role);

    const Plan& plan_;
    std::map<ObjectPtr, MeshPtr> surfaces_, surfaces_before_;  // of this frame, and of the one before
    std::shared_ptr<const PictureScene> still_;                // if nothing moves
};

}  // namespace rapid
