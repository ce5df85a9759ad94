#include "runtime/report/biography.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "runtime/base/json.h"
#include "runtime/graph/evaluation.h"
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

// Biographies as text and as JSON.

namespace {

template <class V>
std::string text_of_vector(const V& x)
{
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", x.x(), x.y(), x.z());
}

std::string text_of(const AttributeValue& value)
{
    if (const auto* x = std::get_if<float>(&value)) return fmt::format("{:.6g}", *x);
    if (const auto* x = std::get_if<Vec3f>(&value)) return text_of_vector(*x);
    if (const auto* x = std::get_if<std::int32_t>(&value)) return std::to_string(*x);
    if (const auto* x = std::get_if<std::int64_t>(&value)) return std::to_string(*x);
    if (const auto* x = std::get_if<Token>(&value)) return fmt::format("\"{}\"", x->text());
    const Quatf& q = std::get<Quatf>(value);
    return fmt::format("({:.6g}, {:.6g}, {:.6g}, {:.6g})", q.x(), q.y(), q.z(), q.w());
}

void add_value(JsonText& json, const AttributeValue& value)
{
    if (const auto* text = std::get_if<Token>(&value)) return json.value(text->text());
    if (const auto* q = std::get_if<Quatf>(&value)) return json.value(q->coeffs());
    std::visit(
        [&]<class T>(const T& x) {
            if constexpr (!std::is_same_v<T, Token> && !std::is_same_v<T, Quatf>) json.value(x);
        },
        value);
}

void add_moment(JsonText& json, const char* name, const std::optional<Biography::Moment>& moment)
{
    if (!moment) return json.member(name, nullptr);
    json.key(name);
    json.object("frame", moment->frame, "time", moment->time, "P", moment->P, "v", moment->v, "node", moment->node,
                "why", moment->why);
}

void add_edit(JsonText& json, const Biography::Edit& edit)
{
    json.begin_object();
    json.member("node", edit.node);
    json.key("changes");
    json.begin_object();
    for (const auto& [name, values] : edit.changes) {
        json.key(name);
        json.object(
            "before", [&, &before = values.first] { add_value(json, before); }, "after",
            [&, &after = values.second] { add_value(json, after); });
    }
    json.end();
    json.member("removed", edit.removed);
    json.end();
}

void add_step(JsonText& json, const Biography::Step& step)
{
    json.begin_object();
    json.members("frame", step.frame, "time", step.time);
    json.key("values");
    if (step.values) {
        json.begin_object();
        for (const auto& [name, value] : *step.values) {
            json.key(name);
            add_value(json, value);
        }
        json.end();
    } else {
        json.value(nullptr);
    }
    json.list("edits", step.edits, [&](const Biography::Edit& edit) { add_edit(json, edit); });
    json.list("forces", step.forces,
              [&](const Biography::Force& force) { json.object("node", force.node, "acceleration", force.a); });
    json.list("contacts", step.contacts, [&](const Biography::Contact& contact) {
        json.object("node", contact.node, "time", contact.time, "P", contact.P, "normal", contact.normal, "speed",
                    contact.speed, "impulse", contact.impulse);
    });
    json.members("asleep", step.asleep, "contacts_known", step.has_contacts);
    json.end();
}

void add_life(JsonText& json, const Biography& life)
{
    json.begin_object();
    json.members("id", life.id, "simulation", life.simulation);
    add_moment(json, "birth", life.birth);
    add_moment(json, "death", life.death);
    json.list("steps", life.steps, [&](const Biography::Step& step) { add_step(json, step); });
    json.end();
}

std::string line_of(std::int64_t frame, double time, const std::string& what)
{
    return fmt::format("  {:>5}  {:>9.5f} s  {}\n", frame, time, what);
}

std::string text_of(const Biography::Edit& edit)
{
    if (edit.removed) return fmt::format("{} drops it from the output", edit.node);
    std::vector<std::string> changes;
    for (const auto& [name, values] : edit.changes)
        changes.push_back(text_of(values.first) == text_of(values.second)
                              ? fmt::format("{} = {}", name, text_of(values.second))
                              : fmt::format("{} {} -> {}", name, text_of(values.first), text_of(values.second)));
    return fmt::format("{}: {}", edit.node, fmt::join(changes, ", "));
}

std::string text_of(const Biography::Step& step, bool was_asleep)
{
    std::string text;
    for (const Biography::Edit& edit : step.edits) text += line_of(step.frame, step.time, text_of(edit));
    if (step.asleep != was_asleep) text += line_of(step.frame, step.time, step.asleep ? "sleeps" : "wakes up");
    for (const Biography::Force& force : step.forces)
        text += line_of(step.frame, step.time,
                        fmt::format("{} accelerates it by {} m/s²", force.node, text_of_vector(force.a)));
    for (const Biography::Contact& contact : step.contacts)
        text += line_of(
            step.frame, contact.time,
            fmt::format("meets {} at {}, normal {}, at {:.6g} m/s, impulse {:.6g} kg m/s", contact.node,
                        text_of_vector(contact.P), text_of_vector(contact.normal), contact.speed, contact.impulse));
    if (step.values)
        text += line_of(step.frame, step.time,
                        fmt::format("P = {}, v = {}", text_of(step.values->at("P")), text_of(step.values->at("v"))));
    return text;
}

std::string text_of(const Biography& life)
{
    std::string text = fmt::format("point {} of {}\n", life.id, life.simulation);
    text += line_of(
        life.birth->frame, life.birth->time,
        fmt::format("{} at {}, v = {}", life.birth->why, text_of_vector(life.birth->P), text_of_vector(life.birth->v)));
    bool asleep = false, unknown = false;
    for (const Biography::Step& step : life.steps) {
        text += text_of(step, asleep);
        asleep = step.asleep;
        unknown |= !step.has_contacts;
    }
    if (life.death)
        text += line_of(life.death->frame, life.death->time,
                        fmt::format("dies at {}: {}", text_of_vector(life.death->P), life.death->why));
    if (unknown) text += "  Contacts are unknown: with a tolerance, Solve repeats the step of a point.\n";
    return text;
}

}  // namespace

std::string to_text(const std::vector<Biography>& lives)
{
    std::string text;
    for (const Biography& life : lives) text += text_of(life);
    return text;
}

std::string to_json(const std::vector<Biography>& lives)
{
    JsonText json;
    json.begin_list();
    for (const Biography& life : lives) add_life(json, life);
    json.end();
    return json.text();
}

}  // namespace rapid
