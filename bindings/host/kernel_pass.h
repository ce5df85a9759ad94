// One pass of a kernel over a point set: for each chunk, a call of the thread's runner.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bindings/host/chunk.h"
#include "bindings/host/kernel.h"
#include "bindings/host/kernel_layout.h"
#include "runtime/graph/node.h"

namespace rapid {

// A copy of what a pass needs from its node's evaluation, as an action runs after it.
struct KernelCaller {
    explicit KernelCaller(const Evaluation& now)
        : frame(now.frame), node(now.node), location(now.location), random(now.random)
    {
    }

    // For the watchdog.
    std::string title() const;

    Frame frame;
    std::string node;
    Location location;
    RandomKey random;
};

// The memory of a column or of a group.
struct ColumnMemory {
    const char* data = nullptr;     // of the set's first point
    std::size_t element_bytes = 0;  // of a point; 0 where all points share one value

    void* at(std::size_t point) const { return const_cast<char*>(data) + point * element_bytes; }
};

class KernelPass {
public:
    // params: the third argument of a Lua node's kernel. All but the pass itself must outlive it.
    KernelPass(const Kernel& kernel, const PointSet& points, const KernelCaller& caller, const KernelLayout& layout,
               const std::map<std::string, Value>& params);

    // chunk: its place and size, and the arrays that it has for the pass.
    void run(const rapid_chunk& chunk) const;

    // With pointers to the first point's values in the layout's columns; those to groups are added.
    void run(const rapid_chunk& chunk, std::vector<void*> columns) const;

    void* column(std::size_t place, std::size_t point) const { return columns_[place].at(point); }

    // What an object that moves is in the step of the pass that this thread runs now; null where there is none.
    static const Shape* shape_now(const Object* object);

private:
    struct Call {
        rapid_chunk chunk;
        std::vector<void*> pointers;  // of the layout's columns, and then of its groups
    };
    // The chunk's points from `begin` on, as a chunk of their own.
    Call part_of(const Call& call, std::int32_t begin, std::int32_t size) const;
    std::size_t bytes_between(std::size_t pointer) const;  // from point to point, of one of a call's pointers
    // In the state of this thread, as a program of lanes where the kernel is one.
    void call_lanes(State& state, const Call& call) const;
    void call_runner(State& state, const Call& call) const;
    void set_params(State& state, State::Runner& runner) const;
    Error placed(const Error& error, const rapid_chunk& chunk, const rapid_chunk& after) const;

    const Kernel& kernel_;
    const PointSet& points_;
    const KernelCaller& caller_;
    const KernelLayout& layout_;
    const std::map<std::string, Value>& params_;
    std::uint64_t serial_;  // parameters are given to each state once a pass
    std::vector<ColumnMemory> columns_, groups_;
    const Kernel::StepShapes shapes_;  // kept for as long as the pass
};

}  // namespace rapid
