// Islands: points that fall asleep and wake as one, because what binds them passes on to all what one of them feels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rapid {

class Islands {
public:
    static constexpr std::uint32_t none = UINT32_MAX;

    // weight: inverse masses; a point without one parts what is tied to it, as a wall does.
    explicit Islands(std::span<const double> weight) : weight_(weight) {}

    // A row acts between these points.
    void bind(std::span<const std::uint32_t> points);
    // This one's place is given: it is bound, and no row moves it.
    void hold(std::uint32_t i);
    // All is said. Islands are in order of their first points.
    void close();

    std::size_t size() const { return begin_.size() - 1; }
    std::span<const std::uint32_t> operator[](std::size_t island) const  // ascending
    {
        return std::span(points_).subspan(begin_[island], begin_[island + 1] - begin_[island]);
    }
    bool binds(std::size_t i) const { return !root_.empty() && root_[i] != none; }
    bool holds(std::size_t i) const { return !held_.empty() && held_[i]; }

private:
    std::uint32_t root_of(std::uint32_t i);

    std::span<const double> weight_;
    std::vector<std::uint32_t> root_;  // a point nearer to the first of the island; none where nothing binds it
    std::vector<std::uint8_t> held_;
    std::vector<std::uint32_t> begin_{0}, points_;
};

}  // namespace rapid
