// The totals in a run's summary, added up frame by frame. Their size does not depend on the number of frames.
#pragma once

#include <map>
#include <string>

#include "runtime/report/statistics.h"

namespace rapid {

class RunTotals {
public:
    void add(const FrameStatistics& frame);
    void add_writing(double seconds) { seconds_.write += seconds; }

    // Each returns a line for its subject, if present.
    std::string points_text() const;
    std::string frames_text(double run_seconds) const;  // with the seconds by stage
    std::string error_text() const;
    std::string rounding_text() const;
    std::string energy_text() const;
    std::string ledger_text() const;
    std::string contact_text() const;
    std::string constraint_text() const;
    std::string sleep_text() const;
    std::string band_text() const;
    std::string warning_text() const;

private:
    struct Warning {  // points that a frame counts, and the frames that counted any
        std::uint64_t points = 0, frames = 0;
        std::int64_t first = 0, last = 0;

        void add(std::int64_t frame, std::uint64_t count);
        std::string text(const char* what) const;
    };
    void add_bands(const FrameStatistics& frame);

    std::uint64_t frames_ = 0, point_frames_ = 0;
    StageSeconds seconds_;
    FrameStatistics last_;
    std::uint64_t max_points_ = 0;
    std::int64_t max_points_frame_ = 0;
    bool is_solved_ = false;  // some points
    // The frame with the largest error.
    struct WorstError {
        std::optional<FrameStatistics::Error> error;
        std::int64_t frame = 0;
        std::uint64_t frames = 0;  // that have one

        void add(const std::optional<FrameStatistics::Error>& other, std::int64_t number);
        std::string text(const std::string& what) const;
    };
    WorstError worst_error_, worst_frame_error_;
    std::map<std::string, std::int64_t> left_out_of_errors_;  // and the first frame of which it is
    std::int64_t first_solved_ = 0;                           // frame
    double worst_rounding_ = 0;                               // m
    std::int64_t worst_rounding_frame_ = 0;
    std::uint64_t contacts_ = 0;
    std::uint64_t broken_ = 0;  // rods and springs
    std::int64_t first_broken_frame_ = 0;
    double deepest_ = 0;  // m
    ContactEnergy contact_energy_;
    std::optional<Ledger> ledger_;  // of the frames together
    double worst_residual_ = 0;     // m
    std::int64_t worst_residual_frame_ = 0;
    bool constrained_at_worst_ = false;
    double search_seconds_ = 0;
    std::map<std::string, BandFigures> bands_;  // by node
    Warning contact_limit_, trapped_, loose_constraints_, beyond_tolerance_;
};

}  // namespace rapid
