// Checks the sizes in a .vdb file on which OpenVDB relies.
//
// OpenVDB passes compressed data to Blosc, which reads as far as the header of the data says, and fills arrays to the
// length that the file says. A damaged size would therefore yield uninitialised memory as values. These functions walk
// over a grid without unpacking it and compare every size with the data that it describes.
//
// They know the format versions 223 and 224. Older files have neither Blosc nor points, so a stream that throws
// (vdb_file.h) is enough for them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/error.h"

namespace rapid {

// Returns the error for a file that ends too early or contradicts itself.
inline Error damaged_vdb() { return Error("can't be read: it is cut off or damaged"); }

// A position in the file. Every function throws Error if it would read past the end of the file.
class VdbCursor {
public:
    VdbCursor(std::span<const unsigned char> file, std::size_t at) : file_(file), at_(at) {}

    std::size_t at() const { return at_; }
    std::span<const unsigned char> bytes(std::uint64_t count)
    {
        if (at_ > file_.size() || count > file_.size() - at_) throw damaged_vdb();
        at_ += count;
        return file_.subspan(at_ - count, count);
    }
    void skip(std::uint64_t count) { bytes(count); }
    template <class T>
    T take()
    {
        T value;
        std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
        return value;
    }
    // Returns a string, which is stored after its length.
    std::string text()
    {
        const auto taken = bytes(take<std::uint32_t>());
        return {taken.begin(), taken.end()};
    }

private:
    std::span<const unsigned char> file_;
    std::size_t at_;
};

// How the values of a grid are stored.
struct VdbValues {
    std::size_t bytes = 0;          // per value in memory
    std::size_t stored_bytes = 0;   // per value in the file: half of `bytes` in 16-bit grids
    std::uint32_t compression = 0;  // OpenVDB's flags (openvdb/io/Compression.h)
};

// Checks that a Blosc chunk unpacks to the expected size. Point grids pad shorter data to 128 bytes.
enum class Padding { None, To128 };
void check_packed(std::span<const unsigned char> chunk, std::uint64_t unpacked, Padding padding);

// Checks a list of metadata and moves the cursor to its end.
void check_metadata(VdbCursor& cursor);

// Checks the nodes of a tree and moves the cursor to their end. Returns the number of active voxels of each leaf, in
// OpenVDB's order.
std::vector<std::uint16_t> check_topology(VdbCursor& cursor, const VdbValues& values);

// Checks the voxels of the leaves of a grid of numbers or vectors and moves the cursor to their end.
void check_voxels(VdbCursor& cursor, const VdbValues& values, std::span<const std::uint16_t> active);

// Checks the voxels and attributes of a grid of points and moves the cursor to their end.
void check_points(VdbCursor& cursor, std::size_t leaves);

}  // namespace rapid
