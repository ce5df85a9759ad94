// Pages that columns gave back, for who next needs about as many: of columns that come and go in every frame the system
// would else clear the pages again each time, one by one. At most 64 MiB are kept.
#pragma once

#include <cstddef>
#include <mutex>
#include <vector>

namespace rapid {

class SparePages {
public:
    static constexpr std::size_t page = 4096;  // bytes

    struct Block {
        void* begin = nullptr;
        std::size_t bytes = 0;
    };

    // Those of the process.
    static SparePages& all();

    // blocks: that are kept at most. A few serve who works on one frame; where each frame of a run takes the place of
    // one of the run before, all columns of a frame are given back at once.
    explicit SparePages(std::size_t blocks = 4) : blocks_(blocks) {}
    void keep(std::size_t blocks);

    // How many bytes to map for so many: some more where the block may be kept, so that a column which grows a little
    // from frame to frame finds that of the frame before large enough. Pages that nothing touches take no memory.
    static std::size_t room_for(std::size_t bytes);

    // At least so many bytes, and at most twice as many; null where there are none.
    Block take(std::size_t bytes);
    void give(Block block);

private:
    std::mutex mutex_;
    std::vector<Block> blocks_;
    std::size_t bytes_ = 0;  // of all
    std::size_t next_ = 0;   // of those that are there, to make room
};

}  // namespace rapid
