// The items for which random numbers are drawn: consecutive ones, or a selection from a range.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "runtime/math/random.h"

namespace rapid {

class Items {
public:
    // Creates the items first, first + 1, ...
    Items(std::uint64_t first) : first_(first) {}
    // Creates the items first + offsets[0], first + offsets[1], ...; the offsets must outlive them.
    Items(std::uint64_t first, const std::uint32_t* offsets) : first_(first), offsets_(offsets) {}

    std::uint64_t operator[](std::size_t i) const { return first_ + (offsets_ ? offsets_[i] : i); }
    bool are_consecutive() const { return !offsets_; }
    std::uint64_t first() const { return first_; }
    // Returns the items without the first n.
    Items from(std::size_t n) const { return offsets_ ? Items(first_, offsets_ + n) : Items(first_ + n); }

private:
    std::uint64_t first_;
    const std::uint32_t* offsets_ = nullptr;
};

// Computes uniform4(key, items[i], use) for each i, bit-identical.
void uniform4(RandomKey key, const Items& items, std::uint64_t use, std::span<std::array<double, 4>> out);

// Return a number uniform in [0, 1) with 53 bits, for one item or for several.
double uniform53(RandomKey key, std::uint64_t item, std::uint64_t use);
void uniform53(RandomKey key, std::span<const std::uint64_t> items, std::uint64_t use, std::span<double> out);

}  // namespace rapid
