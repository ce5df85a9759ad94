// The dynamics of a chain: forces, actions, colliders, constraints and interactions, which nodes add to the points that
// travel down it and Solve applies (paper §2.3). They change no point themselves, and Solve cannot tell a native one
// from a scripted one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/points/per_point.h"
#include "runtime/points/point_set.h"
#include "runtime/points/range.h"
#include "runtime/shapes/motion/motion.h"
#include "runtime/shapes/shape.h"
#include "runtime/solver/forces.h"

namespace rapid {

class Dynamic {
public:
    virtual ~Dynamic() = default;

    std::string node;                    // for messages
    Location location;                   // of the node, in the graph file
    std::string group;                   // acts only on the points of this group; on all if empty
    std::vector<AttributeRange> ranges;  // of the attributes that it reads
};

// Calls f, and adds the node of this dynamic to an Error that it throws.
template <class F>
void at_node(const Dynamic& dynamic, const F& f)
{
    try {
        f();
    } catch (Error& error) {
        error.in_node(dynamic.node).at(dynamic.location);
        throw;
    }
}

// A force: called once per substep for each chunk, from any thread.
class Force : public Dynamic {
public:
    virtual void contribute(const Chunk& chunk, Forces& forces) const = 0;

    // Returns the whole force if it is uniform; contribute() is then not called.
    virtual std::optional<Uniform> uniform() const { return std::nullopt; }

    // Adds the potential energy of the chunk's points, J/kg, up to a constant per point; shape [size]. Returns false
    // if the force has no potential, e.g. drag.
    virtual bool add_potential(const Chunk& chunk, std::span<double> energy) const
    {
        const std::optional<Uniform> force = uniform();
        if (!force || force->linear.k > 0 || force->linear.c > 0) return false;
        const Linear& linear = force->linear;
        for (std::size_t i = 0; i < chunk.size(); ++i)
            energy[i] += 0.5 * linear.w2 * chunk.P[i].squaredNorm() - (force->a + linear.w2q).dot(chunk.P[i]);
        return true;
    }
};

// The evaluation of an action in one step.
class ActionPass {
public:
    virtual ~ActionPass() = default;

    // Is called once per substep for each chunk, from any thread, with the points at their positions in the middle of
    // the substep. May change P and v, add to `force` (N, initially 0), write columns at chunk.first + i, and set
    // `dead` to 1 to kill points. All have shape [size].
    virtual void act(const Chunk& chunk, std::span<Vec3d> force, std::span<std::uint8_t> dead) = 0;
};

// An action operator (paper §2.3): changes points at every substep, inside Solve, while they are in cache.
class Action : public Dynamic {
public:
    // Is called before a step, on one thread. Makes the columns that act() writes writable.
    virtual void prepare(PointSet&) const {}
    // Is called after all actions of the step are prepared: columns no longer move in memory. Applies the current
    // `group`. Returns null if there is nothing to do.
    virtual std::unique_ptr<ActionPass> begin(PointSet& points) const = 0;
};

// The time at which contacts are found (numerics.md, Collision), and the response of the point.
enum class Method {
    Continuous,  // on its path, at the time of impact
    Backtrack,   // at the end of the step, moved back along its velocity (paper §4.2)
    Project,     // at the end of the step, moved out along the gradient (paper §4.1)
};
enum class Response { Bounce, Slide, Stick, Die };

class DeformingLevelSet;

class Collider : public Dynamic {
public:
    // The shape at rest; Solve replaces it in each frame with the moving shape.
    ShapePtr shape;
    std::shared_ptr<const DeformingLevelSet> deforming;  // replaces shape
    MotionPtr motion;                                    // null if it does not move as a whole
    std::optional<std::set<std::int64_t>> cuts;          // frames to which it jumps; detected if not given
    Method method = Method::Continuous;
    Response response = Response::Bounce;
    std::optional<double> record;    // m/s: contacts at least as fast are written to the hit attributes
    PerPoint<float> bounce{0.5f};    // restitution ε in [0, 1]
    PerPoint<float> friction{0.0f};  // Coulomb μ >= 0
    // For points that stick or slide. adhesion: m/s², the acceleration that tears a point off; default: unlimited for
    // points that stick. viscosity: 1/s, the rate at which the surface slows sliding points.
    std::optional<PerPoint<float>> adhesion;
    PerPoint<float> viscosity{0.0f};
    // Radius of the points; see step_context.h if not given.
    std::optional<PerPoint<float>> radius;
};

class Constraint;   // constraints/constraint.h
class Interaction;  // interaction.h

// The dynamics upstream of a node, sorted by type; each list is in the order of the chain.
class Dynamics {
public:
    template <class T>
    using List = std::vector<std::shared_ptr<const T>>;

    void add(std::shared_ptr<const Force> force) { add(forces_, std::move(force), Type::Force); }
    void add(std::shared_ptr<const Action> action) { add(actions_, std::move(action), Type::Action); }
    void add(std::shared_ptr<const Collider> collider) { add(colliders_, std::move(collider), Type::Collider); }
    void add(std::shared_ptr<const Constraint> constraint)
    {
        add(constraints_, std::move(constraint), Type::Constraint);
    }
    void add(std::shared_ptr<const Interaction> interaction)
    {
        add(interactions_, std::move(interaction), Type::Interaction);
    }
    // Adds the dynamics of another chain that are missing here: the two may share a part.
    void merge(const Dynamics& other)
    {
        other.visit_in_order([&](const auto& dynamic) {
            if (!contains(dynamic.get())) add(dynamic);
        });
    }
    void replace_collider(std::size_t i, std::shared_ptr<const Collider> by) { colliders_[i] = std::move(by); }
    void clear() { *this = {}; }

    const List<Force>& forces() const { return forces_; }
    const List<Action>& actions() const { return actions_; }
    const List<Collider>& colliders() const { return colliders_; }
    const List<Constraint>& constraints() const { return constraints_; }
    const List<Interaction>& interactions() const { return interactions_; }

    std::size_t size() const { return order_.size(); }
    bool empty() const { return order_.empty(); }

    // Calls `visit` with the pointer to each, in the order of the chain across all types, for errors and reports in
    // which the first one counts.
    template <class Visitor>
    void visit_in_order(const Visitor& visit) const
    {
        for (const auto [type, i] : order_) switch (type) {
                case Type::Force:
                    visit(forces_[i]);
                    break;
                case Type::Action:
                    visit(actions_[i]);
                    break;
                case Type::Collider:
                    visit(colliders_[i]);
                    break;
                case Type::Constraint:
                    visit(constraints_[i]);
                    break;
                case Type::Interaction:
                    visit(interactions_[i]);
                    break;
            }
    }

private:
    enum class Type : std::uint8_t { Force, Action, Collider, Constraint, Interaction };
    struct Entry {
        Type type;
        std::uint32_t index;  // in the list of its type
    };

    template <class T>
    void add(List<T>& list, std::shared_ptr<const T> dynamic, Type type)
    {
        order_.push_back({type, static_cast<std::uint32_t>(list.size())});
        list.push_back(std::move(dynamic));
    }
    bool contains(const void* dynamic) const
    {
        bool found = false;
        visit_in_order([&](const auto& own) { found |= own.get() == dynamic; });
        return found;
    }

    List<Force> forces_;
    List<Action> actions_;
    List<Collider> colliders_;
    List<Constraint> constraints_;
    List<Interaction> interactions_;
    std::vector<Entry> order_;  // of the chain
};

}  // namespace rapid
