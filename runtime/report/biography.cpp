#include "runtime/report/biography.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "runtime/points/id_index.h"
#include "runtime/points/members.h"

namespace rapid {
namespace {

// Returns true for the solver's own columns, which do not concern a point's life.
bool is_hidden(const std::string& name)
{
    return name == "id" || name == "dt" || name == "still" || name.starts_with("stuck");
}

PointValues values_of(const PointSet& points, std::size_t i)
{
    PointValues values;
    for (const auto& [name, column] : points.columns())
        if (!is_hidden(name)) values[name] = std::visit([&](const auto& c) { return AttributeValue(c[i]); }, column);
    for (const auto& [name, members] : points.groups())
        values[group_prefix + name] = static_cast<std::int32_t>(members[i]);
    return values;
}

bool same_bits(const AttributeValue& a, const AttributeValue& b)
{
    return a.index() == b.index() && std::visit(
                                         [&](const auto& x) {
                                             const auto& y = std::get<std::decay_t<decltype(x)>>(b);
                                             return std::memcmp(&x, &y, sizeof x) == 0;
                                         },
                                         a);
}

// Returns the acceleration of one point by one force, including its linear parts, m/s².
Vec3d acceleration_by(const Force& force, const PointSet& point, double begin, double h)
{
    std::array<Vec3d, 1> P = {point.P()[0].cast<double>()}, v = {point.v()[0].cast<double>()};
    const std::array<double, 1> dt = {h}, time = {begin + h / 2};
    Forces sum;
    sum.reset(1);
    if (const std::optional<Uniform> uniform = force.uniform())
        sum.add(*uniform);
    else
        force.contribute(Chunk{point, 0, P, v, dt, time, 0}, sum);
    Vec3d a = sum.acceleration(0);
    if (sum.has_linear()) {
        const Linear& linear = sum.linear(0);
        a += linear.ku - linear.k * v[0] + linear.w2q - linear.w2 * P[0] - linear.c * v[0].norm() * v[0];
    }
    if (sum.has_surface_springs() && sum.surface_spring(0).shape) {
        std::array<double, 1> distance{};
        std::array<Vec3d, 1> gradient{};
        sum.surface_spring(0).shape->distance(P, distance, gradient);
        a -= sum.surface_spring(0).w2 * distance[0] * gradient[0];
    }
    return a;
}

std::uint32_t find(const PointSet& points, std::int64_t id) { return IdIndex(points.id())[id]; }

}  // namespace

Biographer::Biographer(const Plan& plan, const std::vector<std::int64_t>& ids, const std::string& create)
    : plan_(plan), colliders_(plan.simulations.size())
{
    for (std::size_t i = 0; i < plan.nodes.size(); ++i) places_[plan.nodes[i].node.get()] = i;
    std::vector<std::string> names;
    for (std::size_t s = 0; s < plan.simulations.size(); ++s) {
        const std::string& name = plan.simulations[s].create->name;
        names.push_back(name);
        if (!create.empty() && create != name) continue;
        for (const std::int64_t id : ids) {
            followed_.push_back({{}, s, {}, {}, false});
            followed_.back().life.id = id;
            followed_.back().life.simulation = name;
        }
    }
    if (followed_.empty())
        throw Error(fmt::format("no create is called \"{}\"{}", create, did_you_mean(create, names)));
}

void Biographer::watch(Evaluator& evaluator)
{
    evaluator.watch_inputs(
        [this](const Node& node, const Frame& frame, std::span<const Flow> inputs) { enter(node, frame, inputs); });
}

Evaluator::ResultHook Biographer::results()
{
    return [this](const Node& node, std::int64_t, const PointSet& points) { leave(node, points); };
}

template <class F>
void Biographer::for_each_of(const Node& node, const F& f)
{
    const PlannedNode& planned = plan_.nodes[places_.at(&node)];
    if (planned.carries.size() > 1) return;  // ids of several simulations
    for (Followed& followed : followed_)
        if (followed.simulation == planned.simulation) f(followed);
}

void Biographer::enter(const Node& node, const Frame& frame, std::span<const Flow> inputs)
{
    const PlannedNode& planned = plan_.nodes[places_.at(&node)];
    for_each_of(node, [&](Followed& followed) {
        followed.before.reset();
        if (node.type->kind == NodeKind::Source) {
            Biography::Step& step = followed.steps.emplace_back();
            step.frame = static_cast<std::int64_t>(std::ceil(frame.number));
            step.time = frame.time;
            return;
        }
        for (std::size_t k = 0; k < planned.inputs.size(); ++k) {
            const std::uint32_t i = find(inputs[k].points, followed.life.id);
            if (i == IdIndex::none) continue;
            followed.before = values_of(inputs[k].points, i);
            if (node.type->kind == NodeKind::Solve && frame.time > 0) enter_solve(followed, node, frame, inputs[k], i);
            break;
        }
    });
    if (node.type->kind != NodeKind::Solve) return;
    std::vector<KnownCollider>& known = colliders_[planned.simulation];
    known.clear();
    for (const auto& collider : inputs[0].dynamics.colliders())
        known.push_back({collider->node, collider->response == Response::Die});
}

void Biographer::enter_solve(Followed& followed, const Node& node, const Frame& frame, const Flow& flow,
                             std::size_t i) const
{
    const std::uint32_t place = static_cast<std::uint32_t>(i);
    const PointSet point = flow.points.select({&place, 1});
    Biography::Step& step = followed.steps.back();
    for (const auto& force : flow.dynamics.forces()) {
        if (!members_of(point, force->group)[0]) continue;
        at_node(*force, [&] {
            step.forces.push_back({force->node, acceleration_by(*force, point, frame.time - frame.dt, frame.dt)});
        });
    }
    if (const auto* given = point.find<Vec3f>("force"); given && !(*given)[0].isZero(0))
        step.forces.push_back({"attribute force", (*given)[0].cast<double>() / masses_of(point)[0]});
    double after = 0.25;
    if (const auto sleep = node.arguments.find("sleep"); sleep != node.arguments.end())
        if (const double* seconds = sleep->second.get<double>()) after = *seconds;
    const auto* still = point.find<float>("still");
    step.asleep = still && (*still)[0] >= after && point.v()[0].isZero(0);
}

void Biographer::leave(const Node& node, const PointSet& points)
{
    const PlannedNode& planned = plan_.nodes[places_.at(&node)];
    const NodeKind kind = node.type->kind;
    if (kind == NodeKind::Dynamic) return;
    for_each_of(node, [&](Followed& followed) {
        const std::uint32_t i = find(points, followed.life.id);
        if (followed.steps.empty() || followed.life.death) return;
        Biography::Step& step = followed.steps.back();
        if (i == IdIndex::none) {
            if (!followed.alive) return;
            if (kind == NodeKind::Source)
                die(followed, node.name, "removed by an emitter of another chain");
            else if (followed.before && planned.in_loop && kind != NodeKind::Solve)  // Solve's record has the reasons
                die(followed, node.name, "removed by " + node.name);
            else if (followed.before && !planned.in_loop)
                step.edits.push_back({node.name, {}, true});
            return;
        }
        const PointValues now = values_of(points, i);
        if (planned.in_loop || !plan_.simulations[followed.simulation].solve) step.values = now;
        if (!followed.alive) return record_birth(followed, node.name);
        if (kind == NodeKind::Solve || kind == NodeKind::Source || !followed.before) return;
        Biography::Edit edit{node.name, {}};
        for (const auto& [name, value] : now) {
            const auto old = followed.before->find(name);
            if (old == followed.before->end())
                edit.changes[name] = {value, value};
            else if (!same_bits(old->second, value))
                edit.changes[name] = {old->second, value};
        }
        if (!edit.changes.empty()) step.edits.push_back(std::move(edit));
    });
}

void Biographer::record_birth(Followed& followed, const std::string& node) const
{
    const Biography::Step& step = followed.steps.back();
    followed.alive = true;
    followed.life.birth = {
        step.frame, step.time,        std::get<Vec3f>(step.values->at("P")), std::get<Vec3f>(step.values->at("v")),
        node,       "born in " + node};
}

void Biographer::die(Followed& followed, const std::string& node, std::string why) const
{
    const Biography::Step& step = followed.steps.back();
    Biography::Moment death{step.frame, step.time, Vec3f::Zero(), Vec3f::Zero(), node, std::move(why)};
    const PointValues* last = followed.before ? &*followed.before : nullptr;
    for (auto s = followed.life.steps.rbegin(); !last && s != followed.life.steps.rend(); ++s)
        if (s->values) last = &*s->values;
    if (last) {
        death.P = std::get<Vec3f>(last->at("P"));
        death.v = std::get<Vec3f>(last->at("v"));
    }
    followed.life.death = std::move(death);
    followed.steps.back().values.reset();
}

void Biographer::note_record(Followed& followed, const StepRecord& record, Biography::Step& step) const
{
    const std::int64_t id = followed.life.id;
    step.has_contacts = record.has_contacts;
    const std::vector<KnownCollider>& colliders = colliders_[followed.simulation];
    const std::uint32_t before = find(record.before, id);
    if (before != IdIndex::none) {
        // The time of birth, if the emitter provides it: a newborn moves for part of the step.
        const Column<float>* own = record.before.find<float>("dt");
        if (followed.life.birth && own && id >= record.first_new && followed.life.birth->time == step.time)
            followed.life.birth->time = record.time - std::min(record.h, double((*own)[before]));
        for (const LoggedHit& hit : record.hits)
            if (hit.point == before)
                step.contacts.push_back({colliders.at(static_cast<std::size_t>(hit.collider)).node, hit.time, hit.speed,
                                         hit.impulse, hit.P, hit.n});
    }
    const PlannedSimulation& simulation = plan_.simulations[followed.simulation];
    const auto die_of = [&](const PointSet& dead, const std::vector<double>& at, const std::string& node,
                            const std::string& why) {
        const std::uint32_t i = find(dead, id);
        if (i == IdIndex::none || followed.life.death) return;
        followed.life.death = {step.frame, at[i], dead.P()[i], dead.v()[i], node, why};
        step.values.reset();
    };
    if (const std::uint32_t i = find(record.killed, id); i != IdIndex::none) {
        const auto contact = std::find_if(step.contacts.begin(), step.contacts.end(), [&](const Biography::Contact& c) {
            return std::abs(c.time - record.killed_at[i]) <= 1e-9 * (1 + std::abs(c.time));
        });
        const bool by_collider =
            contact != step.contacts.end() && std::any_of(colliders.begin(), colliders.end(), [&](const auto& known) {
                return known.kills && known.node == contact->node;
            });
        const std::string node = by_collider ? contact->node : simulation.solve->name;
        die_of(record.killed, record.killed_at, node,
               by_collider ? "killed by contact with " + node : "killed by an action within " + node);
    }
    die_of(record.old, record.old_at, simulation.solve->name, "its life ended");
}

void Biographer::add(const FrameResult& result)
{
    for (Followed& followed : followed_) {
        const auto records = result.steps.find(followed.life.simulation);
        for (std::size_t k = 0; k < followed.steps.size(); ++k) {
            Biography::Step& step = followed.steps[k];
            if (records != result.steps.end() && k < records->second.size() && followed.life.birth)
                note_record(followed, records->second[k], step);
            const bool repeated = !followed.life.steps.empty() && followed.life.steps.back().time == step.time;
            const bool lives = step.values || (followed.life.death && followed.alive);
            if (lives && !repeated) followed.life.steps.push_back(std::move(step));
            if (followed.life.death) followed.alive = false;
        }
        followed.steps.clear();
    }
}

std::vector<Biography> Biographer::lives() const
{
    std::vector<Biography> lives;
    for (const Followed& followed : followed_)
        if (followed.life.birth) lives.push_back(followed.life);
    return lives;
}

}  // namespace rapid
