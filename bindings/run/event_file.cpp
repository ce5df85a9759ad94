#include "bindings/run/event_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>
#include <type_traits>

#include "runtime/base/setting_names.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/io/format.h"
#include "runtime/operators/spawn/parent_paths.h"

namespace rapid {
namespace {

enum EventKind : std::int32_t { Birth, Hit, Death, Break };

struct Event {
    double time;  // s since the start
    std::int32_t chain;
    EventKind kind;
    std::int64_t id;
    Vec3f P, v;
    Vec3f N = Vec3f::Zero();
    float speed = 0, impulse = 0;
    std::int32_t collider = -1;
};
static_assert(std::is_trivially_destructible_v<Event>, "events go into logs as bytes");

void add_events(const StepRecord& record, std::int32_t chain, std::vector<Event>& events)
{
    const PointSet& before = record.before;
    const Column<float>* own = before.find<float>("dt");
    for (std::size_t i = 0; i < before.size(); ++i) {
        if (before.id()[i] < record.first_new) continue;
        const double dt = own ? std::min(record.h, double((*own)[i])) : record.h;
        events.push_back({record.time - dt, chain, Birth, before.id()[i], before.P()[i], before.v()[i]});
    }
    for (const LoggedHit& hit : record.hits)
        events.push_back(
            {hit.time, chain, Hit, before.id()[hit.point], hit.P, hit.v1, hit.n, hit.speed, hit.impulse, hit.collider});
    for (const LoggedBreak& end : record.breaks)
        events.push_back({end.time, chain, Break, before.id()[end.point], end.P, end.v});
    const PointSet none;
    const ParentPaths paths(none, record, "");
    for (std::size_t i = 0; i < paths.size(); ++i) {
        const ParentPaths::Parent& dead = paths[i];
        const ParentPaths::Moment last = paths.at(dead, dead.end);
        events.push_back(
            {record.time - record.h + dead.end, chain, Death, dead.id, last.P.cast<float>(), last.v.cast<float>()});
    }
}

template <class T, class F>
void set(PointSet& points, std::span<const Event> events, const char* name, const F& value)
{
    points.add({name, Column<T>::zero()});
    const std::span<T> to = points.column<T>(name).write();
    for (std::size_t i = 0; i < events.size(); ++i) to[i] = value(events[i]);
}

PointSet points_of(std::span<const Event> events, std::int64_t frame)
{
    PointSet points;
    points.append(events.size());
    set<Vec3f>(points, events, "P", [](const Event& e) { return e.P; });
    set<Vec3f>(points, events, "v", [](const Event& e) { return e.v; });
    set<Vec3f>(points, events, "N", [](const Event& e) { return e.N; });
    set<std::int64_t>(points, events, "id", [](const Event& e) { return e.id; });
    set<std::int32_t>(points, events, "event", [](const Event& e) { return static_cast<std::int32_t>(e.kind); });
    set<std::int32_t>(points, events, "frame", [&](const Event&) { return static_cast<std::int32_t>(frame); });
    set<std::int32_t>(points, events, "chain", [](const Event& e) { return e.chain; });
    set<std::int32_t>(points, events, "hitpath", [](const Event& e) { return e.collider; });
    set<float>(points, events, "time", [](const Event& e) { return static_cast<float>(e.time); });
    set<float>(points, events, "speed", [](const Event& e) { return e.speed; });
    set<float>(points, events, "impulse", [](const Event& e) { return e.impulse; });
    return points;
}

// Returns the record of a frame's events, as in a log.
std::string record_of(std::int64_t frame, const std::vector<Event>& events)
{
    std::string record(sizeof frame + events.size() * sizeof(Event), '\0');
    std::memcpy(record.data(), &frame, sizeof frame);
    std::memcpy(record.data() + sizeof frame, static_cast<const void*>(events.data()), events.size() * sizeof(Event));
    return record;
}

PointSet points_of_record(std::string_view record)
{
    std::int64_t frame = 0;
    if (record.size() < sizeof frame || (record.size() - sizeof frame) % sizeof(Event) != 0)
        throw Error("it is not a log of events");
    std::memcpy(&frame, record.data(), sizeof frame);
    record.remove_prefix(sizeof frame);
    std::vector<Event> events(record.size() / sizeof(Event));
    std::memcpy(static_cast<void*>(events.data()), record.data(), record.size());
    return points_of(events, frame);
}

bool holds_events(const Format& format) { return format.read && !format.positions_only; }

}  // namespace

void EventFile::begin()
{
    if (path_.empty()) return;
    check();
    file_.emplace(path_, points_of({}, 0));
}

void EventFile::check() const
{
    std::string known;
    for (const Format& format : formats())
        if (holds_events(format)) known += (known.empty() ? "" : ", ") + format.extension;
    const std::string extension = std::filesystem::path(path_).extension();
    const auto fits = [&](const Format& format) { return holds_events(format) && format.extension == extension; };
    if (std::none_of(formats().begin(), formats().end(), fits))
        throw Error(
            fmt::format("{} {}: events are written as points; use one of {}", name_of(Setting::Events), path_, known));
}

void EventFile::add(const FrameResult& result)
{
    if (!file_) return;
    std::vector<Event> events;
    std::int32_t chain = 0;
    for (const auto& [name, records] : result.steps) {
        for (const StepRecord& record : records) add_events(record, chain, events);
        ++chain;
    }
    const auto key = [](const Event& e) { return std::tuple(e.time, e.chain, e.kind, e.id, e.collider); };
    std::sort(events.begin(), events.end(), [&](const Event& a, const Event& b) { return key(a) < key(b); });
    if (events.empty()) return;
    file_->append(points_of(events, result.frame));
    if (log_) try {
            log_->append(record_of(result.frame, events));
        } catch (const std::exception& error) {
            log_.reset();
            failure_ = fmt::format("{}: {}; no further snapshots are stored", log_path_.string(), error.what());
        }
}

void EventFile::log_to(const std::filesystem::path& log)
{
    log_path_ = log;
    try {
        log_.emplace(log);
    } catch (const Error& error) {
        failure_ = fmt::format("{}: {}; no snapshots are stored", log.string(), error.what());
    }
}

std::optional<std::uint64_t> EventFile::logged() const { return log_ ? std::optional(log_->end()) : std::nullopt; }

template <class F>
void EventFile::read_log(std::uint64_t bytes, const F& f) const
{
    std::string record;
    for (std::uint64_t offset = 0; offset < bytes;) {
        if (!log_->read(offset, record) || offset > bytes) throw Error("it is damaged");
        f(points_of_record(record));
    }
}

void EventFile::check_log(std::uint64_t bytes) const
{
    if (!log_) throw Error(fmt::format("its events can't be read from {}", log_path_.string()));
    try {
        read_log(bytes, [](const PointSet&) {});
    } catch (const Error& error) {
        throw Error(fmt::format("its events in {}: {}", log_path_.string(), error.what()), error.kind());
    }
}

void EventFile::continue_after(std::uint64_t bytes)
{
    if (!log_) return;
    read_log(bytes, [this](const PointSet& points) { file_->append(points); });
    log_->continue_at(bytes);
}

void EventFile::finish()
{
    if (!file_) return;
    file_->finish();
    file_.reset();
}

}  // namespace rapid
