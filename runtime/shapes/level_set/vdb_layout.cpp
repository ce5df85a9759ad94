#include "runtime/shapes/level_set/vdb_layout.h"

#include <blosc.h>
#include <openvdb/Metadata.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/DelayedLoadMetadata.h>

#include <array>
#include <bit>
#include <tuple>

namespace rapid {
namespace {

// The width of a leaf in voxels and of the topmost nodes in children, as powers of two (Tree_..._5_4_3).
constexpr std::size_t leaf_log2 = 3, top_log2 = 5;
constexpr std::size_t values_in(std::size_t log2) { return std::size_t{1} << 3 * log2; }
constexpr std::size_t mask_bytes(std::size_t log2) { return values_in(log2) / 8; }

std::size_t bits_in(std::span<const unsigned char> mask)
{
    std::size_t count = 0;
    for (const unsigned char byte : mask) count += static_cast<std::size_t>(std::popcount(byte));
    return count;
}

// Checks values that are stored together, packed or not.
void check_data(VdbCursor& cursor, const VdbValues& values, std::size_t count)
{
    const bool is_half = values.stored_bytes < values.bytes;
    if (is_half && count == 0) return;
    const std::uint64_t unpacked = count * values.stored_bytes;
    const bool has_blosc = (values.compression & openvdb::io::COMPRESS_BLOSC) != 0;
    if (!has_blosc && (values.compression & openvdb::io::COMPRESS_ZIP) == 0) return cursor.skip(unpacked);
    const auto packed = cursor.take<std::int64_t>();
    if (packed <= 0) {  // the negated size of data that did not compress
        if (std::uint64_t{0} - static_cast<std::uint64_t>(packed) != unpacked) throw damaged_vdb();
        return cursor.skip(unpacked);
    }
    const auto chunk = cursor.bytes(static_cast<std::uint64_t>(packed));
    if (has_blosc) check_packed(chunk, unpacked, Padding::None);  // zlib checks both sizes itself
}

// Checks the values of a node. Inactive values are not stored if they have at most two different values
// (openvdb::io::readCompressedValues).
void check_values(VdbCursor& cursor, const VdbValues& values, std::size_t log2, std::size_t active)
{
    using namespace openvdb::io;
    const auto kind = cursor.take<std::int8_t>();
    if (kind == NO_MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_ONE_INACTIVE_VAL) cursor.skip(values.bytes);
    if (kind == MASK_AND_TWO_INACTIVE_VALS) cursor.skip(2 * values.bytes);
    if (kind == MASK_AND_NO_INACTIVE_VALS || kind == MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_TWO_INACTIVE_VALS)
        cursor.skip(mask_bytes(log2));
    const bool has_all = (values.compression & COMPRESS_ACTIVE_MASK) == 0 || kind == NO_MASK_AND_ALL_VALS;
    check_data(cursor, values, has_all ? values_in(log2) : active);
}

// Checks a node and the leaves below it.
void check_node(VdbCursor& cursor, const VdbValues& values, std::size_t log2, std::vector<std::uint16_t>& active)
{
    if (log2 == leaf_log2) {
        active.push_back(static_cast<std::uint16_t>(bits_in(cursor.bytes(mask_bytes(log2)))));
        return;
    }
    const std::size_t children = bits_in(cursor.bytes(mask_bytes(log2)));
    const std::size_t active_values = bits_in(cursor.bytes(mask_bytes(log2)));
    check_values(cursor, values, log2, active_values);
    for (std::size_t child = 0; child < children; ++child) check_node(cursor, values, log2 - 1, active);
}

// Checks openvdb::io::DelayedLoadMetadata, which has a byte per leaf and, if values are packed, the size of the leaf's
// values. Each array follows its packed size, which is 0 if it is not packed.
void check_delayed_load(VdbCursor& cursor, std::uint32_t size)
{
    if (size == 0) return;
    const auto leaves = cursor.take<std::uint32_t>();
    std::uint64_t counted = 3 * sizeof size;  // as OpenVDB counts it, to decide whether more follows
    const auto check_array = [&](std::uint32_t packed, std::uint64_t unpacked) {
        const auto chunk = cursor.bytes(packed > 0 ? packed : unpacked);
        if (packed > 0) check_packed(chunk, unpacked, Padding::To128);
        counted += chunk.size();
    };
    check_array(cursor.take<std::uint32_t>(), leaves);
    constexpr std::uint32_t none = UINT32_MAX;
    if (const auto packed = cursor.take<std::uint32_t>(); packed != none)
        check_array(packed, leaves * std::uint64_t{sizeof(openvdb::io::DelayedLoadMetadata::CompressedSizeType)});
    if (counted < size) cursor.skip(size - counted);
}

}  // namespace

void check_packed(std::span<const unsigned char> chunk, std::uint64_t unpacked, Padding padding)
{
    constexpr std::size_t padded_bytes = 128;
    std::size_t known = 0;  // from the chunk's own header
    if (blosc_cbuffer_validate(chunk.data(), chunk.size(), &known) != 0) throw damaged_vdb();
    const bool is_padded = padding == Padding::To128 && known == padded_bytes && unpacked <= padded_bytes;
    if (known != unpacked && !is_padded) throw damaged_vdb();
}

void check_metadata(VdbCursor& cursor)
{
    for (auto left = cursor.take<std::uint32_t>(); left > 0; --left) {
        cursor.text();  // name
        const std::string type = cursor.text();
        const auto size = cursor.take<std::uint32_t>();
        if (type == openvdb::io::DelayedLoadMetadata::staticTypeName()) {
            check_delayed_load(cursor, size);
            continue;
        }
        // OpenVDB reads the size of the type, whatever the stated size.
        const bool has_own_size =
            openvdb::Metadata::isRegisteredType(type) && type != openvdb::StringMetadata::staticTypeName();
        if (has_own_size && openvdb::Metadata::createMetadata(type)->size() != size) throw damaged_vdb();
        cursor.skip(size);
    }
}

std::vector<std::uint16_t> check_topology(VdbCursor& cursor, const VdbValues& values)
{
    using Origin = std::array<std::int32_t, 3>;
    cursor.skip(sizeof(std::int32_t));  // number of buffers, now unused
    cursor.skip(values.bytes);          // background
    const auto tiles = cursor.take<std::uint32_t>(), children = cursor.take<std::uint32_t>();
    for (std::uint32_t tile = 0; tile < tiles; ++tile) {
        cursor.skip(sizeof(Origin) + values.bytes);
        if (cursor.take<std::uint8_t>() > 1) throw damaged_vdb();  // active flag
    }
    std::vector<std::uint16_t> active;
    Origin before;
    for (std::uint32_t child = 0; child < children; ++child) {
        // OpenVDB sorts the children and reads the leaves in that order.
        const auto origin = cursor.take<Origin>();
        if (child > 0 && origin <= before) throw damaged_vdb();
        before = origin;
        check_node(cursor, values, top_log2, active);
    }
    return active;
}

void check_voxels(VdbCursor& cursor, const VdbValues& values, std::span<const std::uint16_t> active)
{
    for (const std::uint16_t count : active) {
        cursor.skip(mask_bytes(leaf_log2));  // mask, repeated
        check_values(cursor, values, leaf_log2, count);
    }
}

}  // namespace rapid
