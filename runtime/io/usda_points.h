// The arrays of a prim of points in USD's text: those of its default values, or of its one time sample.
//
// Nothing in a file is trusted. Errors say what is wrong, with the line; who calls adds the file's name.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/files/scalars.h"

namespace rapid {

struct UsdArray {
    std::string name;
    ScalarType type;    // in memory: UInt8 (of truth values), Int32, Int64 or Double; of texts UInt32, their tokens
    std::size_t tuple;  // numbers of a row
    bool quaternion;    // the real part first
    std::int64_t least, most;  // of integers
    std::vector<unsigned char> bytes;
    bool texts = false;

    std::size_t rows() const { return bytes.size() / (tuple * scalar_bytes(type)); }
};

// Error: no USD text; no prim of the type Points, or several; several time samples.
std::vector<UsdArray> usda_points(std::string_view text);

}  // namespace rapid
