#include "runtime/solver/solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <exception>
#include <mutex>
#include <numeric>

#include "runtime/parallel.h"
#include "runtime/points/members.h"
#include "runtime/points/point_text.h"
#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/constraints/projection.h"
#include "runtime/solver/motion/ballistic_batch.h"
#include "runtime/solver/motion/damped_motion.h"

namespace rapid {
namespace {

// Points that go through their sub-steps together: their state, paths and contacts stay in the first and second-level
// caches. A chunk of threads' work is several of these.
constexpr std::size_t block_size = 256;

const float unit_mass = 1;

// A force that has to be asked, or that acts on a group only.
struct LocalForce {
    const Force* force;
    std::optional<Uniform> uniform;
    Strided<std::uint8_t> members;
    bool all;
};

struct LocalAction {
    const Action* action;
    std::unique_ptr<ActionPass> pass;
};

// Whether an acceleration and this have a closed form for the whole frame.
bool is_closed_form(const Linear& linear) { return linear.w2 == 0 && linear.c == 0; }

// The column `force`, unless it is zero everywhere: then it needs no pass.
const Column<Vec3f>* forces_of(const PointSet& points)
{
    const auto* force = points.find<Vec3f>("force");
    const bool is_zero = force && force->is_uniform() && !points.empty() && (*force)[0].isZero();
    return is_zero ? nullptr : force;
}

// What the dynamics are for this set and frame.
struct Scene {
    std::vector<LocalAction> actions;
    Uniform uniform;  // force on all points
    std::vector<LocalForce> forces;
    std::vector<Obstacle> obstacles;
    std::vector<LocalConstraint> constraints;
    bool kills = false, records = false;  // one of them does
    const Column<Vec3f>* force = nullptr;
    Strided<float> mass{&unit_mass, 0};

    bool is_uniform() const { return forces.empty() && !force; }
    // Whether what moves points that are far from shapes has a closed form for the whole frame.
    bool falls() const { return is_uniform() && actions.empty() && is_closed_form(uniform.linear); }
};

// Adds the values, if all of them are finite; shapes [n].
bool add_finite(std::span<const Vec3d> values, std::span<Vec3d> to)
{
    const double* x = coordinates(values);
    double* y = coordinates(to);
    std::uint64_t largest = 0;
    for (std::size_t l = 0; l < 3 * values.size(); ++l)
        largest = std::max(largest, std::bit_cast<std::uint64_t>(x[l]) & 0x7fffffffffffffffu);
    if (largest >= 0x7ff0000000000000u) return false;
    for (std::size_t l = 0; l < 3 * values.size(); ++l) y[l] += x[l];
    return true;
}

// Finds its place in the scene for each dynamic, in the order of the chain: of several errors the first is thrown.
class SceneBuilder {
public:
    SceneBuilder(Scene& scene, const PointSet& points, double h) : scene_(scene), points_(points), h_(h) {}

    void operator()(const std::shared_ptr<const Force>& force) const
    {
        at_node(*force, [&] { add(*force); });
    }
    void operator()(const std::shared_ptr<const Collider>& collider) const
    {
        at_node(*collider, [&] { scene_.obstacles.emplace_back(*collider, points_); });
        scene_.kills |= collider->response == Response::Die;
        scene_.records |= collider->record.has_value();
    }
    void operator()(const std::shared_ptr<const Constraint>& constraint) const
    {
        at_node(*constraint, [&] {
            if (auto coupling = constraint->begin(points_, h_))
                scene_.constraints.push_back({constraint.get(), std::move(coupling)});
        });
    }
    void operator()(const std::shared_ptr<const Action>&) const {}       // prepared before
    void operator()(const std::shared_ptr<const Interaction>&) const {}  // interact()

private:
    void add(const Force& force) const
    {
        const std::optional<Uniform> uniform = force.uniform();
        if (uniform && !uniform->a.allFinite())
            throw Error(fmt::format("its acceleration is {{{:g}, {:g}, {:g}}}; it must be finite", uniform->a.x(),
                                    uniform->a.y(), uniform->a.z()));
        if (uniform && force.group.empty()) {
            scene_.uniform.a += uniform->a;
            scene_.uniform.linear.add(uniform->linear);
            return;
        }
        scene_.forces.push_back({&force, uniform, members_of(points_, force.group), force.group.empty()});
    }

