// create: starts a simulation, and outputs its points at the beginning of each frame.
//
// At the first frame these are the initial points, numbered from 0 in order. (An id counts births in this simulation;
// earlier ids are dropped.) At later frames they are the points from Solve, passed on without a copy, or the initial
// points again if no Solve feeds points back. Every planned column and group exists from the first frame on, so all
// frames have the same columns.
#include "runtime/base/parallel.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/graph/points_object.h"
#include "runtime/points/attribute_like.h"

#include <fmt/format.h>

#include <numeric>
#include <utility>

namespace rapid {
namespace {

constexpr int max_subframes = 10000;

struct Create {
    double fps;
    int start_frame, seed, subframes;
    std::shared_ptr<const PointsObject> points;

    static NodeType declare()
    {
        return node<Create>("create",
                            "Starts a simulation and returns its points as Solve left them in the previous frame.")
            .kind(NodeKind::Source)
            .param(&Create::fps, "fps", 24.0, above(0), "1/s", "frames per second")
            .constant()
            .param(&Create::start_frame, "start", 1.0, any_number(), "",
                   "number of the first frame, which is the initial state at time 0")
            .constant()
            .param(&Create::seed, "seed", 0.0, at_least(0), "", "seed of all random numbers of this simulation")
            .constant()
            .param(&Create::subframes, "subframes", 1.0, between(1, max_subframes), "",
                   "evaluations of the whole graph per frame, with scripts, emitters and colliders; not the solver's "
                   "substeps")
            .constant()
            .param(&Create::points, "points", Value(), any_number(), "", "initial points")
            .constant();
    }

    void uses(Uses& uses) const
    {
        if (!points) return;
        for (const auto& [name, column] : points->points.columns())
            if (name != "P" && name != "v" && name != "id" && name != "dt")
                uses.makes.push_back(attribute_like(name, fallback_of(column)));
        for (const auto& [name, members] : points->points.groups()) uses.makes_groups.push_back(name);
    }

    void check() const
    {
        if (!points) return;
        for (const auto& [name, column] : points->points.columns())
            if (const AttributeSpec* known = known_attribute(name);
                known && type_of(known->fallback) != type_of(column))
                throw Error(fmt::format("the initial points have \"{}\" as {}; it must be {}", name,
                                        type_name(type_of(column)), type_name(type_of(known->fallback))));
    }

    void take(const Subset& subset) { subset_ = subset; }

    std::optional<std::vector<float>> values(const std::string& attribute, float fallback) const
    {
        if (!points || points->points.empty()) return std::vector<float>();
        const auto* own = points->points.find<float>(attribute);
        if (!own) return std::vector{fallback};
        return own->is_uniform() ? std::optional(std::vector{(*own)[0]}) : std::nullopt;
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        Simulation& simulation = *flow.simulation;
        if (now.at_start) begin(simulation);
        flow.points = now.at_start || !now.is_fed_back ? initial(now) : std::exchange(simulation.state, PointSet());
        for (const AttributeSpec& spec : simulation.columns) flow.points.set_fallback(spec);
        for (const std::string& name : simulation.groups) flow.points.group(name);
        return flow;
    }

private:
    static AttributeValue fallback_of(const AnyColumn& column)
    {
        return std::visit([](const auto& c) -> AttributeValue { return c.fallback(); }, column);
    }

    void keep_subset(PointSet& set) const
    {
        std::vector<std::uint8_t> kept(set.size());
        for_each_chunk(set.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) kept[i] = subset_.has(static_cast<std::int64_t>(i));
        });
        set.keep(kept);
    }

    void begin(Simulation& simulation) const
    {
        simulation.next_id = points ? static_cast<std::int64_t>(points->points.size()) : 0;
        simulation.adopted.clear();
    }

    PointSet initial(const Evaluation& now) const
    {
        PointSet set = points ? points->points : PointSet();
        set.remove("dt");
        for (const std::string& name : set.column_names())
            if (!now.keeps(name)) set.remove(name);
        for (const std::string& name : set.group_names())
            if (!now.keeps_group(name)) set.remove_group(name);
        if (!set.empty()) {
            const std::span<std::int64_t> ids = set.id().overwrite();
            std::iota(ids.begin(), ids.end(), std::int64_t{0});
        }
        if (!subset_.is_all()) keep_subset(set);
        return set;
    }

    Subset subset_;
};
RAPID_NODE(Create);
RAPID_COUPLING("create", Create);

}  // namespace
}  // namespace rapid
