// The memory of one column: a block that grows in place.
//
// Large blocks are whole pages from the system, grown with mremap: growing moves page-table entries, never values, and
// pages that nothing has touched take no memory. A few of those given back, 64 MiB at most, are kept for who next needs
// as many. Small blocks come from the heap. The start is 64-byte aligned until bytes are given up, and staggered:
// columns that all begin at the same offset in their pages cost a loop over several of them 12 to 25 % (4 KiB
// aliasing).
#pragma once

#include <cstddef>

namespace rapid {

class Buffer {
public:
    // More than any machine's address space has for a block, less than would overflow when a block grows.
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

    // Makes room for at least `bytes`; what was written stays. Throws std::bad_alloc.
    void reserve(std::size_t bytes);

    // Gives up the first bytes: those behind them are the first from now on, and are not moved.
    void give_up(std::size_t bytes);
    // Bytes that were given up, and less than a page more.
    std::size_t given_up() const { return block_ ? static_cast<char*>(data_) - static_cast<char*>(block_) : 0; }
    // Takes them back, but for less than a page: the first is 64-byte aligned again. What was written is not moved.
    void take_back();

private:
    void release();

    void* block_ = nullptr;  // what the system gave
    std::size_t block_bytes_ = 0;
    bool mapped_ = false;  // pages of its own, else from the heap
    void* data_ = nullptr;
    std::size_t capacity_ = 0;
};

}  // namespace rapid
