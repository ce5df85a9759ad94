#include "runtime/solver/changing.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rapid {
namespace {

// Adds the forces on some points of a chunk, from index `begin` on.
void add_part(const Forces& part, std::size_t size, std::size_t begin, Forces& to)
{
    for (std::size_t i = 0; i < size; ++i) {
        to.add(begin + i, part.acceleration(i));
        if (part.has_linear()) {
            const Linear& linear = part.linear(i);
            if (linear.k > 0) to.add_drag(begin + i, linear.k, linear.ku / linear.k);
            if (linear.w2 > 0) to.add_spring(begin + i, linear.w2, linear.w2q / linear.w2);
            if (linear.c > 0) to.add_quadratic_drag(begin + i, linear.c);
        }
        if (!part.has_surface_springs()) continue;
        if (part.surface_spring(i).w2 > 0) to.add_surface_spring(begin + i, part.surface_spring(i));
    }
}

}  // namespace

TimedForce::TimedForce(std::vector<std::shared_ptr<const Force>> forces, double begin, double h, const Vec3d& less)
    : Force(*forces.front()), forces_(std::move(forces)), begin_(begin), h_(h), less_(less)
{
}

// Points born in the frame have individual substeps.
void TimedForce::contribute(const Chunk& chunk, Forces& forces) const
{
    for (std::size_t begin = 0; begin < chunk.size();) {
        const std::size_t k = nearest(chunk.time[begin]);
        std::size_t end = begin + 1;
        while (end < chunk.size() && (chunk.time[end] == chunk.time[begin] || nearest(chunk.time[end]) == k)) ++end;
        const std::size_t size = end - begin;
        if (size == chunk.size()) return contribute(k, chunk, forces);
        const Chunk part{chunk.points,
                         chunk.first + begin,
                         chunk.P.subspan(begin, size),
                         chunk.v.subspan(begin, size),
                         chunk.dt.subspan(begin, size),
                         chunk.time.subspan(begin, size),
                         chunk.substep};
        Forces own;
        own.reset(size);
        contribute(k, part, own);
        add_part(own, size, begin, forces);
        begin = end;
    }
}

void TimedForce::contribute(std::size_t k, const Chunk& chunk, Forces& forces) const
{
    if (const std::optional<Uniform> uniform = forces_[k]->uniform())
        forces.add(*uniform);
    else
        forces_[k]->contribute(chunk, forces);
    if (!less_.isZero(0)) forces.add_uniform(-less_);
}

std::optional<Uniform> TimedForce::uniform_at(double time) const
{
    std::optional<Uniform> uniform = forces_[nearest(time)]->uniform();
    if (uniform) uniform->a -= less_;
    return uniform;
}

std::size_t TimedForce::nearest(double time) const
{
    const auto last = static_cast<double>(forces_.size() - 1);
    return static_cast<std::size_t>(std::clamp(std::round((time - begin_) / h_ * last), 0.0, last));
}

}  // namespace rapid
