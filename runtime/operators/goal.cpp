// goal: each point travels to a target position, arrives at rest when its time is over, and then follows the target.
//
//   P(u) = P + d (3u² - 2u³) + v T (u - 2u² + u³)            d = to - P;  T: the time that is left;  u = t / T
//
// The cubic from the point's current position and velocity to rest at the target is recomputed at each frame. Without
// other forces it stays the same, and the effect of another force before the last frame is corrected. A moving target
// is aimed at in its position at the end of the frame. A kick and a constant acceleration take Solve to the cubic's
// position and velocity at the frame's end. A held point moves uniformly with its target through the frame, and has
// its velocity. A force that acts in the last frame, or on a held point, moves it by a dt²/2.
#include <algorithm>
#include <optional>

#include "runtime/base/parallel.h"
#include "runtime/graph/node.h"
#include "runtime/operators/goal/goal_target.h"
#include "runtime/points/members.h"
#include "runtime/points/per_point.h"

namespace rapid {
namespace {

constexpr std::uint64_t stagger_use = 26;

struct Goal {
    GoalTarget to;
    std::string by, clock, group;
    double start, time, stagger;
    bool hold;

    static NodeType declare()
    {
        return node<Goal>("goal", "Moves points to target positions in a given time.")
            .varies()  // with the time since its start
            .reads("P")
            .writes("v")
            .takes("mass")
            .param(&Goal::to, "to", Value(), any_number(), "",
                   "targets: a mesh, a shape or points, which may move, or a vec3 attribute, rapid.attr \"NAME\"")
            .required()
            .param(&Goal::by, "by", "id", any_number(), "",
                   "choice of the target: by the id of a point or vertex, at random, or the nearest (of points, the "
                   "nearest that is free)")
            .choices({"id", "nearest", "random"})
            .constant()
            .param(&Goal::start, "start", 0.0, any_number(), "s", "time at which points begin to move")
            .param(&Goal::time, "time", 1.0, at_least(1e-6), "s", "time that each point takes")
            .param(&Goal::stagger, "stagger", 0.0, at_least(0), "s", "maximum random delay of a point's start")
            .param(&Goal::clock, "clock", "scene", any_number(), "",
                   "clock of start: the time of the scene, or the age of the point")
            .choices({"scene", "age"})
            .constant()
            .param(&Goal::hold, "hold", true, any_number(), "", "keeps points at their targets after they arrive");
    }

    void uses(Uses& uses) const
    {
        uses.reads.push_back("force");
        uses.writes.push_back("force");
        if (clock == "age") uses.reads.push_back("age");
        if (!to.object) {
            uses.reads.push_back(to.attribute);
            return;
        }
        uses.makes.push_back({"goal", Vec3f(Vec3f::Zero())});
        uses.reads.push_back("goal");
        uses.writes.push_back("goal");
        if (!to.is_taken(by)) return;
        uses.makes.push_back({goal_number, std::int64_t{-1}});
        uses.reads.push_back(goal_number);
        uses.writes.push_back(goal_number);
    }

    void check() const
    {
        if (to.object) GoalPositions(to, by);
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        PointSet& points = flow.points;
        const Strided<std::uint8_t> members = members_of(points, group);
        std::optional<Column<Vec3f>> positions_before;
        if (to.object) positions_before = find_positions(points, members, flow.simulation->clock(), now);
        const Strided<Vec3f> goal = std::as_const(points).column<Vec3f>(to.object ? "goal" : to.attribute).read();
        const Strided<std::int64_t> id = std::as_const(points).id().read();
        const Strided<Vec3f> P = std::as_const(points).P().read();
        const Strided<float> mass = masses_of(points);
        const Column<float>* own = std::as_const(points).find<float>("dt");
        const Column<float>* age = clock == "age" ? &std::as_const(points).column<float>("age") : nullptr;
        flow.simulation->arrivals[this] = [this, frame = now.frame, random = now.random](const PointSet& set,
                                                                                         std::size_t i) {
            const Column<float>* own_dt = set.find<float>("dt");
            const double dt = own_dt ? double{(*own_dt)[i]} : frame.dt;
            const double time_of_point = clock == "age" ? double{set.column<float>("age")[i]} : frame.time - dt;
            const std::optional<double> left = time_left(time_of_point - start - delay(random, set.id()[i]), dt);
            return members_of(set, group)[i] && left && *left <= dt;
        };
        const std::span<Vec3f> v = points.v().write(), force = points.column<Vec3f>("force").write();
        for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                if (!members[i]) continue;
                const double dt = own ? double{(*own)[i]} : now.frame.dt;
                const double since = (age ? double{(*age)[i]} : now.frame.time - dt) - start - delay(now.random, id[i]);
                const std::optional<double> left = time_left(since, dt);
                if (!left) continue;
                const Vec3d at = P[i].cast<double>(), d = goal[i].cast<double>() - at;
                // A point that was at its target moves with it: the target's velocity is that of the path through the
                // frame.
                const bool is_held = *left <= 1e-6 * time && positions_before &&
                                     (at - (*positions_before)[i].cast<double>()).norm() <= 1e-3 * d.norm();
                move_towards(d, *left, dt, double{mass[i]}, is_held ? Vec3d(d / dt) : Vec3d::Zero(), v[i], force[i]);
            }
        });
        return flow;
    }

private:
    // Returns the delay of a point, s.
    double delay(RandomKey random, std::int64_t id) const
    {
        return stagger * uniform4(random, static_cast<std::uint64_t>(id), stagger_use)[0];
    }

    // Returns the remaining time, s, from the beginning of the frame. A path that begins within the frame starts with
    // it, and ends on time. Returns nothing if the point is not on its path.
    std::optional<double> time_left(double since, double dt) const
    {
        // dt is a float: do not start a path that begins with the next frame.
        if (!(dt > 0) || since + dt <= 1e-4 * dt) return std::nullopt;
        const double left = time - std::max(since, 0.0);
        if (left <= 1e-6 * time && !hold) return std::nullopt;
        return left;
    }

    // d: from the point to its target; there: its velocity when its time is over.
    static void move_towards(const Vec3d& d, double left, double dt, double mass, const Vec3d& there, Vec3f& v,
                             Vec3f& force)
    {
        const double u = left > dt ? dt / left : 1;
        const Vec3d before = v.cast<double>();
        Vec3d displacement = d * (u * u * (3 - 2 * u)), after = there;
        if (u < 1) {
            displacement += before * (dt * (1 - u) * (1 - u));
            after = d * (6 * u * (1 - u) / left) + before * ((1 - u) * (1 - 3 * u));
        }
        v = (displacement * (2 / dt) - after).cast<float>();
        force += ((after - v.cast<double>()) * (mass / dt)).cast<float>();
    }

    // Finds the target positions, and returns those of the previous frame.
    Column<Vec3f> find_positions(PointSet& points, Strided<std::uint8_t> members, const FrameClock& of,
                                 const Evaluation& now)
    {
        if (known_ != to.object) {
            known_ = to.object;
            positions_ = GoalPositions(to, by);
        }
        points.add({"goal", Vec3f(Vec3f::Zero())});
        if (to.is_taken(by)) points.add({goal_number, std::int64_t{-1}});
        const Column<Vec3f> before = points.column<Vec3f>("goal");
        Column<Vec3f> column = before;
        positions_->find(points, members, of, now, column.write());
        points.set("goal", std::move(column));
        return before;
    }

    // A cache for the target of the last frame.
    ObjectPtr known_;
    std::optional<GoalPositions> positions_;
};
RAPID_NODE(Goal);

}  // namespace
}  // namespace rapid
