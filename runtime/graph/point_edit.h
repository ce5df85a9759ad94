// Edits of points one by one, independently of other points. Neighbouring edits in a chain are fused into one pass:
// each chunk goes through all of them while it is in cache. The result equals that of separate passes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/graph/node.h"
#include "runtime/graph/point_function.h"
#include "runtime/points/column.h"

namespace rapid {

// A contiguous range of the points.
struct Stretch {
    std::size_t begin, end;
    // Shape [end - begin]: 0 for points removed by an earlier edit of the pass, which later edits do not see. Null if
    // no edit removes points.
    std::uint8_t* alive;

    std::size_t size() const { return end - begin; }
    // Returns 1 for points that are alive and in the group, else 0; shape [size]. members: of the whole set.
    std::vector<std::uint8_t> choose(Strided<std::uint8_t> members) const;
    // Removes the points marked with 1; shape [size].
    void remove(std::span<const std::uint8_t> marks) const;
};

// One edit of one set. The set and `now` must outlive it.
class EditPass {
public:
    explicit EditPass(const Evaluation& evaluation) : now(evaluation) {}
    virtual ~EditPass() = default;

    // Is called after all fused edits are prepared: from here on the columns keep their addresses.
    virtual void begin() = 0;
    // Points per chunk; the whole set if a script must see the points in order.
    virtual std::size_t chunk() const { return chunk_size; }
    // Returns true if its time counts as script time.
    virtual bool is_script() const { return false; }
    // Is called once for each chunk, from any thread. Throws the script's Error.
    virtual void visit(const Stretch& stretch) = 0;

    const Evaluation& now;
};

// Applies the passes to the points, in parallel, and removes marked points. Throws the Error of the first failing
// pass, at its first failing point, with its node.
void run_passes(std::span<const std::unique_ptr<EditPass>> passes, PointSet& points, bool remove);

// The earlier edits among those fused with an edit.
struct Before {
    bool edits = false;     // there are some
    bool removals = false;  // some of them remove points
};

class PointEdit : public Operator {
public:
    // Creates the columns that it writes and makes them writable. Returns null if there is nothing more to do. Earlier
    // edits are prepared but not applied: the columns are final, their values are not.
    virtual std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const = 0;

    virtual bool removes_points() const = 0;
    // Returns true if it may read indices in the set (p.index). It is then not fused with an earlier edit that removes
    // points.
    virtual bool reads_indices() const = 0;

    const PointEdit* as_point_edit() const override { return this; }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override;
    Flow start(std::span<Flow> inputs, const Evaluation&) override { return std::move(inputs[0]); }
};

// The operator of a node whose struct has prepare(); removes_points() and reads_indices() are needed only if they may
// be true.
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
    bool reads_indices() const override
    {
        if constexpr (requires { fields_.reads_indices(); }) return fields_.reads_indices();
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

// Applies fused edits in order; now: the context of each. The result is bit-identical to applying one edit after the
// other. Throws Error as run_passes() does.
void edit_together(std::span<const PointEdit* const> edits, std::span<const Evaluation* const> now, PointSet& points);

// The points on which a node acts: those of its group for which its `where` is true.
class Selection {
public:
    // Selects the points of `group` (all if empty) for which `where` is true (all if null). `where` is evaluated only
    // for points of the group. The set and `now` must outlive it.
    Selection(const PointSet& points, std::string group, const PointFunction* where, const Evaluation& now,
              const Before& before);

    // The same as in EditPass.
    void begin();
    std::size_t chunk() const { return test_ ? test_->chunk() : chunk_size; }
    bool is_script() const { return test_ != nullptr; }

    // Returns 1 for selected points that are alive, else 0; shape [size].
    std::vector<std::uint8_t> of(const Stretch& stretch) const;

private:
    const PointSet& points_;
    const std::string group_;
    const Before before_;
    std::unique_ptr<PointTest> test_;
    Strided<std::uint8_t> members_{nullptr, 0};
};

}  // namespace rapid
