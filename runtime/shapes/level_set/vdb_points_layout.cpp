// Checks the attributes of a grid of points (openvdb::points::PointDataLeafNode::readBuffers).
//
// They are stored in passes over the leaves: sizes, descriptors and array metadata, page headers of each attribute,
// voxels, then the pages. A page holds the arrays of one attribute of several leaves.
#include <openvdb/io/Compression.h>
#include <openvdb/points/AttributeArray.h>

#include <limits>

#include "runtime/shapes/level_set/vdb_layout.h"

namespace rapid {
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
