// Writes .vdb (vdb.h).
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/points/PointGroup.h>
#include <openvdb/tools/PointIndexGrid.h>
#include <openvdb/tree/LeafManager.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/files/output_stream.h"
#include "runtime/io/vdb.h"
#include "runtime/io/vdb_types.h"
#include "runtime/io/vdb_voxel.h"

namespace rapid {
namespace {

namespace vdb = openvdb;
using vdb::points::AttributeArray;
using vdb::points::PointDataGrid;
using vdb::points::PointDataTree;
using Leaf = PointDataTree::LeafNodeType;
using LeafManager = vdb::tree::LeafManager<PointDataTree>;

// The interface to positions that OpenVDB's tools require.
struct Positions {
    using value_type = vdb::Vec3d;
    using PosType = vdb::Vec3d;
    Strided<Vec3f> P;
    std::size_t count;

    std::size_t size() const { return count; }
    void getPos(std::size_t i, vdb::Vec3d& position) const { position = vdb::Vec3d(P[i].x(), P[i].y(), P[i].z()); }
};

// Fills a leaf's part of a column: a uniform array where all its values have the same bits.
template <class T>
void fill_array(AttributeArray& array, const Column<T>& column, const std::vector<vdb::PointIndex32>& indices)
{
    using Value = typename VdbValue<T>::Type;
    auto& typed = vdb::points::TypedAttributeArray<Value>::cast(array);
    const Strided<T> values = column.read();
    const T& first = values[indices[0]];
    const bool uniform = column.is_uniform() || std::all_of(indices.begin(), indices.end(), [&](vdb::Index32 i) {
                             return std::memcmp(&values[i], &first, sizeof(T)) == 0;
                         });
    if (uniform) return typed.collapse(VdbValue<T>::from(first));
    typed.expand(/*fill=*/false);
    for (vdb::Index k = 0; k < indices.size(); ++k) typed.setUnsafe(k, VdbValue<T>::from(values[indices[k]]));
}

void check_names(const PointSet& points)
{
    const auto check = [](const std::string& name, const char* what) {
        if (!vdb::points::AttributeSet::Descriptor::validName(name))
            throw Error(fmt::format("the {} \"{}\" can't be written to .vdb; its name must be of letters, digits and _",
                                    what, name));
    };
    for (const auto& [name, column] : points.columns()) check(name, "attribute");
    for (const auto& [name, members] : points.groups()) check(name, "group");
}

// A leaf without points, like one whose points were all removed: it defines the attributes.
void add_empty_leaf(PointDataTree& tree)
{
    using Position = vdb::points::TypedAttributeArray<vdb::Vec3f>;
    tree.touchLeaf(vdb::Coord(0))
        ->initializeAttributes(vdb::points::AttributeSet::Descriptor::create(Position::attributeType()), 0);
}

PointDataGrid::Ptr make_point_grid(const PointSet& points)
{
    check_names(points);
    const double voxel = std::ldexp(1.0, voxel_exponent(points));
    const vdb::math::Transform::Ptr transform = vdb::math::Transform::createLinearTransform(voxel);
    const Positions positions{points.P().read(), points.size()};
    const auto indices = vdb::tools::createPointIndexGrid<vdb::tools::PointIndexGrid>(positions, *transform);
    const PointDataGrid::Ptr grid =
        vdb::points::createPointDataGrid<vdb::points::NullCodec, PointDataGrid>(*indices, positions, *transform);
    PointDataTree& tree = grid->tree();
    grid->setName("points");
    if (points.empty()) add_empty_leaf(tree);

    for (const auto& [name, column] : points.columns()) {
        if (name == "P") continue;
        std::visit(
            [&, &attribute = name](const auto& c) {
                using Value = typename VdbValue<std::decay_t<decltype(c[0])>>::Type;
                vdb::points::appendAttribute(tree, attribute, vdb::points::TypedAttributeArray<Value>::attributeType());
            },
            column);
    }
    vdb::points::appendGroups(tree, points.group_names());
    if (points.empty()) return grid;

    const auto& descriptor = tree.cbeginLeaf()->attributeSet().descriptor();
    LeafManager leaves(tree);
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        const auto& order = indices->tree().probeConstLeaf(leaf.origin())->indices();
        for (const auto& [name, column] : points.columns())
            if (name != "P")
                std::visit(
                    [&, &attribute = name](const auto& c) {
                        fill_array(leaf.attributeArray(descriptor.find(attribute)), c, order);
                    },
                    column);
        for (const auto& [name, members] : points.groups()) {
            auto handle = leaf.groupWriteHandle(name);
            const Strided<std::uint8_t> values = members.read();
            const bool uniform = std::all_of(order.begin(), order.end(), [&](vdb::Index32 i) {
                return (values[i] != 0) == (values[order[0]] != 0);
            });
            if (uniform)
                handle.collapse(values[order[0]] != 0);
            else
                for (vdb::Index k = 0; k < order.size(); ++k) handle.set(k, values[order[k]] != 0);
        }
    });
    return grid;
}

class Archive : public vdb::io::Archive {
public:
    Archive()
    {
        setCompression((hasBloscCompression() ? vdb::io::COMPRESS_BLOSC : vdb::io::COMPRESS_NONE) |
                       vdb::io::COMPRESS_ACTIVE_MASK);
    }
    void write_to(std::ostream& stream, const vdb::GridCPtrVec& grids) const
    {
        vdb::io::Archive::write(stream, grids, /*seekable=*/true);
    }
};

// OpenVDB gives each file a random UUID, with which equal points would give different bytes. This one is a hash of the
// frame and a sample of its positions.
std::string file_uuid(const PointSet& points, const FrameInfo& frame)
{
    std::uint64_t hash = 14695981039346656037ull;
    const auto add = [&](std::uint64_t bits) { hash = (hash ^ bits) * 0x9e3779b97f4a7c15ull, hash ^= hash >> 31; };
    add(static_cast<std::uint64_t>(frame.number));
    add(points.size());
    const std::size_t step = std::max<std::size_t>(1, points.size() / 1024);
    for (std::size_t i = 0; i < points.size(); i += step)
        for (int axis = 0; axis < 3; ++axis) add(std::bit_cast<std::uint32_t>(points.P()[i][axis]));
    const std::uint64_t first = hash;
    add(~first);
    return fmt::format("{:08x}-{:04x}-4{:03x}-8{:03x}-{:012x}", first >> 32, first >> 16 & 0xffff, first & 0xfff,
                       hash >> 48 & 0xfff, hash & 0xffffffffffff);
}

// Offset of the UUID: after the magic number, three versions and a flag.
constexpr std::uint64_t uuid_offset = 8 + 3 * 4 + 1;

void write_vdb(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    initialize_openvdb();
    if (points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(fmt::format("{} points are more than one grid counts; write fewer, or .csv", points.size()));
    try {
        const PointDataGrid::Ptr grid = make_point_grid(points);
        grid->insertMeta("frame", vdb::Int32Metadata(frame.number));
        grid->insertMeta("time", vdb::DoubleMetadata(frame.time));
        OutputStream stream(file);
        Archive().write_to(stream, {grid});
        stream.flush();
        const std::string uuid = file_uuid(points, frame);
        file.write_at(uuid_offset, uuid.data(), uuid.size());
    } catch (const vdb::Exception& error) {
        throw Error(fmt::format("can't be written: {}", error.what()));
    }
}

const bool defined = vdb_writer.define(write_vdb);

}  // namespace
}  // namespace rapid
