// pin: holds points at a position, at one that each has as an attribute, or on a moving or deforming body. On a body,
// each point stays at its barycentric position and height over the nearest face.
//
// A rigidly pinned point is kinematic: its position and velocity are prescribed, and no other constraint moves it.
// With a compliance it is held by three springs, one along each axis.
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/points/id_index.h"
#include "runtime/points/members.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/mesh_surface.h"
#include "runtime/solver/changing.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "runtime/solver/constraints/rows.h"
#include "runtime/solver/constraints/sleep.h"

#include <map>

namespace rapid {
namespace {

struct PinTarget {
    static constexpr std::string_view param_type = place_type;

    std::optional<PerPoint<Vec3f>> place;
    MotionPtr motion;
    std::shared_ptr<const AnimatedMesh> deforming;
};

void read_value(const Param& param, const Value& value, PinTarget& target)
{
    target = {};
    if (value.is_nil()) return;
    if (auto shape = value.object<AnimatedShape>())
        target.motion = shape->motion();
    else if (auto body = value.object<DeformingLevelSet>())
        target.deforming = std::shared_ptr<const AnimatedMesh>(body, &body->mesh());
    else if (auto mesh = value.object<AnimatedMesh>(); mesh && mesh->deforms())
        target.deforming = mesh;
    else if (mesh)
        target.motion = mesh->motion();
    else
        read_value(param, value, target.place.emplace());
}

// Position at which a point is held; by id, over a run.
struct Pin {
    Vec3d from = Vec3d::Zero(), to = Vec3d::Zero();  // at the frame's beginning and end, m
    MaterialPoint on;                                // on a moving body
    Vec3d now = Vec3d::Zero(), v = Vec3d::Zero();    // in this substep: m, m/s
    bool taken = false;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(from, to, on.face, on.at, now, taken);
    }
};

struct Along {
    static constexpr int points = 1;
    static constexpr bool rests = true;  // PinCoupling handles moving targets
    const Pin* pin;                      // set by Pins
    int axis;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(axis);
        if constexpr (Archive::is_loading::value) StateReader::expect(0 <= axis && axis < 3);
    }

    double residual(const std::array<Vec3d, 1>& P, std::array<Vec3d, 1>& gradient) const
    {
        gradient[0] = Vec3d::Unit(axis);
        return P[0][axis] - pin->now[axis];
    }
    double rate() const { return -pin->v[axis]; }
};

struct Pins {
    Pins() = default;
    // The springs of a copy refer to its own pins.
    Pins(const Pins& other) : by_id(other.by_id), held(other.held), springs(other.springs) { attach_springs(); }
    Pins& operator=(const Pins&) = delete;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(by_id, held, springs);
        if constexpr (Archive::is_loading::value) attach_springs();
    }
    void attach_springs()
    {
        springs.for_each([&](const auto& ids, Along& along) {
            const auto pin = by_id.find(ids[0]);
            StateReader::expect(pin != by_id.end());
            along.pin = &pin->second;
        });
    }

    std::map<std::int64_t, Pin> by_id;  // addresses of pins are stable
    std::vector<std::int64_t> held;     // in the last frame
    Rows<Along> springs;                // if pins have a compliance
};

// A body that carries points through a step: by a motion, or by the faces of a mesh. Times are in seconds since the
// beginning of the step.
struct PinBody {
    std::shared_ptr<const MotionTrack> track;
    MovingBodyPtr surface;

    explicit operator bool() const { return track || surface; }

    MaterialPoint attach(const Vec3d& P) const
    {
        return surface ? surface->material_at(P, 0) : MaterialPoint{MaterialPoint::rigid, track->at(0).inverse() * P};
    }
    Vec3d place(const Pin& pin, double since) const
    {
        return surface ? surface->follow(pin.on, since).P : track->at(since) * pin.on.at;
    }
    Vec3d velocity(const Pin& pin, double since) const
    {
        return surface ? surface->follow(pin.on, since).v : track->velocity_at(since).at(pin.now);
    }
    bool moves() const
    {
        if (surface) return surface->moves();
        return track && std::any_of(track->pieces().begin(), track->pieces().end(), [](const auto& piece) {
                   return !(piece.only_translates() && piece.v.isZero(0) && piece.a.isZero(0));
               });
    }
};

