// A subset of the points, chosen by id: a part of a run, or a sample.
//
// Membership depends on the id alone. Part k of n contains the ids with floor(n h(id) / 2^64) = k, where h is a 64-bit
// hash: the parts are disjoint and cover all points. A sample of fraction f contains the ids with h'(id) < 2^64 f,
// where h' is another hash: a larger sample contains a smaller one, and the parts of a sample are as even as the parts
// of the whole.
#pragma once

#include <cmath>
#include <cstdint>

namespace rapid {

class Subset {
public:
    Subset() = default;
    // Part `number` of `count`, counted from 1. sample: fraction of the points, above 0 and at most 1.
    Subset(int number, int count, double sample = 1)
        : is_all_(count == 1 && sample == 1),
          samples_(sample < 1),
          number_(static_cast<std::uint64_t>(number - 1)),
          count_(static_cast<std::uint64_t>(count)),
          limit_(samples_ ? static_cast<std::uint64_t>(std::ldexp(sample, 64)) : 0)
    {
    }

    bool is_all() const { return is_all_; }

    bool has(std::int64_t id) const
    {
        const auto bits = static_cast<std::uint64_t>(id);
        if (samples_ && hash(bits ^ 0x2545f4914f6cdd1dull) >= limit_) return false;
        return count_ == 1 || part_of(id, count_) == number_;
    }

    // Returns the part, from 0, that contains an id.
    static std::uint64_t part_of(std::int64_t id, std::uint64_t count)
    {
        return static_cast<std::uint64_t>(
            static_cast<unsigned __int128>(hash(static_cast<std::uint64_t>(id))) * count >> 64);
    }

    bool operator==(const Subset&) const = default;

private:
    // Applies the finaliser of SplitMix64 (Steele, Lea and Flood 2014), a bijection.
    static std::uint64_t hash(std::uint64_t bits)
    {
        bits += 0x9e3779b97f4a7c15ull;
        bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9ull;
        bits = (bits ^ bits >> 27) * 0x94d049bb133111ebull;
        return bits ^ bits >> 31;
    }

    bool is_all_ = true, samples_ = false;
    std::uint64_t number_ = 0, count_ = 1, limit_ = 0;
};

}  // namespace rapid
