#include "runtime/shapes/level_set/vdb_layout.h"

#include <blosc.h>
#include <openvdb/Metadata.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/points/AttributeArray.h>

#include <array>
#include <bit>
#include <limits>
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

// Checks the attributes of a grid of points (openvdb::points::PointDataLeafNode::readBuffers).
//
// They are stored in passes over the leaves: sizes, descriptors and array metadata, page headers of each attribute,
// voxels, then the pages. A page holds the arrays of one attribute of several leaves.

namespace {

using openvdb::points::AttributeArray;

constexpr std::size_t voxels_of_leaf = 512;

// One attribute of one leaf.
struct StoredArray {
    std::uint64_t bytes = 0;     // as the file says
    std::uint64_t expected = 0;  // from its type and number of values
    bool is_paged = false, is_uniform = false;
};

// The attributes of a leaf: bytes of a stored value of each. All leaves usually share one list.
using Descriptor = std::vector<std::size_t>;

Descriptor take_descriptor(VdbCursor& cursor)
{
    Descriptor value_bytes;
    const auto attributes = cursor.take<std::uint64_t>();
    for (std::uint64_t a = 0; a < attributes; ++a) {
        const std::string type = cursor.text(), codec = cursor.text();
        if (!AttributeArray::isRegistered({type, codec}))
            throw Error("can't be read: an attribute has the unknown type " + type + " " + codec);
        value_bytes.push_back(AttributeArray::create({type, codec}, 1)->storageTypeSize());
    }
    for (std::uint64_t a = 0; a < attributes; ++a) {
        cursor.text();  // name
        if (cursor.take<std::uint64_t>() >= attributes) throw damaged_vdb();
    }
    for (auto groups = cursor.take<std::uint64_t>(); groups > 0; --groups) {
        cursor.text();
        cursor.skip(sizeof(std::uint64_t));  // OpenVDB checks it
    }
    check_metadata(cursor);
    return value_bytes;
}

StoredArray take_array(VdbCursor& cursor, std::size_t value_bytes)
{
    enum : std::uint8_t { Strided = 1, Uniform = 2, Paged = 8 };
    constexpr std::uint8_t constant_stride = 0x8;
    // The stated size of an array includes fields that OpenVDB once wrote after it.
    constexpr std::uint64_t counted = sizeof(std::uint16_t) + sizeof(std::uint32_t);
    const auto bytes = cursor.take<std::uint64_t>();
    const auto flags = cursor.take<std::uint8_t>(), stored = cursor.take<std::uint8_t>();
    const std::uint64_t values = cursor.take<std::uint32_t>();
    const std::uint64_t stride = (stored & Strided) != 0 ? cursor.take<std::uint32_t>() : 1;
    const std::uint64_t all = (flags & constant_stride) != 0 ? values * stride : stride;
    if (bytes < counted || all > std::numeric_limits<std::uint32_t>::max()) throw damaged_vdb();
    const bool is_uniform = (stored & Uniform) != 0;
    return {bytes - counted, (is_uniform ? 1 : all) * value_bytes, (stored & Paged) != 0, is_uniform};
}

class PointsLayout {
public:
    PointsLayout(VdbCursor& cursor, std::size_t leaves) : cursor_(cursor), leaves_(leaves) {}

    void check()
    {
        const auto passes = cursor_.take<std::uint16_t>();
        if (leaves_.empty()) return;
        // One pass each for sizes, metadata, voxels and cleanup, and two for each attribute.
        if (passes < 4 || passes % 2 != 0) throw damaged_vdb();
        attributes_ = (passes - 4u) / 2;
        cursor_.skip(leaves_.size() * sizeof(std::uint16_t));  // packed sizes of the voxels, which are repeated later
        take_metadata();
        std::vector<std::vector<Page>> pages;
        for (std::size_t a = 0; a < attributes_; ++a) pages.push_back(take_pages(a));
        check_voxels();
        for (std::size_t a = 0; a < attributes_; ++a) check_attribute(a, pages[a]);
    }

private:
    struct Page {
        std::int32_t stored;     // bytes in the file; negative if it is not packed
        std::uint64_t unpacked;  // bytes
    };