// A position as a function of time, through a step: c0 + x (c1 + x (c2 + x c3)), with x from 0 to 1.
class PositionCurve {
public:
    // Interpolates positions at x = 0, 1/3, 2/3 and 1.
    explicit PositionCurve(const std::array<Vec3d, 4>& at)
        : c0_(at[0]),
          c1_(-5.5 * at[0] + 9 * at[1] - 4.5 * at[2] + at[3]),
          c2_(9 * at[0] - 22.5 * at[1] + 18 * at[2] - 4.5 * at[3]),
          c3_(-4.5 * at[0] + 13.5 * at[1] - 13.5 * at[2] + 4.5 * at[3])
    {
    }

    Vec3d at(double x) const { return c0_ + x * (c1_ + x * (c2_ + x * c3_)); }
    Vec3d slope(double x) const { return c1_ + x * (2 * c2_ + 3 * x * c3_); }

private:
    Vec3d c0_, c1_, c2_, c3_;
};

class PinCoupling : public Coupling, public Holding {
public:
    // compliance: m/N, 0 if pins are rigid; h: s, the frame's length.
    PinCoupling(std::shared_ptr<Pins> pins, PinBody body, std::optional<PositionCurve> curve, double compliance,
                double h)
        : pins_(std::move(pins)),
          body_(std::move(body)),
          curve_(std::move(curve)),
          compliance_(compliance),
          rigid_(compliance == 0),
          h_(h)
    {
    }

    void hold_at(std::size_t i, Pin& pin) { held_.push_back({i, &pin}); }
    void keep_awake(std::uint32_t i) { awake_.push_back(i); }  // its target moves, or it is newly held or released

    void join(Sleep* sleep) override
    {
        pins_->springs.join(sleep);
        if (!sleep) return;
        for (const std::uint32_t i : awake_) sleep->keep_awake(i);
        for (const auto& [i, pin] : held_)
            if (rigid_) sleep->make_kinematic(static_cast<std::uint32_t>(i));
    }
    bool has_forces() const override { return !rigid_; }
    bool is_driven() const override { return true; }
    void prescribe(std::span<std::uint8_t> points) const override
    {
        for (const auto& [i, pin] : held_)
            if (rigid_) points[i] = 1;
    }
    void add_stored_energy(const Substep& step, std::span<const Vec3d> at, double factor,
                           std::span<double> energy) const override
    {
        pins_->springs.add_stored_energy(step, at, factor, energy);
    }
    void link(EnergyIslands& islands) const override
    {
        pins_->springs.link(islands);
        for (const auto& [i, by] : drives_)
            if (rigid_)
                islands.move(i, by);
            else
                islands.drive(i, by);
    }
    void move_kinematic(Substep& step) override
    {
        pins_->springs.move_kinematic(step);  // with the previous targets
        const double since = (step.index + 1) * step.dt;
        aim(since, step.dt);
        if (!rigid_) return;
        for (const auto& [i, pin] : held_) {
            step.points[i] = {pin->now, 0};
            step.v[i] = pin->v;
        }
    }
    void advance(Substep& step) override { pins_->springs.advance(step); }
    void hold(Substep& step) override
    {
        loads_.clear();
        hold_moving(step);
    }
    void warm_start(Substep& step) override
    {
        with_own_masses(step, [&] { pins_->springs.warm_start(step); });
        hold_moving(step);  // includes sleepers that a shock has woken
        for (Load& load : loads_) load.v = step.v[load.i];
    }
    void project(Substep&) override {}  // handled through the masses of the points
    // Impulses of contacts also add the half of the velocity that moves no position by itself. For resolved springs
    // this uses the points' own mass, because the springs' reaction is already in their forces.
    void settle(Substep& step) override
    {
        for (const Load& load : loads_)
            if (load.is_resolved) step.v[load.i] += (load.own / load.held - 1) * (step.v[load.i] - load.v);
        with_own_masses(step, [&] { pins_->springs.settle(step); });
    }
    void solve_velocities(Substep& step) override
    {
        with_own_masses(step, [&] { pins_->springs.solve_velocities(step); });
    }
    void release(Substep& step) override
    {
        for (const Load& load : loads_) step.points[load.i].w = load.own;
    }
    void close(Substep& step, FrameFigures& figures) override { pins_->springs.close(step, figures); }

private:
    // A point on springs, with its own inverse mass and the one while it is held.
    struct Load {
        std::uint32_t i;
        double own, held;
        bool is_resolved;  // by the substep
        Vec3d v;           // m/s, at the start of the projection
    };