    Scene& scene_;
    const PointSet& points_;
    double h_;
};

Scene scene_of(PointSet& set, const Dynamics& dynamics, double h)
{
    Scene scene;
    // First the actions, which make columns writable: what is read below then stays where it is in memory.
    for (const auto& action : dynamics.actions()) at_node(*action, [&] { action->prepare(set); });
    for (const auto& action : dynamics.actions())
        at_node(*action, [&] {
            if (auto pass = action->begin(set)) scene.actions.push_back({action.get(), std::move(pass)});
        });
    const PointSet& points = set;
    dynamics.visit_in_order(SceneBuilder(scene, points, h));
    scene.force = forces_of(points);
    if (points.has("mass")) scene.mass = points.column<float>("mass").read();
    return scene;
}

class Step {
public:
    Step(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Runs* runs)
        : points_(points),
          options_(options),
          runs_(runs),
          scene_(scene_of(points, dynamics, options.h)),
          P_(points.P().write()),
          v_(points.v().write()),
          dead_(scene_.actions.empty() && !scene_.kills ? 0 : points.size())
    {
        if (scene_.records) hits_.emplace(points, options.begins_frame);
        if (!options.group.empty()) members_ = members_of(points, options.group);
        time_.h = options.h;
        if (points.has("dt")) time_.own = points.column<float>("dt").read();
    }

    SolveResult run()
    {
        if (scene_.constraints.empty())
            for_all([&](std::size_t begin, std::size_t end) { advance(begin, end); });
        else
            advance_coupled();
        if (!runs_) bury();
        // Of doubles the order of a sum matters.
        std::stable_sort(energies_.begin(), energies_.end(),
                         [](const auto& a, const auto& b) { return a.first < b.first; });
        for (const auto& [begin, energy] : energies_) result_.contact_energy += energy;
        return result_;
    }

private:
    // Chunk by chunk. Of several errors that of the first chunk is thrown.
    template <class F>
    void for_all(const F& f)
    {
        const auto guarded = [&](std::size_t begin, std::size_t end) {
            try {
                f(begin, end);
            } catch (...) {
                const std::scoped_lock lock(mutex_);
                if (!error_ || begin < failed_) error_ = std::current_exception(), failed_ = begin;
            }
        };
        // A few points, as shadows are, are still work for all threads.
        const std::size_t n = points_.size(), part = block_size * (n / (16 * block_size) + 1);
        for_each_chunk(n, guarded, std::min(part, chunk_size));
        if (error_) std::rethrow_exception(error_);
    }

    void advance(std::size_t begin, std::size_t end)
    {
        std::vector<std::uint32_t> places;
        if (scene_.falls() && !members_.data && (!runs_ || runs_->takes_exact())) {
            const Fall::Way way = fall(begin, end, places);
            if (!way.finite) require_finite(begin, way.end, fell);
            require_finite(way.end, end, is);
            if (places.empty()) return;
        } else {
            require_finite(begin, end, is);
            places.resize(end - begin);
            std::iota(places.begin(), places.end(), static_cast<std::uint32_t>(begin));
        }
        advance_by_substeps(places);
    }

    // Those that are not near a shape at any time of the frame. The others are listed.
    Fall::Way fall(std::size_t begin, std::size_t end, std::vector<std::uint32_t>& near)
    {
        Fall fall(scene_.uniform.a + scene_.uniform.linear.ku, scene_.uniform.linear.k);
        for (const Obstacle& obstacle : scene_.obstacles) {
            float widest = 0;
            for (std::size_t i = begin; i < (obstacle.radius.stride ? end : begin + 1); ++i)
                widest = std::max(widest, obstacle.radius[i]);
            fall.avoid(obstacle.bounds, widest);
        }
        return fall.advance(P_, v_, time_, begin, end, near);
    }

    // Points of one chunk, in order; all of it where forces or actions act.
    void advance_by_substeps(std::span<const std::uint32_t> places)
    {
        Collisions counted(scene_.obstacles, consequences()), others(scene_.obstacles, consequences());
        Block block;
        const std::unique_ptr<BlockRuns> runs = runs_ ? runs_->begin() : nullptr;
        double deepest = 0;
        for (std::size_t begin = 0; begin < places.size(); begin += block_size) {
            const std::span at = places.subspan(begin, std::min(block_size, places.size() - begin));
            if (runs) runs->begin(at);
            deepest = std::max(deepest, advance(block, counted, at, options_.substeps));
            if (!runs) {
                store(block);
                continue;
            }
            int substeps = runs->take(end_of(block, counted));
            for (; substeps > 0; substeps = runs->take(end_of(block, others))) {
                if (!dead_.empty())
                    for (const std::uint32_t place : at) dead_[place] = 0;
                deepest = std::max(deepest, advance(block, others, at, substeps));
            }
        }
        count(counted, deepest, places.front());
    }

