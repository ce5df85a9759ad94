// A pass of a kernel over a point set, with a call of the thread's runner for each chunk.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bindings/host/chunk.h"
#include "bindings/host/kernel.h"
#include "runtime/graph/node.h"

namespace rapid {

// A copy of the data that a pass needs from its node's evaluation, since an action runs after it.
struct KernelCaller {
    explicit KernelCaller(const Evaluation& now)
        : frame(now.frame), node(now.node), location(now.location), random(now.random)
    {
    }

    // The name for the watchdog.
    std::string title() const;

    Frame frame;
    std::string node;
    Location location;
    RandomKey random;
};

// The memory of a column or of a group.
struct ColumnMemory {
    const char* data = nullptr;     // of the set's first point
    std::size_t element_bytes = 0;  // from point to point; 0 if all points share one value

    void* at(std::size_t point) const { return const_cast<char*>(data) + point * element_bytes; }
};

class KernelPass {
public:
    // params: the third argument of a Lua node's kernel. Everything passed in must outlive the pass.
    KernelPass(const Kernel& kernel, const PointSet& points, const KernelCaller& caller, const KernelLayout& layout,
               const std::map<std::string, Value>& params);

    // chunk: its position and size, and its arrays for the pass.
    void run(const rapid_chunk& chunk) const;

    // columns: pointers to the first point's values in the layout's columns; those to groups are added here.
    void run(const rapid_chunk& chunk, std::vector<void*> columns) const;

    void* column(std::size_t index, std::size_t point) const { return columns_[index].at(point); }

    // Returns a moving object's shape in the step of the pass that runs on this thread, or null if it has none.
    static const Shape* shape_now(const Object* object);

private:
    struct Call {
        rapid_chunk chunk;
        std::vector<void*> pointers;  // the layout's columns, then its groups
    };
    // Returns the chunk's points from `begin` on, as a chunk of their own.
    Call part_of(const Call& call, std::int32_t begin, std::int32_t size) const;
    std::size_t bytes_between(std::size_t pointer) const;  // stride of one of a call's pointers
    // Calls the kernel in this thread's state, as a program of lanes if it has one.
    void call_lanes(State& state, const Call& call) const;
    void call_runner(State& state, const Call& call) const;
    void set_params(State& state, State::Runner& runner) const;
    Error placed(const Error& error, const rapid_chunk& chunk, const rapid_chunk& after) const;

    const Kernel& kernel_;
    const PointSet& points_;
    const KernelCaller& caller_;
    const KernelLayout& layout_;
    const std::map<std::string, Value>& params_;
    std::uint64_t serial_;  // parameters are passed to each state once per pass
    std::vector<ColumnMemory> columns_, groups_;
    const Kernel::StepShapes shapes_;  // held for as long as the pass
};

}  // namespace rapid