    void hold_moving(Substep& step)
    {
        if (rigid_) return;
        const std::size_t known = loads_.size();  // in the order of held_
        std::size_t next = 0;
        for (const auto& [index, pin] : held_) {
            const auto i = static_cast<std::uint32_t>(index);
            if (next < known && loads_[next].i == i) {
                ++next;
                continue;
            }
            const double own = step.points[i].w;
            if (!(own > 0) || !step.lives(i)) continue;
            const bool is_resolved = compliance_ >= own * step.dt * step.dt;
            const double held = 1 / (1 / own + 1 / softness_of(compliance_, is_resolved, step.dt));
            loads_.push_back({i, own, held, is_resolved, step.v[i]});
            step.points[i].w = held;
        }
    }
    template <class F>
    void with_own_masses(Substep& step, const F& f)
    {
        for (const Load& load : loads_) step.points[load.i].w = load.own;
        f();
        for (const Load& load : loads_) step.points[load.i].w = load.held;
    }
    void aim(double since, double dt)
    {
        drives_.clear();
        for (const auto& [i, pin] : held_) {
            const Vec3d v_before = velocity(*pin, since - dt);
            pin->now = place(*pin, since);
            pin->v = velocity(*pin, since);
            drives_.emplace_back(static_cast<std::uint32_t>(i), Drive::of(v_before, pin->v, dt));
        }
    }
    Vec3d place(const Pin& pin, double since) const
    {
        if (body_) return body_.place(pin, since);
        return curve_ ? curve_->at(since / h_) : Vec3d(pin.from + since / h_ * (pin.to - pin.from));
    }
    Vec3d velocity(const Pin& pin, double since) const
    {
        if (body_) return body_.velocity(pin, since);
        return (curve_ ? curve_->slope(since / h_) : Vec3d(pin.to - pin.from)) / h_;
    }

    std::shared_ptr<Pins> pins_;
    PinBody body_;
    std::optional<PositionCurve> curve_;
    double compliance_;  // m/N
    bool rigid_;
    double h_;  // s, the frame's length
    std::vector<Load> loads_;
    std::vector<std::pair<std::size_t, Pin*>> held_;
    std::vector<std::uint32_t> awake_;
    std::vector<std::pair<std::uint32_t, Drive>> drives_;  // in the substep
};

class PinConstraint : public RememberingConstraint<PinConstraint, Pins>, public Placed {
public:
    std::optional<PerPoint<Vec3f>> place;  // at the end of the step
    std::optional<PositionCurve> curve;    // if it is a function of time
    PinBody body;
    double compliance = 0;

    std::shared_ptr<const Constraint> through(const AtParts& at) const override
    {
        std::array<Vec3d, parts.size()> positions;
        for (std::size_t k = 0; k < at.size(); ++k) {
            const auto* pin = dynamic_cast<const PinConstraint*>(at[k].get());
            if (!pin || !pin->place || !pin->place->attribute.empty()) return nullptr;
            positions[k] = pin->place->constant.cast<double>();
        }
        auto result = std::make_shared<PinConstraint>(*this);
        const auto moves = [&](const Vec3d& to) { return to != positions[0]; };
        if (std::any_of(positions.begin(), positions.end(), moves)) result->curve.emplace(positions);
        return result;
    }