    // begin: a point of the chunk.
    void count(const Collisions& collisions, double deepest, std::size_t begin)
    {
        const std::scoped_lock lock(mutex_);
        result_.collisions += collisions.contacts;
        result_.contact_limit += collisions.limited;
        result_.trapped += collisions.trapped;
        result_.penetration_max = std::max(result_.penetration_max, deepest);
        if (collisions.energy != ContactEnergy()) energies_.emplace_back(begin, collisions.energy);
    }

    Consequences consequences()
    {
        return {hits_ ? &*hits_ : nullptr, dead_, options_.met, scene_.mass, options_.time, options_.h};
    }

    // All points take a sub-step, each by itself; then what couples them is projected.
    void advance_coupled()
    {
        const std::size_t n = points_.size();
        std::vector<Place> at(n);
        std::vector<Vec3d> v(n), begin(n);
        std::vector<double> weight(n);  // inverse masses, 1/kg
        for_all([&](std::size_t first, std::size_t last) {
            require_finite(first, last, is);
            for (std::size_t i = first; i < last; ++i) {
                weight[i] = at[i].w = inverse_mass(i);
                at[i].P = P_[i].cast<double>();
                v[i] = v_[i].cast<double>();
            }
        });

        const Column<std::int64_t>& ids = std::as_const(points_).id();
        Projection projection(scene_.constraints, scene_.obstacles, n);
        Substep now;
        now.at = at;
        now.v = v;
        now.begin = begin;
        now.dead = dead_;
        now.dt = options_.h / options_.substeps;
        now.iterations = options_.iterations;
        if (!scene_.uniform.a.isZero(0)) now.up = -scene_.uniform.a.normalized();
        std::vector<Yield> yields;
        if (!scene_.forces.empty() || !scene_.uniform.linear.is_zero()) {
            yields.assign(n, {now.dt, 0.5 * now.dt * now.dt});
            now.yields = yields;
        }
        projection.open(now, options_.loads, ids);
        Islands islands(weight);
        std::optional<Sleepers> sleepers;
        if (options_.beds && std::isfinite(options_.sleep) && points_.has("still")) {
            std::vector<std::uint8_t> tied(n);
            for (const LocalConstraint& local : scene_.constraints) {
                local.coupling->tie(tied);
                local.coupling->bind(islands);
            }
            islands.close();
            sleepers.emplace(points_, *options_.beds, weight, tied, islands, options_.sleep);
            now.sleepers = &*sleepers;
        }
        for (int substep = 0; substep < options_.substeps; ++substep) {
            now.index = substep;
            now.time = options_.time - now.dt * (options_.substeps - substep - 1);
            now.pull = 0;
            if (sleepers) sleepers->begin(now, scene_.obstacles);
            for_all([&](std::size_t first, std::size_t last) { take_all(now, begin, yields, weight, first, last); });
            if (!sleepers || !sleepers->all()) projection.advance(now);
        }
        if (sleepers) sleepers->unload();
        result_.residual = projection.close(now, options_.loads, ids);
        if (sleepers) sleepers->close(now, P_, time_);
        for_all([&](std::size_t first, std::size_t last) { round(now, first, last); });
        if (sleepers) {
            sleepers->remember(*options_.beds, points_, now, scene_.obstacles);
            result_.asleep = options_.beds->beds.size();
        }
    }

