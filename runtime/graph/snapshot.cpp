#include "runtime/graph/snapshot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/base/at_node.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/simulation.h"
#include "runtime/graph/stateful.h"
#include "runtime/points/state_archive.h"
#include "runtime/points/state_checks.h"

namespace rapid {
namespace {

// Serialization of a simulation (points/state_archive.h): its points, the ids given, and the events of the last step.

constexpr std::int64_t max_ids = std::int64_t{1} << 53;

// Returns true if the points have unique ids below next_id.
bool have_ids_below(const PointSet& points, std::int64_t next_id)
{
    const auto* column = points.find<std::int64_t>("id");
    if (!column || (column->is_uniform() && column->size() > 1)) return false;
    std::span<const std::int64_t> ids(column->read().data, column->size());
    std::vector<std::int64_t> sorted;  // used if a script or a merge has reordered the points
    if (!ascend(ids)) {
        sorted.assign(ids.begin(), ids.end());
        std::sort(sorted.begin(), sorted.end());
        ids = sorted;
    }
    return ids.empty() || (ids.front() >= 0 && ids.back() < next_id && ascend(ids));
}

}  // namespace

// Archives find these in the namespace of their argument.
template <StateArchive Archive>
void serialize(Archive& keep, LoggedHit& hit)
{
    keep(hit.point, hit.collider, hit.time, hit.P, hit.n, hit.vc, hit.v0, hit.v1, hit.speed, hit.impulse, hit.recorded);
}

template <StateArchive Archive>
void serialize(Archive& keep, StepRecord& step)
{
    keep(step.time, step.h, step.first_new, step.before, step.hits, step.killed, step.old, step.killed_at, step.old_at,
         step.has_contacts);
    if constexpr (Archive::is_loading::value) {
        const auto is_of_a_point = [&](const LoggedHit& hit) { return hit.point < step.before.size(); };
        const auto by_point = [](const LoggedHit& a, const LoggedHit& b) { return a.point < b.point; };
        StateReader::expect(std::all_of(step.hits.begin(), step.hits.end(), is_of_a_point));
        StateReader::expect(std::is_sorted(step.hits.begin(), step.hits.end(), by_point));
        StateReader::expect(step.killed_at.size() == step.killed.size() && step.old_at.size() == step.old.size());
        StateReader::expect(std::isfinite(step.time) && std::isfinite(step.h));
    }
}

// The ids of adopted points are stored by the merges that adopted them.
template <StateArchive Archive>
void serialize(Archive& keep, Simulation& simulation)
{
    keep(simulation.next_id, simulation.state, simulation.first_new);
    if (simulation.record) keep(*simulation.record);
    if constexpr (Archive::is_loading::value) {
        StateReader::expect(0 <= simulation.next_id && simulation.next_id <= max_ids);
        StateReader::expect(have_ids_below(simulation.state, simulation.next_id));
        if (!simulation.record) return;
        for (const PointSet* set : {&simulation.record->before, &simulation.record->killed, &simulation.record->old})
            StateReader::expect(have_ids_below(*set, simulation.next_id));
    }
}

std::size_t Snapshot::size() const
{
    std::size_t sum = 0;
    for (const auto* parts : {&simulations, &nodes, &constants})
        for (const auto& [name, state] : *parts) sum += state.size();
    return sum;
}

Snapshot Evaluator::save() const
{
    Snapshot snapshot;
    snapshot.frame = next_ - 1;
    for (std::size_t s = 0; s < simulations_.size(); ++s)
        snapshot.simulations[plan_.simulations[s].create->name] = state_of(*simulations_[s]);
    for (std::size_t i = 0; i < plan_.nodes.size(); ++i) {
        const std::string& name = plan_.nodes[i].node->name;
        if (adopts_once(i)) snapshot.constants[name] = state_of(constant_results_[i]->points);
        const auto* op = dynamic_cast<const Stateful*>(plan_.nodes[i].op.get());
        if (!op) continue;
        StateWriter writer;
        op->save(writer);
        snapshot.nodes[name] = writer.take();
    }
    return snapshot;
}

void Evaluator::load(const Snapshot& snapshot)
{
    const auto state_in = [](const std::map<std::string, SavedState>& states, const std::string& name) -> auto&
    {
        const auto found = states.find(name);
        if (found == states.end()) StateReader::fail();
        return found->second;
    };
    StateReader::expect(plan_.first_frame() <= snapshot.frame && snapshot.frame <= INT32_MAX);
    evaluate_constants(snapshot);
    next_ = snapshot.frame + 1;
    // Restores the last values of functions of the frame, which nodes and caches compare with the next ones.
    call_functions(snapshot.frame, 0);

    for (std::size_t s = 0; s < simulations_.size(); ++s) {
        restore(*simulations_[s], state_in(snapshot.simulations, plan_.simulations[s].create->name));
        simulations_[s]->adopted.clear();
    }
    for (const PlannedNode& planned : plan_.nodes) {
        auto* op = dynamic_cast<Stateful*>(planned.op.get());
        if (!op) continue;
        std::vector<Simulation*> inputs;
        for (const std::size_t input : planned.inputs)
            inputs.push_back(simulations_[plan_.nodes[input].simulation].get());
        name_errors(planned.node->name, planned.node->location, [&] {
            StateReader reader(state_in(snapshot.nodes, planned.node->name));
            op->load(reader, {*simulations_[planned.simulation], inputs});
            reader.finish();
        });
    }
}

// Results that never change are those of the first frame.
void Evaluator::evaluate_constants(const Snapshot& snapshot)
{
    next_ = plan_.first_frame();
    take_columns();
    std::vector<Flow> results(plan_.nodes.size());
    std::vector<std::size_t> readers(plan_.nodes.size(), plan_.nodes.size() + 1);  // so none is the last
    FrameResult frame;
    for (std::size_t i = 0; i < plan_.nodes.size(); ++i) {
        if (!plan_.nodes[i].once) continue;
        results[i] = evaluate(i, i, 0, results, readers, frame);
        if (!adopts_once(i)) continue;
        const auto saved = snapshot.constants.find(plan_.nodes[i].node->name);
        if (saved == snapshot.constants.end()) StateReader::fail();
        restore(results[i].points, saved->second);
        constant_results_[i] = results[i];
    }
}

// Returns true if the result never changes but contains ids that other points were given before.
bool Evaluator::adopts_once(std::size_t node) const
{
    return constant_results_[node] && plan_.nodes[node].node->type->kind == NodeKind::Merge;
}

}  // namespace rapid
