#include "runtime/operators/emit/parent_emitter.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/memory_budget.h"
#include "runtime/operators/emit/births.h"
#include "runtime/points/attribute_like.h"
#include "runtime/points/id_index.h"

namespace rapid {
namespace {

void require_room(const PointSet& points, const std::vector<Brood>& broods)
{
    if (broods.empty()) return;
    const std::size_t n = broods.back().first + broods.back().count;
    const double bytes = static_cast<double>(n) * bytes_a_birth + static_cast<double>(points.bytes());
    if (fits_in_memory(bytes)) return;
    throw beyond_memory(
        fmt::format("{} births in a frame, of {} parents, behind {} points,", n, broods.size(), points.size()), bytes,
        "give a smaller rate or count, or a limit");
}

// What is born a frame is spread over its sub-frames.
BirthPlan plan_of_step(const ParentOptions& options, const Flow& flow, const Flow& from, const Evaluation& now)
{
    BirthPlan plan = options.plan;
    const FrameClock clock = flow.simulation->clock();
    const std::int64_t late = from.simulation == flow.simulation ? 1 : 0;
    const std::int64_t before = clock.step_at(now.frame) - clock.start - 1 - late;
    plan.parts = clock.subframes;
    plan.part = static_cast<int>(std::max<std::int64_t>(before, 0) % clock.subframes);
    return plan;
}

bool emits(const BirthPlan& plan)
{
    const auto is_positive = [](const auto& amount) { return !amount.attribute.empty() || amount.value > 0; };
    if (plan.rate) return is_positive(*plan.rate);
    return plan.count ? is_positive(*plan.count) : plan.on.has_value();
}

// In a trial, in which no point moves and nothing happens to it: one birth of a living parent.
std::vector<Brood> sample_of(const ParentPaths& parents)
{
    for (std::uint32_t i = 0; i < parents.size(); ++i) {
        if (!parents[i].takes_part || !parents[i].is_alive) continue;
        Brood brood{};
        brood.parent = i;
        brood.hit = Brood::no_hit;
        brood.count = 1;
        brood.begin = brood.end = parents[i].end;
        return {brood};
    }
    return {};
}

// Points of this chain are removed at once, those of another by the evaluator, from all that nobody has taken yet.
void remove_parents(Flow& flow, const Flow& from, const ParentPaths& parents, const std::vector<Brood>& broods,
                    const Evaluation& now)
{
    if (from.simulation != flow.simulation) {
        for (const Brood& brood : broods)
            if (parents[brood.parent].is_alive) from.simulation->condemned.push_back(parents.id(parents[brood.parent]));
        return;
    }
    std::vector<std::uint8_t> keep(flow.points.size(), 1);
    const IdIndex index(std::as_const(flow.points).id());
    for (const Brood& brood : broods)
        if (const std::uint32_t i = index[parents.id(parents[brood.parent])]; i != IdIndex::none) keep[i] = 0;
    now.figures.died += static_cast<std::uint64_t>(std::count(keep.begin(), keep.end(), 0));
    flow.points.keep(keep);
}

}  // namespace

// The type of an inherited attribute is that which the source's makers, or Rapid, give it.
std::vector<AttributeSpec> ParentEmitter::made(const ParentOptions& options, const Uses& uses)
{
    std::vector<AttributeSpec> specs;
    for (const auto& [name, value] : options.traits.attributes.of) specs.push_back(attribute_like(name, value.first()));
    for (const std::string& name : options.traits.of_parents()) {
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
            throw Error(fmt::format("inherit: the source has no attribute \"{}\"{}", name,
                                    near.empty() ? "; make it there, with :attribute or emit's attributes" : near));
        }
    }
    return specs;
}

void ParentEmitter::use(const ParentOptions& options, Uses& uses)
{
    const std::vector<std::string> names = options.traits.of_parents();
    uses.reads_of_source.insert(uses.reads_of_source.end(), names.begin(), names.end());
    if (!is_zero(options.traits.speed)) uses.takes_of_source.emplace_back("N");
    if (!options.group.empty()) uses.reads_groups_of_source.push_back(options.group);
    if (options.plan.on) options.plan.on->uses(uses);
    uses.gives.emplace_back("parent");
}

void ParentEmitter::bear(Flow& flow, const Flow& from, const ParentOptions& options, std::size_t most,
                         const Evaluation& now)
{
    const StepRecord& record = *from.simulation->record;
    if (options.plan.on && options.plan.on->kind == BirthEvent::Hit && !record.has_contacts)
        throw Error("on = \"hit\": the source's solve has a tolerance, and then keeps no contacts; give it substeps");
    const ParentPaths parents(from.points, record, options.group);
    std::vector<Brood> broods;
    // A chain that begins when its parents have lived already bears from its next frame on.
    if (!now.at_start || record.h == 0) broods = clock_.births(parents, plan_of_step(options, flow, from, now), now);
    const bool is_sample = flow.simulation->trial && !now.at_start && broods.empty() && emits(options.plan);
    if (is_sample) broods = sample_of(parents);
    const Offspring offspring(parents, broods, options.traits, now);
    offspring.make_columns(flow.points);
    require_room(flow.points, broods);
    if (options.kills && !is_sample) remove_parents(flow, from, parents, broods, now);
    now.figures.born += offspring.append_to(flow.points, flow.simulation->next_id, most);
    if (parents.without_path() > 0 && !now.at_start)
        now.warnings.push_back(fmt::format(
            "{}:{}: node \"{}\": the source has points that its solve has not moved, as of another chain or "
            "made after it; what they bear is born where they are at the end of the frame",
            now.location.file, now.location.line, now.node));
}

}  // namespace rapid