    // A point of no weight goes where it is bound to.
    void take_all(Substep& now, std::span<Vec3d> begin, std::span<Yield> yields, std::span<const double> weight,
                  std::size_t first, std::size_t last)
    {
        Collisions collisions(scene_.obstacles, consequences());
        Block block;
        double pull = 0;
        const std::size_t start = first;
        const bool leaves_out = now.sleepers && scene_.falls() && scene_.uniform.linear.is_zero();
        for (; first < last; first += block_size) {
            const std::size_t size = std::min(block_size, last - first);
            for (std::size_t i = first; i < first + size; ++i) begin[i] = now.at[i].P;
            if (leaves_out)
                block.begin(*this, first, size, [&](std::size_t i) { return leave_out(now, i); });
            else
                block.begin(*this, first, size);
            if (block.places.empty()) {
                pull = std::max(pull, scene_.uniform.a.norm());
                continue;
            }
            for (std::size_t k = 0; k < block.places.size(); ++k) {
                const std::uint32_t i = block.places[k];
                block.P[k] = now.at[i].P;
                block.v[k] = now.v[i];
                if (now.asleep(i)) block.way[k] = 0;
            }
            if (!scene_.obstacles.empty()) collisions.begin(block.places);
            take(block, collisions, now.index);
            // Others that they are put into are to be left without speed, as those that are born in one another.
            for (const auto& [k, by] : collisions.put_out()) begin[block.places[k]] += by;
            for (std::size_t k = 0; k < block.places.size(); ++k) {
                const std::uint32_t i = block.places[k];
                Place& at = now.at[i];
                at.w = weight[i];
                if (now.sleepers && !leaves_out) {
                    const bool asleep = now.asleep(i);
                    now.sleepers->feel(i, pull_on(block, k, begin[i], asleep));
                    if (asleep) {
                        at.w = 0;
                        continue;
                    }
                }
                if (!(at.w > 0)) {
                    if (!members_.data || members_[i]) at.P += block.dt[k] * now.v[i];
                    continue;
                }
                at.P = block.P[k];
                now.v[i] = block.v[k];
                if (!block.linear.data) continue;
                const Propagator by = respond(block.damped[k].k, block.damped[k].w2, now.dt);
                yields[i] = {by.v_of_G, by.x_of_G};
                at.w *= by.v_of_G / now.dt;
            }
            for (std::size_t k = 0; k < (block.a.stride ? block.places.size() : 1); ++k)
                pull = std::max(pull, block.a[k].norm());
        }
        count(collisions, 0, start);
        const std::scoped_lock lock(mutex_);
        now.pull = std::max(now.pull, pull);
    }

    // A sleeper that only what is the same everywhere pulls.
    bool leave_out(Substep& now, std::size_t i) const
    {
        now.sleepers->feel(i, scene_.uniform.a);
        if (!now.asleep(i)) return false;
        now.at[i].w = 0;
        return true;
    }

    // A drift that takes no time finds what each point lies on, to round it to the outer side of that.
    void round(const Substep& now, std::size_t first, std::size_t last)
    {
        Collisions collisions(scene_.obstacles, consequences());
        Block block;
        double deepest = 0;
        for (; first < last; first += block_size) {
            const std::size_t size = std::min(block_size, last - first);
            block.begin(*this, first, size);
            for (std::size_t i = 0; i < size; ++i) {
                block.P[i] = now.at[first + i].P;
                block.v[i] = now.v[first + i];
            }
            if (!scene_.obstacles.empty()) {
                block.dt.assign(size, 0);
                collisions.begin(block.places);
                collisions.advance(block.P, block.v, {{&scene_.uniform.a, 0}, block.dt, block.dt, {}});
                deepest = std::max(deepest, collisions.round(block.P, block.rounded));
                // A contact found in no time is none: the constraints have seen to it.
                for (std::size_t i = 0; i < size; ++i) block.v[i] = now.v[first + i];
            } else {
                cast(std::span<const Vec3d>(block.P), block.rounded);
            }
            require_finite(block);
            store(block);
        }
        const std::scoped_lock lock(mutex_);
        result_.penetration_max = std::max(result_.penetration_max, deepest);
    }

    double inverse_mass(std::size_t i) const
    {
        if (members_.data && !members_[i]) return 0;
        const float mass = scene_.mass[i];
        if (!(mass > 0))
            throw Error(
                fmt::format("{}: its mass is {:g}; with constraints it must be above 0 (:pin is for a point "
                            "that they do not move)",
                            name_of(i), mass));
        return 1.0 / mass;
    }

    // The state of a block within the frame.
    struct Block {
        std::span<const std::uint32_t> places;  // in the set
        std::vector<std::uint32_t> run;         // these, where they follow one another
        std::vector<Vec3d> P, v, middle;
        std::vector<Vec3f> rounded;  // P at the beginning of the frame, and at its end
        std::vector<double> dt, time, half, after;
        int substeps = 1;
        std::vector<double> way;  // s of dt that each is moved for: 0 for those that sleep
        std::vector<Vec3d> force;
        // Of the sub-step: the accelerations, and the linear parts, null where no force has one. Each is the scene's,
        // or the points' own.
        Strided<Vec3d> a{nullptr, 0};
        Strided<Linear> linear{nullptr, 0};
        std::vector<Vec3d> own_a;
        std::vector<Linear> own_linear;
        std::vector<Damped> damped;  // the ways of points with linear parts among shapes
        std::vector<double> rates;   // 1/s, of all drag
        DragPropagators dragged;
        Forces one;
        // Of the run, where somebody asks.
        std::vector<Way> ways;
        std::vector<double> put_off;  // m
        std::vector<std::uint8_t> dead;

