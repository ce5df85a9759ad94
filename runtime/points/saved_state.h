// What a node, a constraint or a simulation keeps from frame to frame, written down (state_archive.h writes it).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/points/attribute_type.h"

namespace rapid {

using KeptColumn = AttributeTypes::KeptColumn;

struct SavedState {
    std::vector<char> bytes;
    // Shared with those whose state it is, until they write them; each has values of its own for its points.
    std::vector<KeptColumn> columns;

    std::size_t size() const;  // bytes, with those of the columns
    // To the bit.
    bool operator==(const SavedState& other) const;
};

}  // namespace rapid
