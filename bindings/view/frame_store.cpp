#include "bindings/view/frame_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "bindings/scene/scene_inside.h"
#include "runtime/base/json.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using Json = CheckedJson;

constexpr std::size_t max_runs = 8;
constexpr const char *frame_kind = "frame", *shapes_kind = "geometry", *snapshot_kind = "snapshot";

// Throws the error; the archive knows the file.
void check_written(const Result<Done>& written)
{
    if (!written) throw Error(written.error().message);
}

}  // namespace

std::size_t bytes_of(const ViewFrame& frame)
{
    std::size_t bytes = sizeof(ViewFrame) + frame.statistics.size() + SceneInside::bytes(frame.points);
    for (const ShapeMesh& mesh : frame.shapes.meshes())
        bytes += (mesh.corner_count * sizeof(float) + mesh.triangle_count * sizeof(std::int32_t)) * 3 / 4;
    return bytes;
}

void FrameStore::drop(Entry& entry)
{
    if (entry.frame) bytes_ -= entry.frame->bytes;
    entry.frame = nullptr;
}

bool FrameStore::make_room(std::size_t bytes, std::uint64_t run)
{
    while (bytes_ + bytes > most_bytes_) {
        const auto stale = std::find_if(frames_.rbegin(), frames_.rend(), [&](const auto& entry) {
            return entry.second.run != run && entry.second.frame;
        });
        if (stale != frames_.rend()) {
            drop(stale->second);
            frames_.erase(std::next(stale).base());
            continue;
        }
        Entry* oldest = nullptr;
        for (auto& [number, entry] : frames_)
            if (entry.frame && entry.cache && (!oldest || entry.used < oldest->used) && entry.cache->has(number))
                oldest = &entry;
        if (!oldest) return false;
        drop(*oldest);
    }
    return true;
}

bool FrameStore::put(ViewFramePtr frame, std::shared_ptr<CachedRun> cache)
{
    const std::lock_guard lock(mutex_);
    const std::int64_t number = frame->number;
    if (const auto old = frames_.find(number); old != frames_.end()) {
        drop(old->second);
        frames_.erase(old);
    }
    if (!make_room(frame->bytes, frame->run)) return false;
    bytes_ += frame->bytes;
    Entry& entry = frames_[number];
    entry = {frame->run, frame, frame->statistics, std::move(cache), ++uses_};
    return true;
}

void FrameStore::add(std::int64_t number, std::uint64_t run, std::string statistics, std::shared_ptr<CachedRun> cache)
{
    const std::lock_guard lock(mutex_);
    Entry& entry = frames_[number];
    drop(entry);
    entry = {run, nullptr, std::move(statistics), std::move(cache), 0};
}

ViewFramePtr FrameStore::find(std::int64_t number)
{
    std::shared_ptr<CachedRun> cache;
    std::uint64_t run = 0;
    {
        const std::lock_guard lock(mutex_);
        const auto found = frames_.find(number);
        if (found == frames_.end()) return nullptr;
        found->second.used = ++uses_;
        if (found->second.frame) return found->second.frame;
        cache = found->second.cache;
        run = found->second.run;
    }
    const ViewFramePtr read = cache->load(number, run);
    if (!read) return nullptr;
    auto frame = std::make_shared<ViewFrame>(*read);
    const std::lock_guard lock(mutex_);
    const auto found = frames_.find(number);
    if (found == frames_.end() || found->second.run != run) return frame;  // another run has started in the meantime
    frame->statistics = found->second.statistics;
    frame->bytes = bytes_of(*frame);
    if (!found->second.frame && make_room(frame->bytes, run)) {
        bytes_ += frame->bytes;
        frames_[number].frame = frame;
    }
    return frame;
}

std::vector<ViewFramePtr> FrameStore::frames_of_run(std::uint64_t run) const
{
    const std::lock_guard lock(mutex_);
    std::vector<ViewFramePtr> found;
    for (const auto& [number, entry] : frames_)
        if (entry.run == run && entry.frame) found.push_back(entry.frame);
    return found;
}

std::vector<std::string> FrameStore::statistics(std::uint64_t run, std::int64_t after, std::size_t most) const
{
    const std::lock_guard lock(mutex_);
    std::vector<std::string> found;
    for (auto one = frames_.upper_bound(after); one != frames_.end() && found.size() < most; ++one)
        if (one->second.run == run) found.push_back(one->second.statistics);
    return found;
}

void FrameStore::keep_only(std::uint64_t run)
{
    const std::lock_guard lock(mutex_);
    for (auto one = frames_.begin(); one != frames_.end();) {
        if (one->second.run != run) {
            drop(one->second);
            one = frames_.erase(one);
        } else {
            ++one;
        }
    }
}

FrameStore::Stretches FrameStore::stretches(std::uint64_t run) const
{
    const std::lock_guard lock(mutex_);
    Stretches result;
    for (const auto& [number, entry] : frames_) {
        auto& list = entry.run == run ? result.fresh : result.stale;
        if (!list.empty() && list.back().second == number - 1)
            list.back().second = number;
        else
            list.emplace_back(number, number);
    }
    return result;
}

std::size_t FrameStore::bytes() const
{
    const std::lock_guard lock(mutex_);
    return bytes_;
}

CachedRun::CachedRun(const fs::path& folder, std::string hash, Scene& scene) : hash_(std::move(hash)), archive_(folder)
{
    archive_.begin_journal(read_journal(scene));
    std::error_code none;
    fs::last_write_time(folder, fs::file_time_type::clock::now(), none);  // marks the time of last use
    for (const auto& [number, known] : known_) {
        there_[number] = known.shapes;
        last_shapes_ = std::max(last_shapes_, known.shapes);
    }
}