        void begin(const Step& step, std::size_t first, std::size_t size)
        {
            run.resize(size);
            std::iota(run.begin(), run.end(), static_cast<std::uint32_t>(first));
            begin(step, run, step.options_.substeps);
        }

        template <class F>
        void begin(const Step& step, std::size_t first, std::size_t size, const F& leave_out)
        {
            run.clear();
            for (std::size_t i = first; i < first + size; ++i)
                if (!leave_out(i)) run.push_back(static_cast<std::uint32_t>(i));
            begin(step, run, step.options_.substeps);
        }

        void begin(const Step& step, std::span<const std::uint32_t> at, int number)
        {
            places = at;
            substeps = number;
            const std::size_t size = at.size();
            P.resize(size);
            v.resize(size);
            dt.resize(size);
            rounded.resize(size);
            for (std::size_t i = 0; i < size; ++i) {
                rounded[i] = step.P_[at[i]];
                P[i] = rounded[i].cast<double>();
                v[i] = step.v_[at[i]].cast<double>();
                dt[i] = step.time_(at[i]) / substeps;
            }
            way = dt;
        }

        // Points that are not of the group stay as they were.
        void restore_others(const Step& step)
        {
            for (std::size_t i = 0; i < P.size(); ++i) {
                if (step.members_[places[i]]) continue;
                P[i] = step.P_[places[i]].cast<double>();
                v[i] = step.v_[places[i]].cast<double>();
            }
        }

        void drift(std::span<const double> t)
        {
            for (std::size_t i = 0; i < P.size(); ++i) {
                P[i] += t[i] * (v[i] + 0.5 * t[i] * a[i]);
                v[i] += t[i] * a[i];
            }
        }

        void find_ways(std::span<const double> t)
        {
            damped.resize(P.size());
            Responder responder;
            for (std::size_t i = 0; i < P.size(); ++i)
                damped[i] = Damped::from(P[i], v[i], a[i], linear[i], t[i], responder);
        }

        void drift_damped(std::span<const double> t)
        {
            if (is_springless() && (linear.stride || linear[0].c > 0)) return drift_dragged(t);
            Responder responder;
            for (std::size_t i = 0; i < P.size(); ++i) {
                const Vec3d G = acceleration_at_rest(P[i], a[i], linear[i]);
                const Propagator& r = responder(drag_rate(v[i], G, linear[i], t[i]), linear[i].w2, t[i]);
                P[i] += v[i] * r.x_of_v + G * r.x_of_G;
                v[i] = v[i] * r.v_of_v + G * r.v_of_G;
            }
        }

        bool is_springless() const
        {
            for (std::size_t i = 0; i < (linear.stride ? P.size() : 1); ++i)
                if (linear[i].w2 > 0) return false;
            return true;
        }

        // The same, with the exponentials of all points at once. Quadratic drag goes as drag_rate() has it.
        void drift_dragged(std::span<const double> t)
        {
            const std::size_t size = P.size();
            const auto G = [&](std::size_t i) { return acceleration_at_rest(P[i], a[i], linear[i]); };
            rates.resize(size);
            bool quadratic = false;
            for (std::size_t i = 0; i < size; ++i) {
                rates[i] = linear[i].k;
                quadratic |= linear[i].c > 0;
            }
            if (quadratic) {
                for (std::size_t i = 0; i < size; ++i)
                    rates[i] = drag_rate_along(v[i].squaredNorm() > 0 ? v[i] : G(i), v[i], G(i), linear[i], t[i]);
                dragged.respond(rates, t);
                for (std::size_t i = 0; i < size; ++i) {
                    const Vec3d after_first = v[i] + (v[i] * dragged.v_of_v[i] + G(i) * dragged.x_of_v[i]);
                    rates[i] = drag_rate_along(after_first, v[i], G(i), linear[i], t[i]);
                }
            }
            dragged.respond(rates, t);
            for (std::size_t i = 0; i < size; ++i) {
                const Vec3d g = G(i);
                P[i] += v[i] * dragged.x_of_v[i] + g * dragged.x_of_G[i];
                v[i] = v[i] * dragged.v_of_v[i] + g * dragged.x_of_v[i];
            }
        }

