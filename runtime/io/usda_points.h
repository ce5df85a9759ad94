// Reads the arrays of a Points prim in USD's text format: its default values, or its only time sample.
//
// Nothing in a file is trusted. Errors have the line but not the file's name; the caller adds it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/files/scalars.h"

namespace rapid {

struct UsdArray {
    std::string name;
    ScalarType type;           // in memory: UInt8 (bools), Int32, Int64 or Double; strings are UInt32 tokens
    std::size_t tuple;         // numbers per row
    bool quaternion;           // real part first
    std::int64_t least, most;  // range of integers
    std::vector<unsigned char> bytes;
    bool texts = false;

    std::size_t rows() const { return bytes.size() / (tuple * scalar_bytes(type)); }
};

// Throws Error if the text is not USD, has no Points prim or several, or has several time samples.
std::vector<UsdArray> usda_points(std::string_view text);

}  // namespace rapid
