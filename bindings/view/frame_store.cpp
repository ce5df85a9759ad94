#include "bindings/view/frame_store.h"

#include <algorithm>
#include <utility>

namespace rapid {

std::size_t bytes_of(const ViewFrame& frame)
{
    std::size_t bytes = sizeof(ViewFrame) + frame.statistics.size() + frame.points.bytes();
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
            if (entry.frame && entry.source && (!oldest || entry.used < oldest->used) && entry.source->has(number))
                oldest = &entry;
        if (!oldest) return false;
        drop(*oldest);
    }
    return true;
}

bool FrameStore::put(ViewFramePtr frame, std::shared_ptr<FrameSource> source)
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
    entry = {frame->run, frame, frame->statistics, std::move(source), ++uses_};
    return true;
}

void FrameStore::add(std::int64_t number, std::uint64_t run, std::string statistics,
                     std::shared_ptr<FrameSource> source)
{
    const std::lock_guard lock(mutex_);
    Entry& entry = frames_[number];
    drop(entry);
    entry = {run, nullptr, std::move(statistics), std::move(source), 0};
}

ViewFramePtr FrameStore::find(std::int64_t number)
{
    std::shared_ptr<FrameSource> source;
    std::uint64_t run = 0;
    {
        const std::lock_guard lock(mutex_);
        const auto found = frames_.find(number);
        if (found == frames_.end()) return nullptr;
        found->second.used = ++uses_;
        if (found->second.frame) return found->second.frame;
        source = found->second.source;
        run = found->second.run;
    }
    const ViewFramePtr read = source->load(number, run);
    if (!read) return nullptr;
    auto frame = std::make_shared<ViewFrame>(*read);
    const std::lock_guard lock(mutex_);
    const auto found = frames_.find(number);
    if (found == frames_.end() || found->second.run != run) return frame;  // another run has begun meanwhile
    frame->statistics = found->second.statistics;
    frame->bytes = bytes_of(*frame);
    if (!found->second.frame && make_room(frame->bytes, run)) {
        bytes_ += frame->bytes;
        frames_[number].frame = frame;
    }
    return frame;
}

std::vector<ViewFramePtr> FrameStore::of_run(std::uint64_t run) const
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

}  // namespace rapid
