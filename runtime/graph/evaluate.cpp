#include "runtime/graph/evaluate.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/base/at_node.h"
#include "runtime/base/cancellation.h"
#include "runtime/graph/arguments.h"
#include "runtime/graph/attribute_uses.h"
#include "runtime/graph/changing_node.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/simulation.h"
#include "runtime/graph/stateful.h"
#include "runtime/points/state_archive.h"

namespace rapid {

Evaluator::Evaluator(const Plan& plan, WriteHook write, ResultHook result)
    : plan_(plan),
      write_(std::move(write)),
      result_(std::move(result)),
      next_(plan.first_frame()),
      constant_results_(plan.nodes.size())
{
    subframes_ = plan.simulations.front().subframes;
    for (const PlannedSimulation& planned : plan.simulations) {
        auto simulation = std::make_shared<Simulation>();
        simulation->fps = planned.fps;
        simulation->start = planned.start;
        simulation->subframes = planned.subframes;
        simulation->seed = planned.seed;
        if (planned.recorded) simulation->record = std::make_shared<StepRecord>();
        for (const PlannedNode& node : plan.nodes)
            if (auto names = ChangingNode::ignored_changes(*node.node); !names.empty())
                simulation->varying[node.node->name] = std::move(names);
        simulations_.push_back(std::move(simulation));
    }
    changing_.resize(plan.nodes.size());
    for (std::size_t i = 0; i < plan.nodes.size(); ++i) {
        const PlannedNode& planned = plan.nodes[i];
        if (planned.in_loop && planned.node->type->kind == NodeKind::Dynamic &&
            !functions_of_the_frame(*planned.node).empty())
            changing_[i] = std::make_unique<ChangingNode>(planned, simulations_[planned.simulation]);
    }
}

Evaluator::~Evaluator() = default;

void Evaluator::disable_error_estimates()
{
    for (const std::shared_ptr<Simulation>& simulation : simulations_) simulation->estimates_errors = false;
}

void Evaluator::add_per_point_diagnostics()
{
    for (const std::shared_ptr<Simulation>& simulation : simulations_) simulation->per_point_diagnostics = true;
}

FrameResult Evaluator::advance()
{
    frame_clock_ = Stopwatch();
    FrameResult result;
    result.frame = next_;
    result.began = std::chrono::steady_clock::now();

    std::vector<Flow> results;
    std::vector<std::size_t> readers;
    // The first frame has no interval before it.
    for (int left = next_ <= plan_.first_frame() ? 0 : subframes_ - 1; left >= 0; --left)
        advance_subframe(left, results, readers, result);

    for (const auto& [name, i] : plan_.outputs) {
        const Simulation& simulation = *simulations_[plan_.nodes[i].simulation];
        PointSet& points = results[i].points;
        result.outputs[name] = --readers[i] == 0 ? std::move(points) : points;
        result.outputs[name].remove("dt");
        result.fps[name] = simulation.fps;
        result.time[name] = simulation.clock().at(static_cast<double>(next_)).time;
    }
    ++next_;
    result.total_seconds = frame_clock_.seconds();
    return result;
}

Trial Evaluator::examine()
{
    const auto trial = std::make_shared<Trial>();
    for (const std::shared_ptr<Simulation>& simulation : simulations_) simulation->trial = trial;
    advance();
    trial->stiff = advance().figures.stiff;
    const Trial found = *trial;
    const std::int64_t start = next_ - 2;
    for (std::int64_t after = 2; trial->idle > 0 && after <= max_tried; after *= 2) {
        next_ = start + after;
        advance();
    }
    return found;
}

void Evaluator::advance_subframe(int left, std::vector<Flow>& results, std::vector<std::size_t>& readers,
                                 FrameResult& frame)
{
    const auto takes_part = [&](const PlannedNode& planned) { return left == 0 || planned.in_steps; };

    // Functions of the frame are called first, on this thread; the fallbacks of columns may depend on them.
    call_functions(next_, left);
    take_columns();

    FrameFigures before = std::exchange(frame.figures, {});
    for (const std::shared_ptr<Simulation>& simulation : simulations_)
        if (simulation->trial) *simulation->trial = {};
    results.assign(plan_.nodes.size(), {});
    readers.assign(plan_.nodes.size(), 0);
    for (std::size_t i = 0; i < plan_.nodes.size(); ++i) readers[i] = plan_.nodes[i].consumers;
    for (std::size_t first = 0, last = 0; first < plan_.nodes.size(); first = last + 1) {
        last = first;
        if (!takes_part(plan_.nodes[first])) continue;
        // A cancellation since the last node belongs to no node, only to the scene's file.
        name_errors({}, {plan_.nodes[first].node->location.file, 0}, [] { Cancellation::check_current(); });
        // The hooks and checked declarations process one node after the other.
        if (!result_ && !input_ && !checks_declarations_) last = plan_.last_together(first);
        results[last] = evaluate(first, last, left, results, readers, frame);
        remove_condemned(results, frame.figures);
    }
    for (std::size_t s = 0; plan_.keeps_steps && s < simulations_.size(); ++s)
        if (simulations_[s]->record) frame.steps[plan_.simulations[s].create->name].push_back(*simulations_[s]->record);
    before.append(frame.figures);
    frame.figures = std::move(before);
}

void Evaluator::call_functions(std::int64_t frame, int left)
{
    for (const PlannedNode& planned : plan_.nodes) {
        if ((left > 0 && !planned.in_steps) || (planned.once && frame > plan_.first_frame())) continue;
        const Simulation& simulation = *simulations_[planned.simulation];
        const Frame now = simulation.frame(simulation.clock().step_of(frame) - left);
        name_errors(planned.node->name, planned.node->location, [&] {
            bind_arguments(*planned.node, *planned.op, simulation.clock(), now, true);
            planned.op->check();
        });
    }
}

void Evaluator::take_columns()
{
    for (std::size_t s = 0; s < simulations_.size(); ++s) {
        simulations_[s]->columns = plan_.columns_of(s);
        simulations_[s]->groups = plan_.groups_of(s);
    }
}

// Removes points from the state, and from results that have not been taken yet.
void Evaluator::remove_condemned(std::vector<Flow>& results, FrameFigures& figures)
{
    for (const std::shared_ptr<Simulation>& simulation : simulations_) {
        if (simulation->condemned.empty()) continue;
        std::vector<std::int64_t> ids = std::exchange(simulation->condemned, {});
        std::sort(ids.begin(), ids.end());
        const auto remove_from = [&](PointSet& points) {
            std::vector<std::uint8_t> keep(points.size());
            const Strided<std::int64_t> id = std::as_const(points).id().read();
            for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = !std::binary_search(ids.begin(), ids.end(), id[i]);
            const std::size_t before = points.size();
            points.keep(keep);
            return before - points.size();
        };
        figures.died += remove_from(simulation->state);
        for (Flow& flow : results)
            if (flow.simulation == simulation) remove_from(flow.points);
    }
}

namespace {

std::vector<AttributeRange> ranges_for_solve(const PlannedNode& planned)
{
    const NodeType& type = *planned.node->type;
    std::vector<AttributeRange> ranges;
    if (type.kind != NodeKind::Dynamic && type.kind != NodeKind::Solve) return ranges;
    for (const Param& param : type.params) {
        const std::string attribute = param.attribute ? param.attribute(planned.op->fields()) : "";
        if (!attribute.empty()) ranges.push_back({param.name, attribute, param.range});
    }
    for (const std::string& name : type.uses.takes) {
        const AttributeSpec* known = known_attribute(name);
        if (known && std::holds_alternative<float>(known->fallback))
            ranges.push_back({name, name, range_of_attribute(name)});
    }
    return ranges;
}

}  // namespace

// A node's Evaluation, with the objects that it refers to.
class Evaluator::Context {
public:
    Context(const Evaluator& evaluator, const PlannedNode& planned, int left, FrameResult& frame)
        : simulation_(*evaluator.simulations_[planned.simulation]),
          step_(simulation_.clock().step_of(evaluator.next_) - left),
          now_(simulation_.frame(std::max(step_, simulation_.start)))
    {
        if (evaluator.write_ && left == 0)
            write_ = [&](const std::string& pattern, const PointSet& points) {
                PointSet written = points;
                const auto node = static_cast<std::size_t>(&planned - evaluator.plan_.nodes.data());
                for (const std::string& name : evaluator.plan_.unrequested_columns(node)) written.remove(name);
                evaluator.write_(pattern, written, now_, simulation_.fps);
            };
        // A simulation that begins at the end of this frame, or later, counts its figures once.
        const bool at_start = step_ <= simulation_.start;
        evaluation.emplace(Evaluation{
            now_, at_start, planned.node->name, planned.node->location, RandomKey(simulation_.seed, planned.node->name),
            left > 0 && at_start ? repeated_ : frame.figures, frame.warnings, write_,
            &evaluator.plan_.simulations[planned.simulation].pruned, ranges_for_solve(planned), planned.in_loop});
    }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    std::optional<Evaluation> evaluation;

private:
    const Simulation& simulation_;
    const std::int64_t step_;
    const Frame now_;
    FrameFigures repeated_;  // for a start that is evaluated more than once
    std::function<void(const std::string&, const PointSet&)> write_;
};

Flow Evaluator::evaluate(std::size_t first, std::size_t last, int left, std::vector<Flow>& results,
                         std::vector<std::size_t>& readers, FrameResult& frame)
{
    const PlannedNode& planned = plan_.nodes[first];
    const Node& node = *planned.node;
    if (constant_results_[first]) return *constant_results_[first];

    std::vector<Flow> inputs;
    for (const std::size_t input : planned.inputs)
        inputs.push_back(--readers[input] == 0 ? std::move(results[input]) : results[input]);
    for (const std::size_t source : planned.sources)
        inputs.push_back(--readers[source] == 0 ? std::move(results[source]) : results[source]);
    if (node.type->kind == NodeKind::Source) inputs.push_back({PointSet(), {}, simulations_[planned.simulation]});

    const Context context(*this, planned, left, frame);
    const Evaluation& evaluation = *context.evaluation;
    const Cancellation::NodeScope scope(node.name, node.location);
    return at_node(node.name, node.location, [&] {
        if (input_) input_(node, evaluation.frame, inputs);
        const double begin = frame_clock_.seconds();
        const double scripts_before = frame.figures.seconds.script;
        std::optional<UndeclaredColumns> undeclared;
        const NodeKind kind = node.type->kind;
        if (checks_declarations_ && (kind == NodeKind::Points || kind == NodeKind::Solve))
            undeclared.emplace(inputs[0].points, declared_for(first));
        Flow result;
        if (planned.in_loop && evaluation.at_start && node.type->kind != NodeKind::Source) {
            result = planned.op->start(inputs, evaluation);
        } else if (last == first) {
            const std::size_t before = changing_[first] ? inputs[0].dynamics.size() : 0;
            result = planned.op->evaluate(inputs, evaluation);
            if (changing_[first]) changing_[first]->follow(result.dynamics, before, evaluation);
        } else {
            result = std::move(inputs[0]);
            edit_together(first, last, left, result.points, frame);
        }
        if (undeclared) {
            undeclared->restore(result.points);
            if (kind == NodeKind::Solve) undeclared->restore(simulations_[planned.simulation]->state);
        }
        add_work(first, last, begin, scripts_before, result.points, frame);
        if (planned.once) constant_results_[first] = result;
        if (result_) result_(node, next_, result.points);
        Cancellation::check_current();  // checks the memory that this node has taken
        return result;
    });
}

void Evaluator::add_work(std::size_t first, std::size_t last, double begin, double scripts_before,
                         const PointSet& result, FrameResult& frame) const
{
    NodeWork& work = frame.work.emplace_back();
    for (std::size_t i = first; i <= last; ++i) work.nodes.push_back(plan_.nodes[i].node->name);
    work.begin = begin;
    work.seconds = frame_clock_.seconds() - begin;
    if (plan_.nodes[first].node->type->kind == NodeKind::Solve) {
        work.stage = NodeWork::Stage::Solve;
        frame.figures.seconds.solve += work.seconds;
    } else if (frame.figures.seconds.script > scripts_before) {
        work.stage = NodeWork::Stage::Script;
    }
    work.points = result.size();
    work.bytes = result.bytes();
}

std::vector<Uses> Evaluator::declared_for(std::size_t node) const
{
    std::vector<Uses> declared = {uses_of(plan_.nodes[node])};
    if (plan_.nodes[node].node->type->kind != NodeKind::Solve) return declared;
    // The plan lets Solve read ages if a life may end. `still` and the `stuck` columns belong to Solve itself.
    declared.emplace_back().takes = {"age", "still", "stuckP", "stuckat", "stuckface", "stuckto"};
    // Its record of the step contains the attributes that emitters read from its points.
    for (const PlannedNode& planned : plan_.nodes)
        for (const std::size_t source : planned.sources) {
            if (plan_.nodes[source].simulation != plan_.nodes[node].simulation) continue;
            const Uses of_source = uses_of(planned);
            declared.emplace_back().takes = of_source.reads_of_source;
            declared.emplace_back().takes = of_source.takes_of_source;
        }
    for (const std::vector<std::size_t>& pass : plan_.passes()) {
        if (std::find(pass.begin(), pass.end(), node) == pass.end()) continue;
        for (const std::size_t other : pass) declared.push_back(uses_of(plan_.nodes[other]));
    }
    return declared;
}

void Evaluator::edit_together(std::size_t first, std::size_t last, int left, PointSet& points, FrameResult& frame)
{
    std::deque<Context> contexts;
    std::vector<const Evaluation*> now;
    std::vector<const PointEdit*> edits;
    for (std::size_t i = first; i <= last; ++i) {
        now.push_back(&*contexts.emplace_back(*this, plan_.nodes[i], left, frame).evaluation);
        edits.push_back(plan_.nodes[i].op->as_point_edit());
    }
    rapid::edit_together(edits, now, points);
}

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
