// Compares grids that Rapid writes itself with the same grids built and written by OpenVDB.
#include <fmt/format.h>
#include <openvdb/points/AttributeArrayString.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/points/PointGroup.h>
#include <openvdb/tools/PointIndexGrid.h>
#include <openvdb/tree/LeafManager.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "runtime/base/openvdb_grids.h"
#include "runtime/io/format.h"
#include "runtime/io/vdb.h"
#include "runtime/io/vdb_types.h"
#include "runtime/points/column_files.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

namespace vdb = openvdb;
using vdb::points::AttributeArray;
using vdb::points::PointDataGrid;
using vdb::points::PointDataTree;
using Leaf = PointDataTree::LeafNodeType;

struct Positions {
    using value_type = vdb::Vec3d;
    using PosType = vdb::Vec3d;
    Strided<Vec3f> P;
    std::size_t count;

    std::size_t size() const { return count; }
    void getPos(std::size_t i, vdb::Vec3d& position) const { position = vdb::Vec3d(P[i].x(), P[i].y(), P[i].z()); }
};

void fill_array(AttributeArray& array, const Column<Token>& column, const std::vector<vdb::PointIndex32>& indices,
                const vdb::MetaMap& strings)
{
    vdb::points::StringAttributeWriteHandle handle(array, strings);
    const auto text = [&](vdb::Index32 i) { return std::string(column[i].text()); };
    if (std::all_of(indices.begin(), indices.end(), [&](vdb::Index32 i) { return text(i) == text(indices[0]); }))
        return handle.collapse(text(indices[0]));
    handle.expand();
    for (vdb::Index k = 0; k < indices.size(); ++k) handle.set(k, text(indices[k]));
}

template <class T>
void fill_array(AttributeArray& array, const Column<T>& column, const std::vector<vdb::PointIndex32>& indices,
                const vdb::MetaMap&)
{
    using Value = typename VdbValue<T>::Type;
    auto& typed = vdb::points::TypedAttributeArray<Value>::cast(array);
    const T& first = column[indices[0]];
    if (std::all_of(indices.begin(), indices.end(),
                    [&](vdb::Index32 i) { return std::memcmp(&column[i], &first, sizeof(T)) == 0; }))
        return typed.collapse(VdbValue<T>::from(first));
    typed.expand();
    for (vdb::Index k = 0; k < indices.size(); ++k) typed.set(k, VdbValue<T>::from(column[indices[k]]));
}

void fill_group(vdb::points::GroupWriteHandle handle, const Column<std::uint8_t>& members,
                const std::vector<vdb::PointIndex32>& indices)
{
    const bool first = members[indices[0]] != 0;
    if (std::all_of(indices.begin(), indices.end(), [&](vdb::Index32 i) { return (members[i] != 0) == first; }))
        handle.collapse(first);
    else
        for (vdb::Index k = 0; k < indices.size(); ++k) handle.set(k, members[indices[k]] != 0);
}

PointDataGrid::Ptr grid_of(const PointSet& points)
{
    const auto transform = vdb::math::Transform::createLinearTransform(std::ldexp(1.0, voxel_exponent(points)));
    const Positions positions{points.P().read(), points.size()};
    const auto indices = vdb::tools::createPointIndexGrid<vdb::tools::PointIndexGrid>(positions, *transform);
    const PointDataGrid::Ptr grid =
        vdb::points::createPointDataGrid<vdb::points::NullCodec, PointDataGrid>(*indices, positions, *transform);
    PointDataTree& tree = grid->tree();
    for (const auto& named : points.columns()) {
        if (named.first == "P") continue;
        std::visit(
            [&]<class T>(const Column<T>&) {
                if constexpr (std::is_same_v<T, Token>)
                    vdb::points::appendAttribute(tree, named.first, vdb::points::StringAttributeArray::attributeType());
                else
                    vdb::points::appendAttribute(
                        tree, named.first,
                        vdb::points::TypedAttributeArray<typename VdbValue<T>::Type>::attributeType());
            },
            named.second);
    }
    vdb::points::appendGroups(tree, points.group_names());
    vdb::MetaMap& strings = vdb::points::makeDescriptorUnique(tree)->getMetadata();
    vdb::points::StringMetaInserter list(strings);
    for (const auto& named : points.columns())
        if (const auto* column = std::get_if<Column<Token>>(&named.second))
            for (std::size_t i = 0; i < points.size(); ++i)
                if (!(*column)[i].text().empty()) list.insert(std::string((*column)[i].text()));
    const auto& descriptor = tree.cbeginLeaf()->attributeSet().descriptor();
    for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
        const auto& order = indices->tree().probeConstLeaf(leaf->origin())->indices();
        for (const auto& named : points.columns())
            if (named.first != "P")
                std::visit(
                    [&](const auto& c) {
                        fill_array(leaf->attributeArray(descriptor.find(named.first)), c, order, strings);
                    },
                    named.second);
        for (const auto& [name, members] : points.groups()) fill_group(leaf->groupWriteHandle(name), members, order);
    }
    grid->setName("points");
    grid->insertMeta("frame", vdb::Int32Metadata(1));
    grid->insertMeta("time", vdb::DoubleMetadata(0));
    return grid;
}