std::vector<std::string> CachedRun::read_journal(Scene& scene)
{
    std::error_code none;
    std::map<std::int64_t, std::string> records;
    std::int64_t first_changed = std::numeric_limits<std::int64_t>::max();
    for (std::string& record : archive_.read_journal().value_or(FrameArchive::Records()).whole) try {
            const Json entry = Json::parse(record);
            const auto number = entry.at("frame").get<std::int64_t>();
            Known known{entry.at("statistics").get<std::string>(), entry.at("warnings").get<std::vector<std::string>>(),
                        entry.at("shapes").get<std::int64_t>()};
            if (!SceneInside::are_unchanged(scene, entry.at("read").get<std::map<std::string, std::string>>()).value())
                first_changed = std::min(first_changed, number);
            if (!fs::exists(archive_.file(frame_kind, number), none) || !Json::accept(known.statistics) ||
                (known.shapes != 0 && !fs::exists(archive_.file(shapes_kind, known.shapes), none)))
                continue;
            known_[number] = std::move(known);
            records[number] = std::move(record);
        } catch (const CheckedJson::exception&) {
            continue;
        }
    // A file is recorded with the first frame that reads it. All later frames depend on that frame.
    known_.erase(known_.lower_bound(first_changed), known_.end());
    records.erase(records.lower_bound(first_changed), records.end());
    for (const auto& [number, file] : archive_.files(snapshot_kind))
        if (number >= first_changed) fs::remove(file, none);
    std::vector<std::string> list;
    for (auto& [number, record] : records) list.push_back(std::move(record));
    return list;
}

std::int64_t CachedRun::number_of(const SceneShapes& shapes)
{
    if (shapes == SceneShapes()) return 0;
    if (shapes == written_) return written_number_;
    written_ = shapes;
    written_number_ = ++last_shapes_;
    archive_.submit(shapes_kind, written_number_,
                    [shapes](const fs::path& path) { check_written(SceneInside::save(shapes, path)); });
    return written_number_;
}

void CachedRun::put(const ViewFrame& frame, const std::vector<std::string>& warnings,
                    const std::map<std::string, std::string>& read)
{
    const std::lock_guard lock(mutex_);
    if (there_.contains(frame.number)) return;
    const std::int64_t shapes = number_of(frame.shapes);
    archive_.submit(frame_kind, frame.number, [points = frame.points, key = hash_](const fs::path& path) {
        check_written(SceneInside::save(points, path, key));
    });
    there_[frame.number] = shapes;
    const Json entry = {{"frame", frame.number},
                        {"shapes", shapes},
                        {"statistics", frame.statistics},
                        {"warnings", warnings},
                        {"read", read}};
    try {
        archive_.add(json_text(entry));
    } catch (const Error&) {  // the next view computes the frame again
    }
}

void CachedRun::keep(const SceneSnapshot& snapshot)
{
    archive_.submit(snapshot_kind, snapshot.frame(), [snapshot, key = hash_](const fs::path& path) {
        check_written(SceneInside::save(snapshot, path, key));
    });
}

std::optional<SceneSnapshot> CachedRun::snapshot_before(std::int64_t frame) const
{
    const std::map<std::int64_t, fs::path> all = archive_.files(snapshot_kind);
    for (auto one = std::make_reverse_iterator(all.lower_bound(frame)); one != all.rend(); ++one)
        // A damaged one is skipped; an earlier one serves as well.
        if (Result<SceneSnapshot> snapshot = SceneInside::load_snapshot(one->second, hash_))
            return std::move(*snapshot);
    return std::nullopt;
}

bool CachedRun::has(std::int64_t number) const
{
    std::error_code none;
    const std::lock_guard lock(mutex_);
    return there_.contains(number) && fs::exists(archive_.file(frame_kind, number), none);
}

SceneShapes CachedRun::shapes(std::int64_t number)
{
    if (number == 0) return {};
    if (loaded_number_ == number) return loaded_;
    loaded_ = SceneInside::load_shapes(archive_.file(shapes_kind, number)).value();
    loaded_number_ = number;
    return loaded_;
}

ViewFramePtr CachedRun::load(std::int64_t number, std::uint64_t run)
{
    const std::lock_guard lock(mutex_);
    const auto there = there_.find(number);
    if (there == there_.end()) return nullptr;
    Result<SceneFrame> loaded = SceneInside::load_frame(archive_.file(frame_kind, number), hash_);
    if (!loaded) {  // the next view computes it again
        std::error_code none;
        fs::remove(archive_.file(frame_kind, number), none);
        there_.erase(there);
    }
    SceneFrame points = std::move(loaded).value();
    return std::make_shared<ViewFrame>(ViewFrame{number, run, std::move(points), "", shapes(there->second)});
}

FrameCache::FrameCache(const fs::path& folder)
    : folder_(folder / "view"), lock_(FrameArchive::lock(folder_, folder, "view"))
{
}

std::shared_ptr<CachedRun> FrameCache::open(Scene& scene)
{
    const std::string hash = SceneInside::fingerprint(scene).value().hash;
    auto run = std::make_shared<CachedRun>(folder_ / hash, hash, scene);
    remove_old();
    return run;
}

void FrameCache::remove_old() const
{
    std::vector<std::pair<fs::file_time_type, fs::path>> runs;
    std::error_code error;
    for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
        std::error_code none;
        const fs::file_time_type used = fs::last_write_time(entry->path(), none);
        if (!none && entry->is_directory(none)) runs.emplace_back(used, entry->path());
    }
    std::sort(runs.rbegin(), runs.rend());
    for (std::size_t k = max_runs; k < runs.size(); ++k) fs::remove_all(runs[k].second, error);
}

}  // namespace rapid
