#include "runtime/solver/estimate/varying_forces.h"

#include <numeric>
#include <type_traits>

namespace rapid {
namespace {

Linear half_of(const Linear& linear)
{
    return {0.5 * linear.k, 0.5 * linear.w2, 0.5 * linear.c, 0.5 * linear.ku, 0.5 * linear.w2q};
}

class VaryingForce : public Force {
public:
    VaryingForce(std::shared_ptr<const Force> before, std::shared_ptr<const Force> now, double middle)
        : Force(*now), before_(std::move(before)), now_(std::move(now)), middle_(middle)
    {
    }

    std::optional<Uniform> uniform() const override
    {
        const std::optional<Uniform> before = before_->uniform(), now = now_->uniform();
        if (!before || !now) return std::nullopt;
        Uniform mean{0.5 * (before->a + now->a), half_of(before->linear)};
        mean.linear.add(half_of(now->linear));
        return mean;
    }

    // Points that were born in the frame have sub-steps of their own: those of a chunk are taken together.
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        const double sum = std::accumulate(chunk.time.begin(), chunk.time.end(), 0.0);
        const Force& force = sum < middle_ * static_cast<double>(chunk.size()) ? *before_ : *now_;
        if (const std::optional<Uniform> uniform = force.uniform())
            forces.add(*uniform);
        else
            force.contribute(chunk, forces);
    }

private:
    std::shared_ptr<const Force> before_, now_;
    double middle_;  // s
};

}  // namespace

void VaryingForces::replace(const Dynamics& dynamics, const ForcesByNode& before, double middle)
{
    dynamics_.clear();
    dynamics.visit_in_order([&](const auto& dynamic) {
        if constexpr (std::is_same_v<std::decay_t<decltype(*dynamic)>, Force>) {
            const auto found = before.find(dynamic->node);
            if (forces_.count(dynamic->node) && found != before.end()) {
                dynamics_.add(std::make_shared<VaryingForce>(found->second, dynamic, middle));
                return;
            }
        }
        dynamics_.add(dynamic);
    });
}

}  // namespace rapid
