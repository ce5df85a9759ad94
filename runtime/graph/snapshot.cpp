#include "runtime/graph/snapshot.h"

#include "runtime/at_node.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/simulation_state.h"
#include "runtime/graph/stateful.h"

namespace rapid {

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
        if (adopts_once(i)) snapshot.constants[name] = state_of(kept_[i]->points);
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
    // What functions of the frame gave last: nodes and caches compare it with what they give next.
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

// The results that never change are those of the first frame.
void Evaluator::evaluate_constants(const Snapshot& snapshot)
{
    next_ = plan_.first_frame();
    take_columns();
    std::vector<Flow> results(plan_.nodes.size());
    std::vector<std::size_t> readers(plan_.nodes.size(), plan_.nodes.size() + 1);  // nobody takes them away
    FrameResult frame;
    for (std::size_t i = 0; i < plan_.nodes.size(); ++i) {
        if (!plan_.nodes[i].once) continue;
        results[i] = evaluate(i, i, 0, results, readers, frame);
        if (!adopts_once(i)) continue;
        const auto saved = snapshot.constants.find(plan_.nodes[i].node->name);
        if (saved == snapshot.constants.end()) StateReader::fail();
        restore(results[i].points, saved->second);
        kept_[i] = results[i];
    }
}

// Whether the result never changes but has ids that others have been given before.
bool Evaluator::adopts_once(std::size_t node) const
{
    return kept_[node] && plan_.nodes[node].node->type->kind == NodeKind::Merge;
}

}  // namespace rapid