        void halve()
        {
            half.resize(way.size());
            for (std::size_t i = 0; i < way.size(); ++i) half[i] = 0.5 * way[i];
        }

        // s from the end of a drift to that of the frame, so many half sub-steps later.
        std::span<const double> until_end(double halves)
        {
            after.resize(dt.size());
            for (std::size_t i = 0; i < dt.size(); ++i) after[i] = 0.5 * halves * dt[i];
            return after;
        }

        // The middle of each point's sub-step, s since the start.
        void set_time(const SolveOptions& options, int substep)
        {
            time.resize(dt.size());
            for (std::size_t i = 0; i < dt.size(); ++i) time[i] = options.time - dt[i] * (substeps - substep - 0.5);
        }
    };

    // Until what became of it is known to be finite, a point has what it had before: for the message.
    void require_finite(const Block& block) const
    {
        for (std::size_t i = 0; i < block.places.size(); ++i) {
            const Vec3f v = block.v[i].cast<float>();
            if (!block.rounded[i].allFinite() || !v.allFinite())
                not_finite(block.places[i], block.rounded[i], v, became);
        }
    }

    void store(const Block& block)
    {
        for (std::size_t i = 0; i < block.places.size(); ++i) {
            P_[block.places[i]] = block.rounded[i];
            v_[block.places[i]] = block.v[i].cast<float>();
        }
    }

    // What acts on a point in a sub-step, m/s²; on a sleeper, actions that move it and give it velocities, too.
    Vec3d pull_on(const Block& block, std::size_t k, const Vec3d& from, bool asleep) const
    {
        Vec3d a = block.a[k];
        if (block.linear.data) {
            const Linear& linear = block.linear[k];
            a += linear.ku + linear.w2q - linear.w2 * from;
        }
        const double dt = block.dt[k];
        if (asleep && dt > 0) a += block.v[k] / dt + (block.P[k] - from) / (dt * dt);
        return a;
    }

    // Takes a block through the frame; returns the deepest that one of its points is then in a shape, m.
    double advance(Block& block, Collisions& collisions, std::span<const std::uint32_t> places, int substeps)
    {
        block.begin(*this, places, substeps);
        if (!scene_.obstacles.empty()) collisions.begin(block.places);
        for (int substep = 0; substep < substeps; ++substep) take(block, collisions, substep);
        if (members_.data) block.restore_others(*this);
        double deepest = 0;
        if (!scene_.obstacles.empty())
            deepest = collisions.round(block.P, block.rounded);
        else
            cast(std::span<const Vec3d>(block.P), block.rounded);
        require_finite(block);
        return deepest;
    }

    // One sub-step of a block.
    void take(Block& block, Collisions& collisions, int substep)
    {
        add_forces(block, substep);
        const auto drift = [&](std::span<const double> dt, double halves_after) {
            if (!scene_.obstacles.empty() || !scene_.constraints.empty())
                drift_among_others(block, collisions, dt, halves_after);
            else if (block.linear.data)
                block.drift_damped(dt);
            else
                block.drift(dt);
        };
        if (scene_.kills) stop_dead(block);
        const double halves_after = 2.0 * (block.substeps - substep - 1);
        if (scene_.actions.empty()) {
            drift(block.way, halves_after);
        } else {
            // Half a drift, all actions at once, half a drift: of second order (numerics.md, Motion).
            block.halve();
            drift(block.half, halves_after + 1);
            act(block, substep);
            drift(block.half, halves_after);
        }
    }

    // What the way of a point is known by to shapes and to constraints.
    void drift_among_others(Block& block, Collisions& collisions, std::span<const double> dt, double halves_after)
    {
        block.damped.clear();
        if (block.linear.data) block.find_ways(dt);
        if (!scene_.obstacles.empty())
            collisions.advance(block.P, block.v, {block.a, dt, block.until_end(halves_after), block.damped});
        else if (block.linear.data)
            for (std::size_t i = 0; i < block.P.size(); ++i) {
                block.P[i] += block.damped[i].travel;
                block.v[i] = block.damped[i].v;
            }
        else
            block.drift(dt);
    }

