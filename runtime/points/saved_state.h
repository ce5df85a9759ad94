// The serialised state that a node, a constraint or a simulation carries from frame to frame (written by
// state_archive.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/points/attribute_type.h"

namespace rapid {

using SavedColumn = AttributeTypes::SavedColumn;

struct SavedState {
    std::vector<char> bytes;
    // The columns of the state that have a value per point. They are shared with the state's owner until it writes
    // them.
    std::vector<SavedColumn> columns;

    std::size_t size() const;  // bytes, including the columns
    // Compares bitwise.
    bool operator==(const SavedState& other) const;
};

}  // namespace rapid
