// A cache of pages that columns released. Without it the system would clear the pages again, one by one, for columns
// that come and go every frame. Caches at most 64 MiB.
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

    // Returns the cache of the process.
    static SparePages& all();

    // blocks: the most that are cached. A few suffice for work on a single frame. If the frames of a run replace those
    // of the previous run, all columns of a frame are released at once.
    explicit SparePages(std::size_t blocks = 4) : blocks_(blocks) {}
    void keep(std::size_t blocks);

    // Returns the number of bytes to map for a request. Cacheable blocks get a margin, so that a column which grows
    // slightly from frame to frame fits the block of the previous frame. Untouched pages take no memory.
    static std::size_t room_for(std::size_t bytes);

    // Returns a block of at least this size and at most about twice that; null if the cache has none.
    Block take(std::size_t bytes);
    void give(Block block);

private:
    std::mutex mutex_;
    std::vector<Block> blocks_;
    std::size_t bytes_ = 0;  // in all cached blocks
    std::size_t next_ = 0;   // next block to evict
};

}  // namespace rapid