    void take_metadata()
    {
        enum : std::uint8_t { Shared = 1, Skipped = 2, Known = Shared | Skipped };
        Descriptor descriptor;
        bool is_shared = false;
        for (std::vector<StoredArray>& arrays : leaves_) {
            if (!is_shared) {
                const auto header = cursor_.take<std::uint8_t>();
                if (header > Known) throw damaged_vdb();
                descriptor = take_descriptor(cursor_);
                if ((header & Skipped) != 0) cursor_.skip(cursor_.take<std::uint64_t>());
                is_shared = (header & Shared) != 0;
            }
            if (descriptor.size() > attributes_) throw damaged_vdb();  // OpenVDB would leave arrays uninitialised
            for (const std::size_t value_bytes : descriptor) arrays.push_back(take_array(cursor_, value_bytes));
        }
    }

    // Calls f with each array of an attribute.
    template <class F>
    void for_each_array(std::size_t attribute, const F& f)
    {
        for (const std::vector<StoredArray>& arrays : leaves_)
            if (attribute < arrays.size()) f(arrays[attribute]);
    }

    // Returns the headers of an attribute's pages. Pages end where arrays do.
    std::vector<Page> take_pages(std::size_t attribute)
    {
        std::vector<Page> pages;
        std::uint64_t left = 0;  // bytes of the page that belong to further arrays
        for_each_array(attribute, [&](const StoredArray& array) {
            if (!array.is_paged) return;
            if (array.bytes != array.expected) throw damaged_vdb();
            if (left == 0) {
                const auto stored = cursor_.take<std::int32_t>();
                const std::int64_t unpacked = stored > 0 ? cursor_.take<std::int32_t>() : -std::int64_t{stored};
                if (unpacked <= 0) throw damaged_vdb();
                pages.push_back({stored, static_cast<std::uint64_t>(unpacked)});
                left = pages.back().unpacked;
            }
            if (array.bytes == 0 || array.bytes > left) throw damaged_vdb();
            left -= array.bytes;
        });
        if (left != 0) throw damaged_vdb();
        return pages;
    }

    // Checks the voxels of each leaf. Each holds the index past its last point.
    void check_voxels()
    {
        constexpr std::uint16_t not_packed = 0xffff;
        constexpr std::uint64_t unpacked = voxels_of_leaf * sizeof(std::uint32_t);
        for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
            cursor_.skip(voxels_of_leaf / 8);  // mask, repeated
            if (const auto packed = cursor_.take<std::uint16_t>(); packed == not_packed)
                cursor_.skip(unpacked);
            else
                check_packed(cursor_.bytes(packed), unpacked, Padding::To128);
        }
    }

    void check_attribute(std::size_t attribute, const std::vector<Page>& pages)
    {
        auto page = pages.begin();
        std::uint64_t left = 0;
        for_each_array(attribute, [&](const StoredArray& array) {
            if (!array.is_paged) return check_single(array);
            if (left == 0) {
                if (page->stored > 0)
                    check_packed(cursor_.bytes(static_cast<std::uint64_t>(page->stored)), page->unpacked,
                                 Padding::To128);
                else
                    cursor_.skip(page->unpacked);
                left = page++->unpacked;
            }
            left -= array.bytes;
        });
    }

    // Checks an array that is not in a page.
    void check_single(const StoredArray& array)
    {
        const bool is_packed = !array.is_uniform && cursor_.take<std::uint8_t>() == 1;
        const auto bytes = cursor_.bytes(array.bytes);
        if (is_packed)
            check_packed(bytes, array.expected, Padding::To128);
        else if (array.bytes != array.expected)
            throw damaged_vdb();
    }

    VdbCursor& cursor_;
    std::vector<std::vector<StoredArray>> leaves_;
    std::size_t attributes_ = 0;
};

}  // namespace

void check_points(VdbCursor& cursor, std::size_t leaves) { PointsLayout(cursor, leaves).check(); }

}  // namespace rapid
