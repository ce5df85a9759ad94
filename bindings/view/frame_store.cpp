#include "bindings/view/frame_store.h"

#include <algorithm>

namespace rapid {

bool FrameStore::put(ViewFramePtr frame)
{
    const std::lock_guard lock(mutex_);
    if (const auto old = frames_.find(frame->number); old != frames_.end()) {
        bytes_ -= old->second->bytes;
        frames_.erase(old);
    }
    while (bytes_ + frame->bytes > most_bytes_) {
        const auto stale = std::find_if(frames_.rbegin(), frames_.rend(),
                                        [&](const auto& entry) { return entry.second->run != frame->run; });
        if (stale == frames_.rend()) return false;
        bytes_ -= stale->second->bytes;
        frames_.erase(std::next(stale).base());
    }
    bytes_ += frame->bytes;
    const std::int64_t number = frame->number;
    frames_[number] = std::move(frame);
    return true;
}

ViewFramePtr FrameStore::find(std::int64_t number) const
{
    const std::lock_guard lock(mutex_);
    const auto found = frames_.find(number);
    return found == frames_.end() ? nullptr : found->second;
}

std::vector<ViewFramePtr> FrameStore::of_run(std::uint64_t run) const
{
    const std::lock_guard lock(mutex_);
    std::vector<ViewFramePtr> found;
    for (const auto& [number, frame] : frames_)
        if (frame->run == run) found.push_back(frame);
    return found;
}

void FrameStore::keep_only(std::uint64_t run)
{
    const std::lock_guard lock(mutex_);
    std::erase_if(frames_, [&](const auto& entry) {
        if (entry.second->run == run) return false;
        bytes_ -= entry.second->bytes;
        return true;
    });
}

FrameStore::Stretches FrameStore::stretches(std::uint64_t run) const
{
    const std::lock_guard lock(mutex_);
    Stretches result;
    for (const auto& [number, frame] : frames_) {
        auto& list = frame->run == run ? result.fresh : result.stale;
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
