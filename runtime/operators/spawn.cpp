// spawn: emits children from the points of another node, their parents, at times and positions on the parents' paths.
//
// Each parent emits along its path through the frame (spawn/parent_paths.h), by its rate and count, or at an event
// (spawn/offspring.h). Parents of another simulation, which is evaluated first, have their path in this frame.
// Parents of the same simulation move later in the frame, and emit along their path of the previous frame.
//
// A birth's random numbers depend on the seed, on the name of this node and on the birth's number among those of its
// parent. Unnamed nodes are numbered together with those of emit, because spawn was once part of emit: scenes written
// for it keep their random numbers.
#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/memory_budget.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/error_sources.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/stateful.h"
#include "runtime/operators/spawn/offspring.h"
#include "runtime/points/id_index.h"

namespace rapid {
namespace {

// Throws Error if the newborn points, plus a copy of the existing ones, do not fit in memory.
void require_room(const PointSet& points, const std::vector<Children>& all_children)
{
    if (all_children.empty()) return;
    const std::size_t n = all_children.back().first + all_children.back().count;
    const double bytes = static_cast<double>(n) * bytes_per_birth + static_cast<double>(points.bytes());
    if (fits_in_memory(bytes)) return;
    throw memory_exceeded(fmt::format("{} births in a frame from {} parents, in addition to {} points,", n,
                                      all_children.size(), points.size()),
                          bytes, "give a smaller rate or count, or a limit");
}

bool emits(const BirthPlan& plan)
{
    const auto is_positive = [](const auto& amount) { return !amount.attribute.empty() || amount.value > 0; };
    if (plan.rate) return is_positive(*plan.rate);
    return plan.count ? is_positive(*plan.count) : plan.on.has_value();
}

// Returns one birth of a living parent, for a trial, in which no point moves and no event occurs.
std::vector<Children> sample_of(const ParentPaths& parents)
{
    for (std::uint32_t i = 0; i < parents.size(); ++i) {
        if (!parents[i].takes_part || !parents[i].is_alive) continue;
        Children children{};
        children.parent = i;
        children.hit = Children::no_hit;
        children.count = 1;
        children.begin = children.end = parents[i].end;
        return {children};
    }
    return {};
}

// Removes points of this chain immediately. The evaluator removes those of another chain, from all sets not yet taken.
void remove_parents(Flow& flow, const Flow& from, const ParentPaths& parents, const std::vector<Children>& all_children,
                    const Evaluation& now)
{
    if (from.simulation != flow.simulation) {
        for (const Children& children : all_children)
            if (parents[children.parent].is_alive)
                from.simulation->condemned.push_back(parents.id(parents[children.parent]));
        return;
    }
    std::vector<std::uint8_t> keep(flow.points.size(), 1);
    const IdIndex index(std::as_const(flow.points).id());
    for (const Children& children : all_children)
        if (const std::uint32_t i = index[parents.id(parents[children.parent])]; i != IdIndex::none) keep[i] = 0;
    now.figures.died += static_cast<std::uint64_t>(std::count(keep.begin(), keep.end(), 0));
    flow.points.keep(keep);
}

struct Spawn : Newborn {
    std::shared_ptr<const NodeHandle> from;
    std::string source_group;
    std::optional<Amount<double>> rate;
    std::optional<Amount<int>> count;
    std::optional<BirthEvent> on;
    std::optional<double> min_speed, limit;
    std::vector<std::string> inherit;
    double inherit_velocity;
    bool split, kill_parent;

    static NodeType declare()
    {
        auto type = node<Spawn>("spawn", "Emits points from the points of another node, continuously or at events.");
        type.counted_as("emit");
        declare_births(type);
        declare_newborn(type, "N (of a hit, else the parent's N, else its direction of motion)");
        type.param(&Spawn::inherit, "inherit", Value(), any_number(), "",
                   "names of attributes that newborn points copy from their parent")
            .param(&Spawn::inherit_velocity, "inherit_velocity", 1.0, any_number(), "",
                   "fraction of the parent's velocity that is added")
            .param(&Spawn::split, "split", false, any_number(), "",
                   "divides the parent's mass and volume among points that are born together")
            .param(&Spawn::kill_parent, "kill_parent", false, any_number(), "",
                   "removes a parent after it has emitted at an event");
        return type;
    }

