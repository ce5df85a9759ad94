// Error estimate of points that act on one another, by step halving.
//
// A sample of such points would move differently, so all have shadows (shadow.h): the whole set is also advanced with
// twice the substeps, from the first frame on. Constraints, sleep and the loads on shapes have separate memories for
// it. The estimate is twice the difference, as for points that move alone.
//
// This doubles the time of Solve, and is done for up to `max_points`. For larger sets, the frames 1, 2, 4, 8, ... and
// every `stride`th are solved again from the run's initial points, and the estimate is the error made in this frame. A
// sum over frames would not include the damping or spreading of the error by later motion.
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
    static constexpr std::size_t max_points = 1000;
    static constexpr std::int64_t stride = 40;  // in frames: in long runs a twentieth of the time of Solve

    // Returns true if the n-th frame of a set that is too large is solved again.
    static bool is_due(std::int64_t frame);

    struct Errors {
        std::vector<double> since_birth, of_frame;  // m, in the order of the points; empty if not estimated
        std::vector<std::int64_t> ids;              // of these points
        std::string unknown;                        // the reason if there are none since birth; else empty
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
    // The difference of a point's shadow from the point.
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

    std::string unknown_;      // the reason that there are no more shadows since birth; else empty
    std::int64_t frames_ = 0;  // since then
    bool runs_ = false;        // there are shadows

    PointSet solved_, shadows_;            // the points and the shadows, from end() to begin()
    Column<std::int64_t> ids_;             // of the points, from begin() to end()
    std::vector<Difference> differences_;  // by point
    std::vector<std::shared_ptr<const Constraint>> twins_;
    std::map<std::string, SavedState> memories_;  // of a snapshot, for twins that are not created yet; by node
    ShapeLoads loads_;
    SleepRecords sleep_records_;

    // The shadows, from begin() to end().
    PointSet set_;
    Dynamics dynamics_;
    SolveOptions options_;
};

}  // namespace rapid
