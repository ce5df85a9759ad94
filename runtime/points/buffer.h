// The memory of one column: a block that grows in place.
//
// Large blocks are whole pages from the system and grow with mremap, which moves page-table entries instead of values.
// Pages that nothing has touched take no memory. Up to 64 MiB of released blocks are cached for reuse (spare_pages.h).
// Small blocks come from the heap. The first byte is 64-byte aligned until bytes are given up. It is also staggered:
// columns that all begin at the same offset in their pages make a loop over several of them 12 to 25 % slower (4 KiB
// aliasing).
#pragma once

#include <cstddef>

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

}  // namespace rapid