    static void declare_births(Declaration<Spawn>& type)
    {
        type.param(&Spawn::from, "from", Value(), any_number(), "", "node whose points are the parents")
            .required()
            .constant()
            .param(&Spawn::source_group, "source_group", Value(), any_number(), "", "group of the parents that emit")
            .constant()
            .param(&Spawn::on, "on", Value(), any_number(), "",
                   "event: \"hit\", \"death\", \"birth\", a comparison (\"age > 0.5\"), or a function of a point; "
                   "without it births are continuous")
            .constant()
            .param(&Spawn::min_speed, "min_speed", Value(), at_least(0), "m/s",
                   "minimum speed of approach, with on = \"hit\"")
            .param(&Spawn::rate, "rate", Value(), at_least(0), "1/s", "births per second of each parent")
            .param(&Spawn::count, "count", Value(), at_least(0), "",
                   "births of each parent per frame, or per event (1 by default)")
            .param(&Spawn::limit, "limit", Value(), at_least(0), "", "maximum number of births of one parent");
    }

    void uses(Uses& uses) const
    {
        for (const AttributeSpec& spec : made(uses)) uses.makes.push_back(spec);
        const std::vector<std::string> names = parent_attributes();
        uses.reads_of_source.insert(uses.reads_of_source.end(), names.begin(), names.end());
        if (!is_zero(speed)) uses.takes_of_source.emplace_back("N");
        if (!source_group.empty()) uses.reads_groups_of_source.push_back(source_group);
        if (on) on->uses(uses);
        uses.gives.emplace_back("parent");
        uses.writes.emplace_back("dt");
        use_newborn(uses);
    }

    std::string couples(const Plan&, const PlannedNode&) const
    {
        return "it numbers births over all points of its source";
    }

    std::optional<std::vector<float>> values(const std::string& attribute, float) const
    {
        return common_value(attribute);
    }

    void check() const
    {
        if (!rate && !count && !on) throw Error("the number of points is missing; give rate, count or on");
        if (rate && count) throw Error("rate and count are given together; remove one of them");
        check_attributes();
        if (on && rate) throw Error("rate and on are given together; with on, give count, the births of each event");
        if (on && birth.when != "random")
            throw Error(fmt::format(
                "birth = \"{}\" and on are given together; remove birth, because an event has a time", birth.when));
        if (min_speed && !(on && on->kind == BirthEvent::Hit))
            throw Error("min_speed needs on = \"hit\"; remove it, or give on");
        if (kill_parent && (!on || on->kind == BirthEvent::Death))
            throw Error("kill_parent needs an event in a parent's life; give on, but not \"death\"");
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now)
    {
        emit_children(inputs[0], inputs[1], now);
        return std::move(inputs[0]);
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        const std::uint64_t born = now.figures.born;
        Flow flow = start(inputs, now);
        if (now.at_start) return flow;
        has_emitted_ |= now.figures.born > born;
        if (flow.simulation->trial && !has_emitted_) ++flow.simulation->trial->idle;
        return flow;
    }

    static std::unique_ptr<Operator> make() { return stateful<Spawn>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(clock_);
    }

private:
    // Returns the attributes that newborn points get from their parents.
    std::vector<std::string> parent_attributes() const
    {
        std::vector<std::string> names = inherit;
        if (split)
            for (const char* shared : {"mass", "pscale"})
                if (std::find(names.begin(), names.end(), shared) == names.end()) names.emplace_back(shared);
        std::erase_if(names, [&](const std::string& name) { return attributes.has(name); });
        return names;
    }

    std::vector<AttributeSpec> made(const Uses& uses) const;
    BirthPlan plan_of_step(const Flow& flow, const Flow& parent_flow, const Evaluation& now) const;
    void emit_children(Flow& flow, const Flow& parent_flow, const Evaluation& now);