    std::shared_ptr<Coupling> begin(const PointSet& points, double h) const override
    {
        auto coupling = std::make_shared<PinCoupling>(memory, body, curve, compliance, h);
        const Strided<std::uint8_t> members = members_of(points, group);
        const Strided<Vec3f> P = points.P().read();
        const Strided<std::int64_t> id = points.id().read();
        const Strided<Vec3f> target = place ? place->read(points) : P;
        const bool moves = body.moves();
        std::vector<std::int64_t> held;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (!members[i]) continue;
            held.push_back(id[i]);
            Pin& pin = memory->by_id[id[i]];
            const Vec3d to = target[i].cast<double>();
            if (!pin.taken) {
                pin.from = pin.to = pin.now = curve ? curve->at(0) : to;
                if (body) pin.on = body.attach(to);
                for (int axis = 0; compliance > 0 && axis < 3; ++axis)
                    memory->springs.add({id[i]}, {&pin, axis}, compliance);
                pin.taken = true;
            } else if (place) {
                pin.from = pin.to;
            }
            if (body.surface && !body.surface->has(pin.on)) StateReader::fail();  // the pin was on another mesh
            if (place) pin.to = to;
            coupling->hold_at(i, pin);
            if (moves || curve || pin.from != pin.to) coupling->keep_awake(static_cast<std::uint32_t>(i));
        }
        memory->springs.follow(points, group);
        std::sort(held.begin(), held.end());
        if (held != memory->held) keep_changed_awake(*coupling, IdIndex(points.id()), held);
        const bool any = !held.empty() || !memory->held.empty();
        memory->held = std::move(held);
        return any ? coupling : nullptr;
    }

private:
    // Keeps points awake that are held in only one of two frames; their ids ascend.
    void keep_changed_awake(PinCoupling& coupling, const IdIndex& index, const std::vector<std::int64_t>& held) const
    {
        std::vector<std::int64_t> changed;
        std::set_symmetric_difference(held.begin(), held.end(), memory->held.begin(), memory->held.end(),
                                      std::back_inserter(changed));
        for (const std::int64_t id : changed)
            if (index[id] != IdIndex::none) coupling.keep_awake(index[id]);
    }
};

struct PinNode {
    PinTarget target;
    MotionPtr transform;
    double compliance;
    std::string group;

    static NodeType declare()
    {
        return node<PinNode>("pin", "Holds points at their initial position, at a target, or on a moving body.")
            .kind(NodeKind::Dynamic)
            .stage(Stage::Constraints)
            .takes("mass")
            .param(&PinNode::target, "target", Value(), any_number(), "m",
                   "position, rapid.attr, or moving shape or mesh that carries the points; the default is where a "
                   "point is first pinned")
            .param(&PinNode::transform, "transform", Value(), any_number(), "",
                   "motion that carries the points, a function of the frame that returns one, or keys by frame")
            .param(&PinNode::compliance, "compliance", 0.0, at_least(0), "m/N", "displacement per force; 0 is rigid")
            .constant();
    }

    void check() const
    {
        if (transform && (target.place || target.motion || target.deforming))
            throw Error("both target and transform are given; remove one of them");
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        auto pin = dynamic_of<PinConstraint>(now, group);
        pin->memory = pins_;
        pin->place = target.place;
        pin->compliance = compliance;
        const FrameClock clock = flow.simulation->clock();
        if (target.deforming)
            pin->body.surface = mesh_surface_in_step(*target.deforming, clock, clock.step_at(now.frame));
        if (const MotionPtr motion = transform ? transform : target.motion)
            pin->body.track = std::make_shared<MotionTrack>(
                *motion, clock, now.frame.number - 1.0 / flow.simulation->subframes, now.frame.number);
        flow.dynamics.add(std::move(pin));
        return flow;
    }

    static std::unique_ptr<Operator> make() { return stateful<PinNode>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(*pins_);
    }

private:
    std::shared_ptr<Pins> pins_ = std::make_shared<Pins>();
};
RAPID_NODE(PinNode);

}  // namespace
}  // namespace rapid
