// The columns and groups that a kernel sees in one pass, and the runner that a state makes for them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bindings/host/state.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct KernelLayout {
    struct Entry {
        std::string name, type;
        bool writable;
        bool uniform = false;  // all points share one value
    };
    std::vector<Entry> columns, groups;
    bool predicate = false;  // the kernel's result is stored, and nothing may be written
    bool masked = false;     // it visits only some points of a chunk
    bool action = false;     // it runs inside Solve
    std::string key;         // equal for layouts that can share a runner

    // Makes the columns that the kernel writes writable.
    void make_writable(PointSet& points) const;

    // Completes the layout, when columns no longer move in memory.
    void settle(const PointSet& points, bool mask);

    // Turns a settled layout into that of an action: P and v are in double inside Solve, and the force is the
    // substep's.
    void settle_action(bool reads_force, bool writes_force);

private:
    void make_key();
};

// Returns the state's runner of a kernel for a layout. Makes it on first use.
State::Runner& runner_for(State& state, std::size_t kernel, const KernelLayout& layout);

}  // namespace rapid
