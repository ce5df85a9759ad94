// One native node alone: made from the registry, with arguments bound like a graph's, evaluated on a flow.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "runtime/graph/arguments.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/points_object.h"
#include "runtime/graph/registry.h"
#include "tests/test.h"

namespace rapid::test {

using Arguments = std::map<std::string, Value>;

inline Value list(std::vector<Value> values)
{
    auto table = std::make_shared<Table>();
    table->list = std::move(values);
    return std::shared_ptr<const Table>(table);
}

inline Value named(std::map<std::string, Value> values)
{
    auto table = std::make_shared<Table>();
    table->named = std::move(values);
    return std::shared_ptr<const Table>(table);
}

inline Value numbered(std::map<std::int64_t, Value> values)
{
    auto table = std::make_shared<Table>();
    table->numbered = std::move(values);
    return std::shared_ptr<const Table>(table);
}

// Returns a parameter that is a function of the frame.
inline Value of_frame(std::function<Value(const Frame&)> f)
{
    struct Function : FrameFunction {
        std::function<Value(const Frame&)> body;
        Value call(const Frame& frame) const override { return body(frame); }
    };
    auto function = std::make_shared<Function>();
    function->body = std::move(f);
    return std::shared_ptr<const FrameFunction>(function);
}

inline std::shared_ptr<Simulation> simulation(double fps = 24, std::int64_t start = 1, std::uint64_t seed = 0)
{
    auto made = std::make_shared<Simulation>();
    made->fps = fps;
    made->start = start;
    made->seed = seed;
    return made;
}

// Returns points at these positions, with ids from 0.
inline PointSet points_at(std::initializer_list<InitialisedVec3f> positions) { return points(positions); }
inline PointSet points_at(const std::vector<Vec3f>& positions) { return points(positions); }

inline std::shared_ptr<PointsObject> source_of(PointSet points)
{
    auto object = std::make_shared<PointsObject>();
    object->points = std::move(points);
    return object;
}

template <class T>
std::vector<T> values_of(const PointSet& points, std::string_view name)
{
    const Strided<T> column = points.column<T>(name).read();
    std::vector<T> values;
    for (std::size_t i = 0; i < points.size(); ++i) values.push_back(column[i]);
    return values;
}

inline std::vector<std::int64_t> ids_of(const PointSet& points) { return values_of<std::int64_t>(points, "id"); }

// Returns the message of a failed call; empty if it did not fail.
inline std::string error_of(const std::function<void()>& f)
{
    try {
        f();
        return "";
    } catch (const Error& error) {
        return error.message();
    }
}

class NodeTest {
public:
    NodeTest(const std::string& type, Arguments arguments, std::string name = "")
        : NodeTest(type, std::move(arguments), simulation(), std::move(name))
    {
    }
    NodeTest(const std::string& type, Arguments arguments, std::shared_ptr<Simulation> in, std::string name = "")
        : simulation_(std::move(in)),
          node_{&registry_.at(type), name.empty() ? type + "1" : name, {}, 0, {}, std::move(arguments)},
          op_(node_.type->make())
    {
        bind_arguments(node_, *op_, simulation_->clock(), simulation_->frame(simulation_->start), false);
        op_->check();
    }

    // Returns the node's result at this frame from these inputs.
    Flow evaluate(std::int64_t frame, std::vector<Flow> inputs)
    {
        return call(frame, [&](const Evaluation& now) { return op_->evaluate(inputs, now); });
    }
    Flow start(std::vector<Flow> inputs)
    {
        return call(simulation_->start, [&](const Evaluation& now) { return op_->start(inputs, now); });
    }

    // The same for a node with one input, for points of its own simulation.
    PointSet operator()(std::int64_t frame, PointSet points = {})
    {
        return evaluate(frame, {Flow{std::move(points), {}, simulation_}}).points;
    }
    PointSet at_start(PointSet points = {}) { return start({Flow{std::move(points), {}, simulation_}}).points; }

    // functions: parameters that are given as functions of the frame.
    Uses uses(std::set<std::string> functions = {}) const
    {
        Uses uses = node_.type->uses;
        uses.functions = std::move(functions);
        op_->uses(uses);
        return uses;
    }

    Simulation& simulation_state() { return *simulation_; }
    FrameFigures figures;
    std::vector<std::string> warnings;
    std::function<void(const std::string&, const PointSet&)> write;
    std::set<std::string> pruned;  // by a plan

private:
    template <class F>
    Flow call(std::int64_t number, const F& f)
    {
        const Frame frame = simulation_->frame(number);
        bind_arguments(node_, *op_, simulation_->clock(), frame, true);
        op_->check();
        const Evaluation now{frame,
                             number <= simulation_->start,
                             node_.name,
                             node_.location,
                             RandomKey(simulation_->seed, node_.name),
                             figures,
                             warnings,
                             write,
                             &pruned};
        return f(now);
    }

    Registry registry_;
    std::shared_ptr<Simulation> simulation_;
    Node node_;
    std::unique_ptr<Operator> op_;
};

}  // namespace rapid::test
