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
    bool predicate = false;  // the kernel's result is kept, and nothing may be written
    bool masked = false;     // it visits some points of a chunk alone
    bool action = false;     // it runs inside Solve
    std::string key;         // equal for layouts that one runner serves

    // Makes the columns writable that the kernel writes.
    void make_writable(PointSet& points) const;

    // Completes it, once columns stay where they are.
    void settle(const PointSet& points, bool mask);

    // Makes a settled layout that of an action: P and v are in double inside Solve, and the force is the sub-step's.
    void settle_action(bool reads_force, bool writes_force);

private:
    void make_key();
};

// The state's runner of a kernel for a layout; made when it is first asked for.
State::Runner& runner_for(State& state, std::size_t kernel, const KernelLayout& layout);

}  // namespace rapid
