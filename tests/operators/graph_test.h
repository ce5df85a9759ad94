// A small graph of native nodes, evaluated frame by frame.
//
// Its solve is "hold", which feeds the points back unchanged, so that only the other nodes have effects.
#pragma once

#include <optional>

#include "runtime/graph/evaluate.h"
#include "tests/operators/node_test.h"

namespace rapid::test {

struct Hold {
    static NodeType declare() { return node<Hold>("hold", "Feeds the points back unmoved.").kind(NodeKind::Solve); }

    Flow evaluate(std::span<Flow> inputs, const Evaluation&) const
    {
        Flow flow = std::move(inputs[0]);
        flow.points.remove("dt");
        flow.simulation->state = flow.points;
        return flow;
    }
    Flow start(std::span<Flow> inputs, const Evaluation& now) const { return evaluate(inputs, now); }
};

class GraphTest {
public:
    GraphTest() { registry_.add(Hold::declare()); }

    NodePtr node(const std::string& type, Arguments arguments = {}, std::vector<NodePtr> inputs = {})
    {
        const std::uint64_t serial = graph_.nodes.size();
        Node made{&registry_.at(type), type + std::to_string(serial), {}, serial,
                  std::move(inputs),   std::move(arguments)};
        graph_.nodes.push_back(std::make_shared<const Node>(std::move(made)));
        return graph_.nodes.back();
    }

    // Plans the graph that ends here; frames are then computed one by one.
    void run(const NodePtr& output)
    {
        graph_.outputs = {{"main", output}};
        plan_.emplace(graph_, PlanOptions());
        evaluator_.emplace(*plan_);
    }
    PointSet next_frame() { return evaluator_->advance().outputs.at("main"); }

private:
    Registry registry_;
    Graph graph_;
    std::optional<Plan> plan_;
    std::optional<Evaluator> evaluator_;
};

}  // namespace rapid::test
