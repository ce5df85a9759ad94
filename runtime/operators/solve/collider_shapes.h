// The shapes of colliders as one step needs them (paper §4.3, §4.4): level sets with a band as wide as the points
// require, and moving or deforming shapes along their paths through the step.
//
// A level set is widened once and kept from step to step, as a deforming one is.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/node.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/deforming.h"

namespace rapid {

class ColliderShapes {
public:
    // Replaces the colliders whose shapes are too narrow, moving or deforming. substeps: after which points are put
    // back, for the band of methods that do so. Error: a band that does not fit into memory; a motion that fails.
    void prepare(Dynamics& dynamics, const PointSet& points, const FrameClock& clock, int substeps,
                 const Evaluation& now);

private:
    void widen(Dynamics& dynamics, const PointSet& points, int substeps, const Evaluation& now);
    void set_in_motion(Dynamics& dynamics, const PointSet& points, const FrameClock& clock, int substeps,
                       const Evaluation& now);

    std::map<ShapePtr, LevelSetPtr> widened_;          // by the shape given
    std::map<std::string, Deformation> deformations_;  // by collide node
};

}  // namespace rapid
