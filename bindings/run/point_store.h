// Point sets by frame that the processes of one command share: an anonymous file in memory, which is gone when the last
// of these processes ends.
#pragma once

#include <cstdint>

#include "runtime/points/point_set.h"

namespace rapid {

class PointStore {
public:
    // Make it before the processes that share it. Error: the system has no memory for it.
    PointStore();
    ~PointStore();
    PointStore(const PointStore&) = delete;
    PointStore& operator=(const PointStore&) = delete;

    // Of the frames so far there is none.
    void clear();
    // Columns without groups; frames in the order in which they will be read.
    void keep(std::int64_t frame, const PointSet& points);
    // Reads the frame at `place`, 0 at first, and advances it. Error: it is another frame.
    PointSet read(std::int64_t frame, std::uint64_t& place) const;

private:
    int descriptor_;
};

}  // namespace rapid
