// Edits of the points, one by one, by functions of the scripting language. Neighbours in a chain go over the points
// together: each chunk goes through all of them while it is in cache.
#pragma once

#include <memory>
#include <span>

#include "runtime/graph/node.h"

namespace rapid {

// One edit of one set.
class ScriptPass {
public:
    virtual ~ScriptPass() = default;

    // Points a chunk: the whole set where the script must see them in an order of its own.
    virtual std::size_t chunk() const = 0;
    // Each chunk once, from any thread. Error: what the script raised.
    virtual void visit(std::size_t begin, std::size_t end) = 0;
    // When all have been visited.
    virtual void finish() = 0;
};

// Takes so many points through the passes, in parallel, and ends them. Error: of the first pass that fails, at its
// first point that does.
void go_over(std::span<const std::unique_ptr<ScriptPass>> passes, std::size_t size);

class ScriptEdit : public Operator {
public:
    // Brings into being and makes writable what it will write.
    virtual void prepare(PointSet& points, const Evaluation& now) = 0;
    // Once all that go together are prepared. Null where there is no point to visit. The set and `now` outlive the
    // pass.
    virtual std::unique_ptr<ScriptPass> begin(PointSet& points, const Evaluation& now) = 0;

    // Whether it changes which points there are: then it is the last of those that go together.
    virtual bool removes_points() const = 0;

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override;
    Flow start(std::span<Flow> inputs, const Evaluation&) override { return std::move(inputs[0]); }
};

// All edits of the points, in their order; now: what each is told. The same as one after the other, to the bit. Error:
// as go_over().
void edit_together(std::span<ScriptEdit* const> edits, std::span<const Evaluation* const> now, PointSet& points);

}  // namespace rapid