    // Of the sub-step, constant within it: forces that are not the same everywhere are asked at its middle, half a
    // drift on, which makes them right to second order.
    void add_forces(Block& block, int substep)
    {
        block.a = {&scene_.uniform.a, 0};
        block.linear = {scene_.uniform.linear.is_zero() ? nullptr : &scene_.uniform.linear, 0};
        if (scene_.is_uniform()) return;
        const std::size_t size = block.P.size();
        block.own_a.assign(size, scene_.uniform.a);
        block.a = {block.own_a.data(), 1};
        if (scene_.force) add_force_attribute(block);
        if (scene_.forces.empty()) return;

        block.middle.resize(size);
        for (std::size_t i = 0; i < size; ++i) block.middle[i] = block.P[i] + 0.5 * block.dt[i] * block.v[i];
        block.set_time(options_, substep);
        const Chunk chunk{points_, block.places.front(), block.middle, block.v, block.dt, block.time, substep};
        for (const LocalForce& local : scene_.forces) {
            block.one.reset(size);
            if (local.uniform)
                block.one.add(*local.uniform);
            else
                at_node(*local.force, [&] { local.force->contribute(chunk, block.one); });
            const bool plain = local.all && !block.one.is_uniform() && block.one.uniform().isZero(0);
            if (!plain || !add_finite(block.one.accelerations(), block.own_a)) add_accelerations(block, local);
            if (!block.one.has_linear()) continue;
            if (block.linear.stride == 0) {
                block.own_linear.assign(size, scene_.uniform.linear);
                block.linear = {block.own_linear.data(), 1};
            }
            for (std::size_t i = 0; i < size; ++i)
                if (local.all || local.members[block.places[i]]) block.own_linear[i].add(block.one.linear(i));
        }
    }

    RunEnd end_of(Block& block, const Collisions& collisions) const
    {
        // On a parabola that has met nothing sub-steps would find the same: of drag the path between is no parabola.
        const Way unbroken = scene_.falls() && scene_.uniform.linear.is_zero() ? Way::Exact
                             : scene_.actions.empty()                          ? Way::Smooth
                                                                               : Way::Acted;
        block.ways.assign(block.places.size(), unbroken);
        block.put_off.assign(block.places.size(), 0);
        for (std::size_t i = 0; !scene_.obstacles.empty() && i < block.places.size(); ++i) {
            if (collisions.has_met(i)) block.ways[i] = Way::Broken;
            block.put_off[i] = collisions.put_off(i);
        }
        block.dead.clear();
        if (!dead_.empty())
            for (const std::uint32_t place : block.places) block.dead.push_back(dead_[place]);
        return {block.places, block.ways, block.put_off, block.dead, block.P, block.v, block.rounded, scene_.obstacles};
    }

    void add_accelerations(Block& block, const LocalForce& local) const
    {
        for (std::size_t i = 0; i < block.places.size(); ++i) {
            if (!local.all && !local.members[block.places[i]]) continue;
            const Vec3d a = block.one.acceleration(i);
            if (!a.allFinite())
                throw Error(
                    fmt::format(
                        "{}: its acceleration became {{{:g}, {:g}, {:g}}}; the frame was not written; it had {}",
                        name_of(block.places[i]), a.x(), a.y(), a.z(), text_of_point(points_, block.places[i])))
                    .in_node(local.force->node)
                    .at(local.force->location);
            block.own_a[i] += a;
        }
    }

    // Those that a collider has killed stay where they are.
    void stop_dead(Block& block) const
    {
        for (std::size_t i = 0; i < block.dt.size(); ++i)
            if (dead_[block.places[i]]) block.dt[i] = block.way[i] = 0;
    }

    // All actions, in the order of the chain, on the points where they are in the middle of the sub-step. The forces
    // that they add are kicks over the whole of it. The dead stay where they are.
    void act(Block& block, int substep)
    {
        const std::size_t size = block.P.size();
        block.set_time(options_, substep);
        block.force.assign(size, Vec3d::Zero());
        const std::span<std::uint8_t> dead(dead_.data() + block.places.front(), size);
        const Chunk chunk{points_, block.places.front(), block.P, block.v, block.dt, block.time, substep};
        for (const LocalAction& local : scene_.actions)
            at_node(*local.action, [&] { local.pass->act(chunk, block.force, dead); });
        for (std::size_t i = 0; i < size; ++i) {
            block.v[i] += block.dt[i] * acceleration_by(block.force[i], block.places[i]);
            if (dead[i]) block.dt[i] = block.way[i] = block.half[i] = 0;
        }
    }

