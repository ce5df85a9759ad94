#include "runtime/report/totals.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "runtime/report/number_text.h"

namespace rapid {

void RunTotals::Warning::add(std::int64_t frame, std::uint64_t count)
{
    if (count == 0) return;
    if (frames == 0) first = frame;
    last = frame;
    points += count;
    ++frames;
}

// Returns "warning  points did so 5 times, in 3 frames from 7 to 48"; empty if no frame counted any.
std::string RunTotals::Warning::text(const char* what) const
{
    if (frames == 0) return "";
    const std::string where = frames == 1 ? fmt::format("in frame {}", first)
                                          : fmt::format("in {} frames from {} to {}", frames, first, last);
    return fmt::format("warning  {} {}, {}\n", what, points == 1 ? "once" : with_separators(points) + " times", where);
}

void RunTotals::add(const FrameStatistics& frame)
{
    if (frames_ == 0 || frame.points > max_points_) {
        max_points_ = frame.points;
        max_points_frame_ = frame.frame;
    }
    if (!is_solved_ && frame.points > 0 && frame.substeps > 0) {
        is_solved_ = true;
        first_solved_ = frame.frame;
    }
    worst_error_.add(frame.error, frame.frame);
    worst_frame_error_.add(frame.frame_error, frame.frame);
    for (const std::string& text : frame.left_out_of_errors) left_out_of_errors_.emplace(text, frame.frame);
    if (frame.rounding > worst_rounding_) {
        worst_rounding_ = frame.rounding;
        worst_rounding_frame_ = frame.frame;
    }
    if (frames_ == 0 || frame.constraint_residual_max > worst_residual_) {
        worst_residual_ = frame.constraint_residual_max;
        worst_residual_frame_ = frame.frame;
        constrained_at_worst_ = frame.constraint_rows > 0;
    }
    ++frames_;
    point_frames_ += frame.points;
    seconds_ += frame.seconds;
    contacts_ += frame.collisions;
    if (broken_ == 0) first_broken_frame_ = frame.frame;
    broken_ += frame.broken;
    deepest_ = std::max(deepest_, frame.penetration_max);
    contact_energy_ += frame.contact_energy;
    if (frame.ledger && ledger_)
        ledger_->append(*frame.ledger);
    else if (frame.ledger)
        ledger_ = frame.ledger;
    search_seconds_ += frame.contact_search ? frame.contact_search->seconds : 0;
    add_bands(frame);
    contact_limit_.add(frame.frame, frame.contact_limit);
    trapped_.add(frame.frame, frame.trapped);
    loose_constraints_.add(frame.frame, frame.loose_constraints);
    beyond_tolerance_.add(frame.frame, frame.beyond_tolerance);
    last_ = frame;
}

void RunTotals::add_bands(const FrameStatistics& frame)
{
    for (const BandFigures& band : frame.bands) {
        BandFigures& sum = bands_[band.node];
        sum.width = std::max(sum.width, band.width);
        sum.voxels = std::max(sum.voxels, band.voxels);
        sum.seconds += band.seconds;
    }
}

std::string RunTotals::points_text() const
{
    if (frames_ == 0) return "points   none: no frame was run\n";
    std::string text = fmt::format("points   {}", with_separators(last_.points));
    if (max_points_ > last_.points)
        text += fmt::format(" (most: {} in frame {})", with_separators(max_points_), max_points_frame_);
    return text + '\n';
}

std::string RunTotals::frames_text(double run_seconds) const
{
    std::string text = fmt::format("frames   {} in {}", frames_, duration_text(run_seconds));
    if (point_frames_ > 0 && run_seconds > 0)
        text += fmt::format(", {} points a second", in_millions(static_cast<double>(point_frames_) / run_seconds));
    return text + fmt::format("\nseconds  graph {:.3f}, script {:.3f}, solve {:.3f}, write {:.3f}\n", seconds_.graph,
                              seconds_.script, seconds_.solve, seconds_.write);
}

void RunTotals::WorstError::add(const std::optional<FrameStatistics::Error>& other, std::int64_t number)
{
    if (!other) return;
    ++frames;
    if (error && !(other->max > error->max)) return;
    error = other;
    frame = number;
}

std::string RunTotals::WorstError::text(const std::string& what) const
{
    if (!error) return "";
    // Errors that shadows cannot see must not be reported as zero.
    constexpr std::string_view same = "the same at twice the sub-steps";
    const auto within = [&](double e, std::string_view unit) {
        return e > 0 ? fmt::format("below {:.1e}{}", e, unit) : std::string(same);
    };
    if (!(error->max > 0)) return fmt::format("error    {}: {}\n", what, same);
    return fmt::format("error    {}: half of the points {}, 95 % {}, the worst {:.1e} (frame {})\n", what,
                       within(error->p50, " m"), within(error->p95, ""), error->max, frame);
}

// Returns the estimated errors of the worst frames, and the contributions that none of them includes.
std::string RunTotals::error_text() const
{
    if (!is_solved_ && !worst_error_.error) return "";
    std::string text =
        worst_error_.text("since birth, estimated") +
        worst_frame_error_.text(fmt::format("of one frame, estimated in {} of {}", worst_frame_error_.frames, frames_));
    if (text.empty()) text = "error    not estimated\n";
    for (const auto& [what, first] : left_out_of_errors_) {
        text += "left out of the error: " + what;
        if (first > first_solved_) text += fmt::format(" (from frame {} on)", first);
        text += '\n';
    }
    return text;
}

// Returns the displacement by rounding positions to single precision. More sub-steps do not reduce it.
std::string RunTotals::rounding_text() const
{
    if (!(worst_rounding_ > 0)) return "";
    return fmt::format("rounding of positions since birth: {:.1e} m at most (frame {})\n", worst_rounding_,
                       worst_rounding_frame_);
}

// Returns the change of kinetic energy by the integrator; empty if it is 0 or not defined.
std::string RunTotals::energy_text() const
{
    if (!last_.energy_drift || last_.energy_drift->max == 0) return "";
    return fmt::format("energy   of motion, collisions aside: {:+.1e} J/kg since birth on average, {:.1e} at most\n",
                       last_.energy_drift->mean, last_.energy_drift->max);
}

// Returns the sources of energy change of constrained points; empty if there are none.
std::string RunTotals::ledger_text() const
{
    if (!ledger_) return "";
    std::vector<std::string> parts;
    constexpr double rounding = 1e-6;  // of columns
    const double size = std::abs(ledger_->kinetic) + std::abs(ledger_->by.contacts) + std::abs(ledger_->by.rods) +
                        std::abs(ledger_->by.pins) + std::abs(ledger_->by.drag) + std::abs(ledger_->by_motion);
    const auto add = [&](const char* by, double change) {
        if (std::abs(change) > rounding * size) parts.push_back(fmt::format("{} {:+.3g}", by, change));
    };
    add("contacts", ledger_->by.contacts);
    if (ledger_->by.split) {
        add("friction", ledger_->by.split->friction);
        add("moving shapes", ledger_->by.split->shapes);
    }
    add("rods and springs", ledger_->by.rods);
    add("pins", ledger_->by.pins);
    add("drag", ledger_->by.drag);
    add("all else", ledger_->by_motion);
    std::string text = fmt::format("energy   {:.3g} J of constrained points", ledger_->energy());
    if (!parts.empty()) text += fmt::format("; changed by {} J", fmt::join(parts, ", "));
    return text + '\n';
}

// Returns the audit of all collisions; empty if there were none.
std::string RunTotals::contact_text() const
{
    if (contacts_ == 0 && !(deepest_ > 0)) return "";
    return fmt::format("contacts {}, deepest {} at a frame's end; they took {:.3g} J, and added {:.3g} J\n",
                       with_separators(contacts_), deepest_ > 0 ? fmt::format("{:.1e} m", deepest_) : "0 m",
                       contact_energy_.lost, contact_energy_.added);
}

// Returns the residual of the constraints, if any, and the grids of the contact search.
std::string RunTotals::constraint_text() const
{
    std::string text;
    if (broken_ > 0)
        text += fmt::format("broken   {} {}, the first in frame {}\n", with_separators(broken_),
                            broken_ == 1 ? "pair" : "pairs", first_broken_frame_);
    if (!constrained_at_worst_) return text;
    text += fmt::format("residual of constraints: {:.1e} m at most (frame {}), {:.1e} m in the last\n", worst_residual_,
                        worst_residual_frame_, last_.constraint_residual_max);
    if (const auto& search = last_.contact_search)
        text += fmt::format("contacts in {} {} of {} points, cells {:.2g} times too large, searched in {:.3f} s\n",
                            search->grids.size(), search->grids.size() == 1 ? "grid" : "grids",
                            fmt::join(search->grids, ", "), search->excess, search_seconds_);
    return text;
}

std::string RunTotals::sleep_text() const
{
    if (last_.asleep == 0) return "";
    return fmt::format("asleep   {} of {} points in the last frame\n", with_separators(last_.asleep),
                       with_separators(last_.points));
}

// Returns the cost of building narrow bands: a line for each node.
std::string RunTotals::band_text() const
{
    std::string text;
    for (const auto& [node, band] : bands_)
        if (band.seconds > 0)
            text += fmt::format("band     of {}: {:.3g} m, {} voxels at most, {} to build\n", node, band.width,
                                with_separators(band.voxels), duration_text(band.seconds));
    return text;
}

std::string RunTotals::warning_text() const
{
    return contact_limit_.text("points reached the limit of contacts") + trapped_.text("points were deep in a shape") +
           loose_constraints_.text("constraints were off by a tenth of their size") +
           beyond_tolerance_.text("points were beyond the tolerance");
}

}  // namespace rapid