    ParentClock clock_;
    bool has_emitted_ = false;  // read in trials
};
RAPID_NODE(Spawn);
RAPID_COUPLING("spawn", Spawn);
RAPID_GRAPH_ERROR("spawn", Spawn, "whose births inherit the errors of their parents");

// Inherited attributes have the type that the nodes of the source, or Rapid, define. Throws Error if none of them
// does.
std::vector<AttributeSpec> Spawn::made(const Uses& uses) const
{
    std::vector<AttributeSpec> specs = given();
    for (const std::string& name : parent_attributes()) {
        const auto of_source = std::find_if(uses.source_makes.begin(), uses.source_makes.end(),
                                            [&](const AttributeSpec& spec) { return spec.name == name; });
        if (of_source != uses.source_makes.end()) {
            specs.push_back(*of_source);
        } else if (const AttributeSpec* known = known_attribute(name)) {
            specs.push_back(*known);
        } else {
            std::vector<std::string> names;
            for (const AttributeSpec& spec : uses.source_makes) names.push_back(spec.name);
            const std::string near = did_you_mean(name, names);
            throw Error(fmt::format("inherit: the parents have no attribute \"{}\"{}", name,
                                    near.empty() ? "; make it there, with :attribute or emit's attributes" : near));
        }
    }
    return specs;
}

// The births of a frame are spread over its subframes.
BirthPlan Spawn::plan_of_step(const Flow& flow, const Flow& parent_flow, const Evaluation& now) const
{
    BirthPlan plan{rate, count, on, min_speed.value_or(0), limit, birth.when};
    const FrameClock clock = flow.simulation->clock();
    const std::int64_t late = parent_flow.simulation == flow.simulation ? 1 : 0;
    const std::int64_t before = clock.step_at(now.frame) - clock.start - 1 - late;
    plan.parts = clock.subframes;
    plan.part = static_cast<int>(std::max<std::int64_t>(before, 0) % clock.subframes);
    return plan;
}

void Spawn::emit_children(Flow& flow, const Flow& parent_flow, const Evaluation& now)
{
    const StepRecord& record = *parent_flow.simulation->record;
    if (on && on->kind == BirthEvent::Hit && !record.has_contacts)
        throw Error(
            "on = \"hit\": the parents' solve has a tolerance, with which contacts are unknown; give it substeps "
            "instead");
    // Points of the same chain move after this node: their last path is that of the previous frame.
    const bool waits = parent_flow.simulation == flow.simulation && !now.at_start;
    const ParentPaths parents(parent_flow.points, record, source_group);
    const BirthPlan plan = plan_of_step(flow, parent_flow, now);
    std::vector<Children> all_children;
    // A chain whose parents have already lived when it begins emits from its next frame on.
    if (!now.at_start || record.h == 0) all_children = clock_.births(parents, plan, now);
    const bool is_trial = flow.simulation->trial != nullptr;
    const bool is_sample = is_trial && !now.at_start && all_children.empty() && emits(plan);
    if (is_sample) all_children = sample_of(parents);

    const Traits traits{*this, parent_attributes(), inherit_velocity, split, waits ? now.frame.dt : 0};
    const Offspring offspring(parents, all_children, traits, now);
    offspring.make_columns(flow.points);
    require_room(flow.points, all_children);
    if (kill_parent && !is_sample) remove_parents(flow, parent_flow, parents, all_children, now);
    const std::size_t born =
        offspring.append_to(flow.points, flow.simulation->next_id, is_trial ? trial_births : SIZE_MAX);
    now.figures.born += born;
    if (parents.without_path() > 0 && !now.at_start)
        now.warnings.push_back(
            fmt::format("{}:{}: node \"{}\": the source has points that its solve has not moved, from another chain or "
                        "made after it; they emit at their position at the end of the frame",
                        now.location.file, now.location.line, now.node));
    if (birth.edit) birth.edit->edit(flow.points, flow.points.size() - born, now);
}

}  // namespace
}  // namespace rapid
