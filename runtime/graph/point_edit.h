// Edits of the points, one by one: what a node does to each of them whatever the others are. Neighbours in a chain go
// over the points together, as if one after the other: each chunk goes through all of them while it is in cache.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/parallel.h"
#include "runtime/points/column.h"

namespace rapid {

// Some of the points, neighbours in the set.
struct Stretch {
    std::size_t begin, end;
    // Shape [end - begin]: 0 for those that an edit of the pass has removed, which are no more for those that follow.
    // Null where none of them removes points.
    std::uint8_t* alive;

    std::size_t size() const { return end - begin; }
    // 1 for those that are alive and members, of the whole set, else 0; shape [size].
    std::vector<std::uint8_t> choose(Strided<std::uint8_t> members) const;
    // Removes those that are marked by 1; shape [size].
    void remove(std::span<const std::uint8_t> marks) const;
};

// What one edit does to one set. The set and `now` outlive it.
class EditPass {
public:
    explicit EditPass(const Evaluation& told) : now(told) {}
    virtual ~EditPass() = default;

    // When all that go together are prepared: columns stay where they are from here on.
    virtual void begin() = 0;
    // Points a chunk: the whole set where a script must see them in an order of its own.
    virtual std::size_t chunk() const { return chunk_size; }
    // Whether its time is that of scripts.
    virtual bool is_script() const { return false; }
    // Each chunk once, from any thread. Error: what a script raised.
    virtual void visit(const Stretch& stretch) = 0;

    const Evaluation& now;
};

// Takes the points through the passes, in parallel, and removes those that are to go. Error: of the first pass that
// fails, at its first point that does, with its node.
void go_over(std::span<const std::unique_ptr<EditPass>> passes, PointSet& points, bool remove);

// What comes before an edit among those that go together.
struct Before {
    bool edits = false;     // any at all
    bool removals = false;  // some that remove points
};

class PointEdit : public Operator {
public:
    // Brings into being and makes writable what it will write. Null where there is nothing more to do. The edits before
    // it are prepared and have not been over the points: names are as it will meet them, values are not.
    virtual std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const = 0;

    virtual bool removes_points() const = 0;
    // Whether it may ask for places in the set (p.index). It does not go with one before it that removes points.
    virtual bool asks_places() const = 0;

    const PointEdit* as_point_edit() const override { return this; }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override;
    Flow start(std::span<Flow> inputs, const Evaluation&) override { return std::move(inputs[0]); }
};

// The operator of a node whose struct has prepare() and, where they are more than `false`, the questions.
template <class T>
class PointEditOf : public PointEdit {
public:
    explicit PointEditOf(T fields = {}) : fields_(std::move(fields)) {}

    void* fields() override { return &fields_; }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const override
    {
        return fields_.prepare(points, now, before);
    }
    bool removes_points() const override
    {
        if constexpr (requires { fields_.removes_points(); }) return fields_.removes_points();
        return false;
    }
    bool asks_places() const override
    {
        if constexpr (requires { fields_.asks_places(); }) return fields_.asks_places();
        return false;
    }
    void uses(Uses& uses) const override
    {
        if constexpr (requires { fields_.group; })
            if (!fields_.group.empty()) uses.reads_groups.push_back(fields_.group);
        fields_.uses(uses);
    }
    void check() const override
    {
        if constexpr (requires { fields_.check(); }) fields_.check();
    }

private:
    T fields_;
};

// All edits of the points, in their order; now: what each is told. The same as one after the other, to the bit. Error:
// as go_over().
void edit_together(std::span<const PointEdit* const> edits, std::span<const Evaluation* const> now, PointSet& points);

}  // namespace rapid
