// The memory of one column: a block that grows in place.
//
// Large blocks are whole pages from the system and grow with mremap, which moves page-table entries instead of values.
// Pages that nothing has touched take no memory. Up to 64 MiB of released blocks are cached for reuse.
// Small blocks come from the heap. The first byte is 64-byte aligned until bytes are given up. It is also staggered:
// columns that all begin at the same offset in their pages make a loop over several of them 12 to 25 % slower (4 KiB
// aliasing).
#pragma once

#include <cstddef>
#include <mutex>
#include <vector>

namespace rapid {

class Buffer {
public:
    // Larger than any address space, and small enough that growth by half cannot overflow.
    static constexpr std::size_t max_bytes = std::size_t{1} << 62;

    Buffer() = default;
    explicit Buffer(std::size_t bytes) { reserve(bytes); }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&& other) noexcept;
    ~Buffer() { release(); }

    void* data() const { return data_; }
    std::size_t capacity() const { return capacity_; }

    // Makes room for at least `bytes` and preserves the contents. Throws std::bad_alloc if there is no memory.
    void reserve(std::size_t bytes);

    // Drops the first `bytes` without moving the rest: data() then points to the bytes after them.
    void give_up(std::size_t bytes);
    // Returns the bytes dropped by give_up(), plus the stagger of less than a page.
    std::size_t given_up() const { return block_ ? static_cast<char*>(data_) - static_cast<char*>(block_) : 0; }
    // Makes the dropped bytes available again, except for the stagger: the first byte is 64-byte aligned again. Nothing
    // is moved.
    void take_back();

private:
    void release();

    void* block_ = nullptr;  // the block as allocated
    std::size_t block_bytes_ = 0;
    bool mapped_ = false;  // own pages instead of heap memory
    void* data_ = nullptr;
    std::size_t capacity_ = 0;
};

// A cache of pages that columns released. Without it the system would clear the pages again, one by one, for columns
// that come and go every frame. Caches at most 64 MiB.
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
