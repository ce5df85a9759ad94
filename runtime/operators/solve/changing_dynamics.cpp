#include "runtime/operators/solve/changing_dynamics.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include "runtime/solver/changing.h"
#include "runtime/solver/placed_constraint.h"
#include "runtime/solver/timed_force.h"

namespace rapid {
namespace {

// A force that is the same for all points at all times.
class MeanAcceleration : public Force {
public:
    MeanAcceleration(const Force& force, const Vec3d& a) : Force(force), a_(a) {}
    void contribute(const Chunk&, Forces& forces) const override { forces.add_uniform(a_); }
    std::optional<Uniform> uniform() const override { return Uniform{a_}; }

private:
    Vec3d a_;
};

// The interaction at the ends of sub-steps.
class TimedInteraction : public Interaction {
public:
    TimedInteraction(std::vector<std::shared_ptr<const Interaction>> interactions, double begin, double h)
        : Interaction(*interactions.front()), interactions_(std::move(interactions)), begin_(begin), h_(h)
    {
    }
    const Interaction& at(double time) const override
    {
        const auto last = static_cast<double>(interactions_.size() - 1);
        const double k = std::clamp(std::round((time - begin_) / h_ * last), 0.0, last);
        return *interactions_[static_cast<std::size_t>(k)];
    }

private:
    std::vector<std::shared_ptr<const Interaction>> interactions_;
    double begin_, h_;  // s
};

// Adds a changing force to a chain. intervals: twice the sub-steps, so that their middles are among its times.
class Times {
public:
    Times(const SolveOptions& options, int intervals, bool finer, bool has_births)
        : options_(options), intervals_(intervals), finer_(finer), has_births_(has_births)
    {
    }

    void add(const ChangingForce& force, Dynamics& to) const
    {
        std::vector<std::shared_ptr<const Force>> forces(static_cast<std::size_t>(intervals_) + 1);
        for (int k = 1; k < intervals_; k += has_births_ ? 1 : 2) forces[static_cast<std::size_t>(k)] = at(force, k);
        // The ends are nobody's middle, and where all points take the same sub-steps no even time is.
        for (std::size_t k = 0; k < forces.size(); ++k)
            if (!forces[k]) forces[k] = forces[k + 1 < forces.size() ? k + 1 : k - 1];
        const Vec3d mean = mean_of(forces);
        if (!mean.isZero(0)) to.add(std::make_shared<MeanAcceleration>(force, mean));
        to.add(std::make_shared<TimedForce>(std::move(forces), begin(), options_.h, mean));
    }

    void add(const ChangingInteraction& interaction, Dynamics& to) const
    {
        std::vector<std::shared_ptr<const Interaction>> interactions;
        for (int k = 0; k <= intervals_; k += 2)
            interactions.push_back(interaction.at_part(static_cast<double>(k) / intervals_, finer_));
        to.add(std::make_shared<TimedInteraction>(std::move(interactions), begin(), options_.h));
    }

private:
    double begin() const { return options_.time - options_.h; }

    std::shared_ptr<const Force> at(const ChangingForce& force, int k) const
    {
        return force.at(static_cast<double>(k) / intervals_, finer_);
    }

    // What is uniform for all points is given as such as far as it can be: piles know by it where up is. 0 where it is
    // not uniform.
    static Vec3d mean_of(const std::vector<std::shared_ptr<const Force>>& forces)
    {
        Vec3d sum = Vec3d::Zero();
        for (const auto& force : forces) {
            const std::optional<Uniform> uniform = force->uniform();
            if (!uniform || !force->group.empty()) return Vec3d::Zero();
            sum += uniform->a;
        }
        return sum.allFinite() ? Vec3d(sum / static_cast<double>(forces.size())) : Vec3d(Vec3d::Zero());
    }

    const SolveOptions& options_;
    int intervals_;
    bool finer_, has_births_;
};

// A constraint with places that are functions of time; null where it has none.
std::shared_ptr<const Constraint> through_step(const ChangingConstraint& changing, bool finer)
{
    const std::shared_ptr<const Constraint> end = changing.at(1, finer);
    const auto* placed = dynamic_cast<const Placed*>(end.get());
    if (!placed) return nullptr;
    Placed::AtParts at;
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = changing.at(Placed::parts[k], finer);
    return placed->through(at);
}

Dynamics with(const Dynamics& dynamics, const Times& times, bool finer)
{
    Dynamics result;
    dynamics.visit_in_order([&]<class D>(const std::shared_ptr<const D>& dynamic) {
        if constexpr (std::is_same_v<D, Force>) {
            if (const auto* changing = dynamic_cast<const ChangingForce*>(dynamic.get()))
                return times.add(*changing, result);
        } else if constexpr (std::is_same_v<D, Interaction>) {
            if (const auto* changing = dynamic_cast<const ChangingInteraction*>(dynamic.get()))
                return times.add(*changing, result);
        } else if constexpr (std::is_same_v<D, Constraint>) {
            if (const auto* changing = dynamic_cast<const ChangingConstraint*>(dynamic.get())) {
                if (auto placed = through_step(*changing, finer)) return result.add(std::move(placed));
                if (finer) return result.add(changing->at(0.5, true));
            }
        }
        result.add(dynamic);
    });
    return result;
}

template <class Changing, class D>
bool any_of(const Dynamics::List<D>& list)
{
    return std::any_of(list.begin(), list.end(),
                       [](const auto& dynamic) { return dynamic_cast<const Changing*>(dynamic.get()) != nullptr; });
}

}  // namespace

void ChangingDynamics::note_colliders(const Dynamics& dynamics)
{
    colliders_.clear();
    for (const auto& collider : dynamics.colliders())
        colliders_.push_back(std::dynamic_pointer_cast<const ChangingCollider>(collider));
}

void ChangingDynamics::begin(const Dynamics& dynamics, const SolveOptions& options, int most_substeps, bool estimates,
                             bool has_births)
{
    any_ = any_of<ChangingForce>(dynamics.forces()) || any_of<ChangingInteraction>(dynamics.interactions()) ||
           any_of<ChangingConstraint>(dynamics.constraints()) || any_of<ChangingCollider>(colliders_);
    if (!any_) {
        run_ = finer_ = dynamics;
        return;
    }
    int substeps = options.substeps;
    while (substeps < most_substeps) substeps *= 2;
    // With a tolerance the middles of coarser runs lie between those of finer ones.
    const bool at_all = has_births || most_substeps > 0;
    run_ = with(dynamics, Times(options, 2 * substeps, false, at_all), false);
    if (!estimates) return;
    finer_ = with(dynamics, Times(options, 4 * substeps, true, at_all), true);
    for (std::size_t i = 0; i < colliders_.size(); ++i) {
        if (!colliders_[i]) continue;
        const std::shared_ptr<const Collider> middle = colliders_[i]->at(0.5, true);
        auto moving = std::make_shared<Collider>(*dynamics.colliders()[i]);
        moving->bounce = middle->bounce;
        moving->friction = middle->friction;
        moving->radius = middle->radius;
        finer_.replace_collider(i, std::move(moving));
    }
}

}  // namespace rapid