class Archive : public vdb::io::Archive {
public:
    void write_to(std::ostream& stream, const vdb::GridBase::ConstPtr& grid) const { write(stream, {grid}, true); }
};

std::string text_of(const std::filesystem::path& path)
{
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

// Removes the UUID, which Rapid generates itself.
std::string without_uuid(std::string text)
{
    REQUIRE(text.size() > 100);
    std::fill_n(text.begin() + 8 + 3 * 4 + 1, 36, '-');
    return text;
}

std::string by_openvdb(const PointSet& points)
{
    vdb::initialize();
    std::ostringstream stream;
    Archive archive;
    archive.setCompression(vdb::io::COMPRESS_BLOSC | vdb::io::COMPRESS_ACTIVE_MASK);
    archive.write_to(stream, grid_of(points));
    return without_uuid(stream.str());
}

std::string by_rapid(const PointSet& points)
{
    const TemporaryFolder folder;
    FrameInfo frame;
    frame.number = 1;
    write_points(folder / "a.vdb", points, frame);
    return without_uuid(text_of(folder / "a.vdb"));
}

void check_same_bytes(const PointSet& points)
{
    const std::string expected = by_openvdb(points), got = by_rapid(points);
    CHECK(got.size() == expected.size());
    CHECK((got == expected));
}

}  // namespace

TEST_CASE("a .vdb has the bytes that OpenVDB writes", "[io][vdb]")
{
    const std::size_t size = GENERATE(1, 2, 3, 17, 200, 5000, 70000);
    const float extent = GENERATE(1e-3f, 2.0f, 1e5f);
    CAPTURE(size, extent);
    check_same_bytes(random_points({.size = size, .extent = extent}));
}

TEST_CASE("a .vdb has OpenVDB's bytes where values repeat, and where no page can be packed", "[io][vdb]")
{
    PointSet points = random_points({.size = 300000, .extent = 3});
    // A single value in some leaves, and in all.
    points.column<float>("age").fill(2.5f);
    std::span<Vec3f> v = points.v().write();
    for (std::size_t i = 0; i < v.size(); ++i)
        if (points.P()[i].x() > 0) v[i] = Vec3f(0, -1, 0);
    // Incompressible bits.
    points.add({"noise", std::int32_t{0}});
    std::uint64_t state = 1;
    for (std::int32_t& x : points.column<std::int32_t>("noise").write())
        x = static_cast<std::int32_t>((state = state * 6364136223846793005u + 1442695040888963407u) >> 32);
    for (int group = 0; group < 11; ++group) {  // more than one array holds
        std::span<std::uint8_t> members = points.group(fmt::format("g{}", group)).write();
        for (std::size_t i = 0; i < members.size(); ++i)
            members[i] = points.P()[i].y() > 0.3f * static_cast<float>(group);
    }
    check_same_bytes(points);
}

TEST_CASE("a .vdb has OpenVDB's bytes with all points in one voxel, and across the root of the tree", "[io][vdb]")
{
    PointSet heap = random_points({.size = 90000});  // more than a page per leaf
    heap.P().fill(Vec3f(1, 2, 3));
    check_same_bytes(heap);

    PointSet far = random_points({.size = 4000, .extent = 1});
    std::span<Vec3f> P = far.P().write();
    for (std::size_t i = 0; i < P.size(); i += 7) P[i] *= 1e4f;  // of both signs
    check_same_bytes(far);
}

TEST_CASE("a .vdb has the same bytes from columns that lie in files", "[io][vdb]")
{
    PointSet points = random_points({.size = 400000, .extent = 5});
    for (std::size_t i = 0; i < points.size(); i += 3) points.group("third").write()[i] = 1;
    const std::string in_memory = by_rapid(points);
    const TemporaryFolder folder;
    const ColumnFiles files(folder / ".", 8 << 20);
    points = ColumnFiles::moved(std::move(points));
    CHECK((by_rapid(points) == in_memory));
    points = PointSet();
}
