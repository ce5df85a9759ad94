#include "runtime/points/spare_pages.h"

#include <sys/mman.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace rapid {
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
