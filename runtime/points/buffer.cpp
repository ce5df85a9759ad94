#include "runtime/points/buffer.h"

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <new>
#include <utility>

#include "runtime/points/column_files.h"

namespace rapid {
namespace {

constexpr std::size_t page = SparePages::page;
constexpr std::size_t line = 64;
// Blocks of at least this size get their own pages. Below it, mremap costs more than the copy that it saves.
constexpr std::size_t mapped_from = std::size_t{1} << 18;

// Returns an offset in the first page that is five cache lines larger for each new block.
std::size_t stagger()
{
    static std::atomic<std::size_t> serial{0};
    return line * (5 * serial.fetch_add(1, std::memory_order_relaxed) % (page / line));
}

std::size_t whole_pages(std::size_t bytes) { return (bytes + page - 1) / page * page; }

SparePages::Block new_pages(std::size_t bytes)
{
    if (void* in_file = map_in_file(bytes)) return {in_file, bytes};
    SparePages::Block block = SparePages::all().take(bytes);
    if (block.begin) return block;
    bytes = SparePages::room_for(bytes);
    block = {mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0), bytes};
    if (block.begin == MAP_FAILED) throw std::bad_alloc();
    madvise(block.begin, bytes, MADV_HUGEPAGE);
    return block;
}

// Source and destination of empty copies: memcpy does not accept a null pointer even for zero bytes.
alignas(line) std::byte no_bytes[line];

}  // namespace

Buffer::Buffer(Buffer&& other) noexcept
    : block_(std::exchange(other.block_, nullptr)),
      block_bytes_(std::exchange(other.block_bytes_, 0)),
      mapped_(std::exchange(other.mapped_, false)),
      data_(std::exchange(other.data_, nullptr)),
      capacity_(std::exchange(other.capacity_, 0))
{
}

Buffer& Buffer::operator=(Buffer&& other) noexcept
{
    if (this != &other) {
        release();
        new (this) Buffer(std::move(other));
    }
    return *this;
}

void Buffer::reserve(std::size_t bytes)
{
    if (!data_) data_ = no_bytes;
    if (bytes <= capacity_) return;
    if (bytes > max_bytes) throw std::bad_alloc();
    // Grows by half: untouched pages are free, and a column that is appended to every frame is rarely remapped.
    const std::size_t needed = capacity_ == 0 ? bytes : std::max(bytes, capacity_ + capacity_ / 2);

    if (mapped_) {
        const std::size_t offset = static_cast<char*>(data_) - static_cast<char*>(block_);
        const std::size_t grown = whole_pages(needed + offset);
        void* moved = block_;
        if (!resize_in_file(moved, block_bytes_, grown)) {
            moved = mremap(block_, block_bytes_, grown, MREMAP_MAYMOVE);
            if (moved == MAP_FAILED) throw std::bad_alloc();
            madvise(moved, grown, MADV_HUGEPAGE);
        }
        block_ = moved;
        block_bytes_ = grown;
        data_ = static_cast<char*>(moved) + offset;
        capacity_ = grown - offset;
        return;
    }

    Buffer grown;
    if (needed >= mapped_from) {
        const std::size_t offset = stagger();
        // Reserves a page more than the values need, whatever their offset, so that buffers of one size can reuse each
        // other's pages.
        const SparePages::Block pages = new_pages(whole_pages(needed) + page);
        grown.block_ = pages.begin;
        grown.block_bytes_ = pages.bytes;
        grown.mapped_ = true;
        grown.data_ = static_cast<char*>(grown.block_) + offset;
        grown.capacity_ = grown.block_bytes_ - offset;
    } else {
        grown.block_bytes_ = (needed + line - 1) / line * line;
        grown.block_ = std::aligned_alloc(line, grown.block_bytes_);
        if (!grown.block_) throw std::bad_alloc();
        grown.data_ = grown.block_;
        grown.capacity_ = grown.block_bytes_;
    }
    if (capacity_ > 0) std::memcpy(grown.data_, data_, capacity_);
    *this = std::move(grown);
}

void Buffer::give_up(std::size_t bytes)
{
    data_ = static_cast<char*>(data_) + bytes;
    capacity_ -= bytes;
}

void Buffer::take_back()
{
    // The offset in a page stays, rounded down to a cache line.
    const std::size_t back = given_up() - (mapped_ ? given_up() % page / line * line : 0);
    data_ = static_cast<char*>(data_) - back;
    capacity_ += back;
}

void Buffer::release()
{
    if (mapped_ && unmap_in_file(block_, block_bytes_)) return;
    if (mapped_)
        SparePages::all().give({block_, block_bytes_});
    else
        std::free(block_);
}

namespace {

constexpr std::size_t max_spare_bytes = std::size_t{1} << 26;
constexpr std::size_t max_block_bytes = max_spare_bytes / 4;

void unmap(SparePages::Block block)
{
    if (block.begin) munmap(block.begin, block.bytes);
}

}  // namespace

SparePages& SparePages::all()
{
    static auto* pages = new SparePages;  // leaked, because static buffers may outlive static objects
    return *pages;
}

void SparePages::keep(std::size_t blocks)
{
    const std::lock_guard lock(mutex_);
    blocks_.resize(std::max(blocks, blocks_.size()));
}

std::size_t SparePages::room_for(std::size_t bytes)
{
    const std::size_t step = std::max(std::bit_floor(bytes) / 4, page), room = (bytes + step - 1) / step * step;
    return room <= max_block_bytes ? room : bytes;
}

SparePages::Block SparePages::take(std::size_t bytes)
{
    const std::lock_guard lock(mutex_);
    Block* smallest = nullptr;
    for (Block& block : blocks_)
        if (block.bytes >= bytes && block.bytes / 2 <= bytes && (!smallest || block.bytes < smallest->bytes))
            smallest = &block;
    if (!smallest) return {};
    bytes_ -= smallest->bytes;
    return std::exchange(*smallest, {});
}

void SparePages::give(Block block)
{
    if (block.bytes > max_block_bytes) return unmap(block);
    const std::lock_guard lock(mutex_);
    bytes_ += block.bytes;
    const auto empty = std::find_if(blocks_.begin(), blocks_.end(), [](const Block& b) { return !b.begin; });
    if (empty != blocks_.end()) std::swap(block, *empty);
    while (block.begin || bytes_ > max_spare_bytes) {  // evicts blocks in turn
        std::swap(block, blocks_[next_]);
        next_ = (next_ + 1) % blocks_.size();
        bytes_ -= block.bytes;
        unmap(std::exchange(block, {}));
    }
}

}  // namespace rapid
