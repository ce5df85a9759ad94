// The shapes in a picture: those that a plan's points collide with or are born from.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/plan.h"
#include "runtime/picture/scene.h"

namespace rapid {

class SceneOfPlan {
public:
    explicit SceneOfPlan(const Plan& plan) : plan_(plan) {}

    // Returns the scene at a frame, with functions of the frame and motions evaluated. A level set is turned into a
    // mesh once, and again if the frame before did not have it.
    std::shared_ptr<const PictureScene> at(std::int64_t frame);
    // Returns true if the scene may have colliders in any frame. Evaluates nothing.
    bool may_have_colliders() const;

private:
    using Argument = std::pair<std::size_t, std::string>;  // index of a node in the plan, and a parameter
    // All shapes of a frame, shown or not.
    struct Described {
        std::shared_ptr<PictureScene> scene;
        std::vector<Argument> given_by;  // source of each body
        bool moves = false, emitters = true, colliders = true;
    };
    Described describe(std::int64_t frame);
    std::set<Argument> find_vessels();
    static void add_look(Described& to, const Node& node, const Frame& now, double fps);
    void add(Described& to, const ObjectPtr& object, const Eigen::Affine3d& placement, const Argument& given_by);

    const Plan& plan_;
    std::map<ObjectPtr, MeshPtr> surfaces_, surfaces_before_;  // of this frame, and of the previous one
    std::shared_ptr<const PictureScene> still_;                // if nothing moves
    std::optional<std::set<Argument>> vessels_;
};

}  // namespace rapid
