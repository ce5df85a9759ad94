// The dynamics of a step: those of the chain, the drag from the points' attributes, colliders with moving shapes, and
// changes within the step.
//
// Changing forces are evaluated at the middles of the step's substeps, interactions at their ends, and constraints
// follow positions that are functions of time. Other constraints and colliders are those of the end of the step for
// the run, and those of its middle for shadows.
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

// The shapes of colliders for one step (paper §4.3, §4.4): level sets with a band as wide as the points require, and
// moving or deforming shapes along their paths through the step.
//
// A level set is widened once and kept between steps, as is a deforming one. A snapshot stores the widths, not the
// grids, because narrower bands would change the points' bits.
class ColliderShapes {
public:
    // Replaces the colliders whose shapes are too narrow, moving or deforming. substeps: number of substeps after
    // which points may be moved out, for the band of the discrete methods. Throws Error if a band does not fit into
    // memory, or a motion fails.
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
        double band;  // m, requested
    };
    // The band of a shape, and the data that identify the shape.
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

    std::map<ShapePtr, Widened> widened_;              // by the original shape
    std::map<std::string, Band> bands_, restored_;     // by collide node: of the last step; of a snapshot before it
    std::map<std::string, Deformation> deformations_;  // by collide node
};

// Completes the dynamics in the flow and the columns that they need, and sets the dynamics of the run and of shadows.
// Must be called on the thread that evaluates nodes. Throws Error if an attribute used as a parameter is out of its
// range, or a shape does not fit into memory.
void prepare(Step& step, ColliderShapes& shapes);

// Checks the range of attributes used as parameters, with one scan of each. Throws Error as for constants.
void require_in_range(const Step& step);

}  // namespace rapid
