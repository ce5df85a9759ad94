// Point sets by frame, for processes of one command to hand on: a nameless file in memory, which is gone when the last
// of them ends.
#pragma once

#include <cstdint>

#include "runtime/points/point_set.h"

namespace rapid {

class PointStore {
public:
    // Made before the processes that share it. Error: the system has no memory for it.
    PointStore();
    ~PointStore();
    PointStore(const PointStore&) = delete;
    PointStore& operator=(const PointStore&) = delete;

    // Columns without groups; frames in the order in which they will be read.
    void keep(std::int64_t frame, const PointSet& points);
    // Reads on from `place`, 0 at first. Error: the next frame is another one.
    PointSet read(std::int64_t frame, std::uint64_t& place) const;

private:
    int descriptor_;
};

}  // namespace rapid
