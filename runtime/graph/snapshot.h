// The state of a run between two frames: another evaluator of the same graph continues from it with bit-identical
// results.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "runtime/points/saved_state.h"

namespace rapid {

struct Snapshot {
    std::int64_t frame = 0;                         // the last computed frame
    std::map<std::string, SavedState> simulations;  // by the name of the Create
    std::map<std::string, SavedState> nodes;        // of stateful nodes, by name
    std::map<std::string, SavedState> constants;    // points of merges whose result never changes, by name

    std::size_t size() const;  // bytes
    bool operator==(const Snapshot&) const = default;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(frame, simulations, nodes, constants);
    }
};

}  // namespace rapid
