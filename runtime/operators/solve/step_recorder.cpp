#include "runtime/operators/solve/step_recorder.h"

#include <algorithm>

namespace rapid {

void StepRecorder::start(const PointSet& points)
{
    if (!record_) return;
    *record_ = StepRecord();
    record_->before = points;
    simulation_.first_new = simulation_.next_id;
}

void StepRecorder::begin(const PointSet& points, SolveOptions& options, bool has_contacts)
{
    if (!record_) return;
    *record_ = StepRecord();
    record_->time = options.time;
    record_->h = options.h;
    record_->first_new = std::exchange(simulation_.first_new, simulation_.next_id);
    record_->before = points;
    record_->has_contacts = has_contacts;
    if (has_contacts) options.log = &log_.emplace(points.size());
}

void StepRecorder::end()
{
    if (!log_) return;
    record_->hits = log_->hits();
    record_->breaks = log_->breaks();
    record_->killed = log_->dead();
    record_->killed_at = log_->died_at();
}

void StepRecorder::remove_old(const PointSet& points, std::span<const std::uint8_t> stays)
{
    if (!record_) return;
    std::vector<std::uint32_t> places;
    for (std::size_t i = 0; i < stays.size(); ++i)
        if (!stays[i]) places.push_back(static_cast<std::uint32_t>(i));
    if (places.empty()) return;
    PointSet& old = record_->old = points.select(places);
    const Strided<float> age = old.column<float>("age").read(), life = old.column<float>("life").read();
    for (std::size_t i = 0; i < old.size(); ++i)
        record_->old_at.push_back(record_->time - std::max(0.0, double(age[i]) - double(life[i])));
}

}  // namespace rapid