    void add_force_attribute(Block& block)
    {
        for (std::size_t i = 0; i < block.P.size(); ++i)
            block.own_a[i] += acceleration_by((*scene_.force)[block.places[i]].cast<double>(), block.places[i]);
    }

    Vec3d acceleration_by(const Vec3d& force, std::size_t point) const
    {
        if (force.isZero(0)) return force;
        const float mass = scene_.mass[point];
        if (!(mass > 0) || !force.allFinite())
            throw Error(
                fmt::format("{}: a force of {{{:g}, {:g}, {:g}}} on a mass of {:g}; the force must be finite and the "
                            "mass above 0",
                            name_of(point), force.x(), force.y(), force.z(), mass));
        return force / mass;
    }

    void bury()
    {
        if (std::find(dead_.begin(), dead_.end(), 1) == dead_.end()) return;
        for (std::uint8_t& dead : dead_) dead = !dead;
        const std::size_t before = points_.size();
        points_.keep(dead_);
        result_.died = before - points_.size();
    }

    std::string name_of(std::size_t i) const
    {
        return fmt::format("point {}, frame {}", points_.id()[i], options_.frame);
    }

    struct When {
        const char *verb, *when, *had;
    };
    static constexpr When is{"is", "before the step; a node before this one made it so", "it has"};
    static constexpr When became{"became", "in the step; the frame was not written", "it had"};
    static constexpr When fell{"became", "in the step; the frame was not written", "it has"};  // what was is gone

    void require_finite(std::size_t begin, std::size_t end, const When& when) const
    {
        const std::size_t n = end - begin;
        if (all_finite(P_.subspan(begin, n)) && all_finite(v_.subspan(begin, n))) return;
        for (std::size_t i = begin; i < end; ++i)
            if (!P_[i].allFinite() || !v_[i].allFinite()) not_finite(i, P_[i], v_[i], when);
    }

    [[noreturn]] void not_finite(std::size_t i, const Vec3f& P, const Vec3f& v, const When& when) const
    {
        const auto [name, value] = P.allFinite() ? std::pair("v", v) : std::pair("P", P);
        throw Error(fmt::format("{}: {} {} {{{:g}, {:g}, {:g}}} {}; {} {}", name_of(i), name, when.verb, value.x(),
                                value.y(), value.z(), when.when, when.had, text_of_point(points_, i)));
    }

    PointSet& points_;
    const SolveOptions& options_;
    Runs* const runs_;  // null: a run is what becomes of the points
    const Scene scene_;
    std::span<Vec3f> P_, v_;
    OwnTime time_;
    Strided<std::uint8_t> members_{nullptr, 0};  // of the group that is advanced; null for all
    std::vector<std::uint8_t> dead_;             // 1: killed by an action or a collider; empty where none does
    std::optional<Hits> hits_;

    std::mutex mutex_;
    SolveResult result_;
    std::vector<std::pair<std::size_t, ContactEnergy>> energies_;  // by the chunk's first point
    std::exception_ptr error_;
    std::size_t failed_ = 0;  // the beginning of the chunk that the error is of
};

}  // namespace

bool is_closed_form(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options)
{
    if (!options.group.empty() || forces_of(points)) return false;
    if (!dynamics.actions().empty() || !dynamics.colliders().empty() || !dynamics.constraints().empty()) return false;
    return std::all_of(dynamics.forces().begin(), dynamics.forces().end(), [](const auto& force) {
        const std::optional<Uniform> uniform = force->uniform();
        return uniform && force->group.empty() && is_closed_form(uniform->linear);
    });
}

SolveResult solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options)
{
    RAPID_ASSERT(options.substeps >= 1 && std::isfinite(options.h) && options.h >= 0);
    if (points.empty()) return {};
    const SolveResult result = Step(points, dynamics, options, nullptr).run();
    if (auto* force = points.find<Vec3f>("force")) force->fill(Vec3f::Zero());
    return result;
}

SolveResult solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Runs& runs)
{
    RAPID_ASSERT(options.substeps >= 1 && std::isfinite(options.h) && options.h >= 0 && dynamics.constraints().empty());
    return points.empty() ? SolveResult() : Step(points, dynamics, options, &runs).run();
}

}  // namespace rapid
