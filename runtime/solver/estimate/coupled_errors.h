// Error estimate of points that act on one another, by step halving.
//
// A sample of them would move differently, so all have shadows (shadow.h): the whole set is advanced beside the run
// with twice the sub-steps, from the first frame on. Constraints, sleep and the loads on shapes have memories of their
// own for it. The estimate is twice the difference, as for points that move alone.
//
// That takes twice the time of Solve, and is done up to `most_points`. Of more, the frames 1, 2, 4, 8, ... and each
// `stride`th are solved again from where the run's points begin them, and the estimate is that of the error made in
// this frame; a sum over frames would leave out how later motion damps or spreads it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/points/saved_state.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "runtime/solver/solve.h"

namespace rapid {

class CoupledErrors {
public:
    static constexpr std::size_t most_points = 1000;
    static constexpr std::int64_t stride = 40;  // of frames: in long runs a twentieth of the time of Solve

    // Whether the n-th frame of too many points is solved again.
    static bool is_due(std::int64_t frame);

    struct Errors {
        std::vector<double> since_birth, of_frame;  // m, in the order of the points; empty where not estimated
        std::vector<std::int64_t> ids;              // of those points
        std::string unknown;                        // why there are none since birth; else empty
    };

    // Call before Solve, and before interactions act at the frame's ends.
    void begin(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options);
    // Call after Solve: advances the shadows.
    Errors end(const PointSet& solved);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(unknown_, frames_, runs_, solved_, shadows_, differences_, loads_, sleep_records_);
        std::map<std::string, SavedState> memories;
        if constexpr (Archive::is_saving::value) memories = memories_of_twins();
        keep(memories);
        if constexpr (Archive::is_loading::value) {
            StateReader::expect(frames_ >= 0 && differences_.size() == solved_.size());
            twins_.clear(), memories_ = std::move(memories);
        }
    }

private:
    // Of a point: what its shadow differs by.
    struct Difference {
        Vec3d P = Vec3d::Zero(), v = Vec3d::Zero();  // shadow minus point, after Solve
        bool is_known = true;                        // both have lived so far

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(P, v, is_known);
        }
    };

    void start(const SolveOptions& options);
    void stop();
    void apply_differences(const PointSet& points);
    void take_attributes(const PointSet& points);
    bool make_twins(const Dynamics& dynamics);
    std::map<std::string, SavedState> memories_of_twins() const;
    std::vector<double> compare(const PointSet& solved, std::vector<std::int64_t>& ids);

    std::string unknown_;      // why there are no shadows since birth any more; empty while there are
    std::int64_t frames_ = 0;  // since that
    bool runs_ = false;        // there are shadows

    PointSet solved_, shadows_;            // the points and the shadows, from end() to begin()
    Column<std::int64_t> ids_;             // of the points, from begin() to end()
    std::vector<Difference> differences_;  // in their order
    std::vector<std::shared_ptr<const Constraint>> twins_;
    std::map<std::string, SavedState> memories_;  // of a snapshot, for twins that are not made yet; by node
    ShapeLoads loads_;
    SleepRecords sleep_records_;

    // The shadows, from begin() to end().
    PointSet set_;
    Dynamics dynamics_;
    SolveOptions options_;
};

}  // namespace rapid
