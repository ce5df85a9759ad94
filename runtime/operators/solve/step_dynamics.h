// The dynamics of a step: those of the chain, the drag that points bear as attributes, colliders with their shapes in
// motion; and what changes within the step.
//
// Forces that change are given at the middles of the step's sub-steps, interactions at their ends, and constraints with
// places that are functions of time along these. Of other constraints and of colliders the run has those of the end of
// the step, shadows those of its middle.
#pragma once

#include <cmath>
#include <map>
#include <string>

#include "runtime/operators/solve/step_observers.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/deforming.h"

namespace rapid {

struct NeededBand;

// The shapes of colliders as one step needs them (paper §4.3, §4.4): level sets with a band as wide as the points
// require, and moving or deforming shapes along their paths through the step.
//
// A level set is widened once and kept from step to step, as a deforming one is. A snapshot holds how wide they were,
// not the grids: points would come to other bits among narrower ones.
class ColliderShapes {
public:
    // Replaces the colliders whose shapes are too narrow, moving or deforming. substeps: after which points are put
    // back, for the band of methods that do so. Error: a band that does not fit into memory; a motion that fails.
    void prepare(Dynamics& dynamics, const PointSet& points, const FrameClock& clock, int substeps,
                 const Evaluation& now);

    template <class Archive>
    void serialize(Archive& keep)
    {
        std::map<std::string, Band> bands = restored_.empty() ? bands_ : restored_;
        keep(bands, deformations_);
        if constexpr (Archive::is_loading::value) {
            for (const auto& [node, band] : bands) StateReader::expect(band.band >= 0 && std::isfinite(band.band));
            widened_.clear(), bands_.clear(), restored_ = std::move(bands);
        }
    }

private:
    struct Widened {
        LevelSetPtr shape;
        double band;  // m, that it was asked to have
    };
    // The band that a shape was given, and by what it is known.
    struct Band {
        double band = 0, voxel = 0;  // m
        Vec3d min = Vec3d::Zero(), max = Vec3d::Zero();
        std::uint64_t voxels = 0;

        bool is_of(const LevelSet& shape) const;
        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(band, voxel, min, max, voxels);
        }
    };

    Widened known(const Collider& collider, const LevelSetPtr& shape) const;
    void widen(Dynamics& dynamics, NeededBand& needed_band, const Evaluation& now);
    void set_in_motion(Dynamics& dynamics, NeededBand& needed_band, const FrameClock& clock, const Evaluation& now);

    std::map<ShapePtr, Widened> widened_;              // by the shape given
    std::map<std::string, Band> bands_, restored_;     // by collide node: of the last step; of a snapshot before it
    std::map<std::string, Deformation> deformations_;  // by collide node
};

// Completes the dynamics in the flow and the columns that they need, and gives the step those of its run and of
// shadows. On the thread that evaluates nodes. Error: an attribute that stands for a parameter is out of its range; a
// shape that does not fit into memory.
void prepare(Step& step, ColliderShapes& shapes);

// Refuses attributes that stand for parameters as constants are, by one scan of each.
void require_in_range(const Step& step);

}  // namespace rapid
