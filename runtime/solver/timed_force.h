// A force that changes within the step, given at evenly spaced times. Each substep uses the one nearest to its middle.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/dynamics.h"

namespace rapid {

class TimedForce : public Force {
public:
    // forces: at k h / (n - 1) after `begin` (s), k = 0 ... n - 1. less: an acceleration that is applied separately,
    // m/s².
    TimedForce(std::vector<std::shared_ptr<const Force>> forces, double begin, double h, const Vec3d& less);

    void contribute(const Chunk& chunk, Forces& forces) const override;
    bool add_potential(const Chunk&, std::span<double>) const override { return false; }

    // Returns the whole force at a time, s; nothing if it differs between points.
    std::optional<Uniform> uniform_at(double time) const;

private:
    std::size_t nearest(double time) const;
    void contribute(std::size_t k, const Chunk& chunk, Forces& forces) const;

    std::vector<std::shared_ptr<const Force>> forces_;
    double begin_, h_;  // s
    Vec3d less_;
};

}  // namespace rapid
