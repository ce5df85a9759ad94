// .vdb: OpenVDB points, one PointDataGrid "points", as Houdini and everything else with OpenVDB reads it.
//
// Attributes keep their names and become OpenVDB's float, vec3s, int32, int64 and quats, uncompressed in memory and
// packed with Blosc in the file; a value that all points share is a uniform array in every leaf; groups are OpenVDB
// point groups. A set without points is one empty leaf, which knows the attributes and groups.
//
// Positions are exact. OpenVDB holds a position as an offset from its voxel's centre; with a voxel size that is a power
// of two and no translation, both the division and the offset are exact in float (the offset has no more bits than the
// position), so reading gives back the same bits, for every |P| from voxel 2^-126 to voxel 2^30. The voxel is chosen
// from the points' density for about leaf_points in each leaf that holds any.
//
// Reads the points of all PointDataGrids of a file, with any codecs, in order of id.
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
#include <limits>
#include <map>
#include <numeric>
#include <ostream>
#include <streambuf>
#include <unordered_set>

#include "runtime/io/attribute_names.h"
#include "runtime/io/file.h"
#include "runtime/io/format.h"
#include "runtime/io/id_order.h"
#include "runtime/io/vdb.h"
#include "runtime/parallel.h"

namespace rapid {
namespace {

namespace vdb = openvdb;
using vdb::points::AttributeArray;
using vdb::points::PointDataGrid;
using vdb::points::PointDataTree;
using Leaf = PointDataTree::LeafNodeType;
using LeafManager = vdb::tree::LeafManager<PointDataTree>;

// Points in a leaf (of 8³ voxels) that the voxel size aims at. Few make leaves costly (each holds 2 KiB of offsets and
// an array an attribute), many make queries by place slow and leave the threads nothing to share.
constexpr double leaf_points = 2048;
constexpr double leaf_width = 8;  // voxels

// OpenVDB refuses a map whose determinant, the cube of the voxel size, is below 3e-15: 2^-16 m is the finest.
constexpr int smallest_exponent = -16;

// Before any other use of OpenVDB.
void initialize_openvdb()
{
    static const bool done = (vdb::initialize(), true);
    (void)done;
}

// Rapid's types beside OpenVDB's, of the same layout.
template <class T>
struct VdbValue {
    using Type = T;
    static const T& from(const T& value) { return value; }
};
template <>
struct VdbValue<Vec3f> {
    using Type = vdb::Vec3s;
    static Type from(const Vec3f& value) { return {value.x(), value.y(), value.z()}; }
};
template <>
struct VdbValue<Quatf> {
    using Type = vdb::math::Quat<float>;
    static Type from(const Quatf& value) { return {value.x(), value.y(), value.z(), value.w()}; }
};

// The largest |coordinate|. Error: one that is not finite, which no voxel holds.
double largest_coordinate(const PointSet& points)
{
    const Strided<Vec3f> P = points.P().read();
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double here = P[i].cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
        if (!std::isfinite(here))
            throw Error(
                fmt::format("point {}: P = {} {} {} has no place in a grid; write .bgeo, .ply or .csv, or "
                            "remove the point",
                            points.id()[i], P[i].x(), P[i].y(), P[i].z()));
        largest = std::max(largest, here);
    }
    return largest;
}

// How many cells of that size hold a sample.
std::size_t occupied_cells(const std::vector<Vec3f>& sample, int exponent)
{
    std::unordered_set<std::uint64_t> cells;
    for (const Vec3f& P : sample) {
        std::uint64_t key = 0;
        // Two cells with one key would count as one: the estimate does not mind.
        for (int axis = 0; axis < 3; ++axis) {
            const double cell = std::floor(std::ldexp(static_cast<double>(P[axis]), -exponent));
            key = (key ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(cell))) * 0x9e3779b97f4a7c15ull;
            key ^= key >> 29;
        }
        cells.insert(key);
    }
    return cells.size();
}

// The exponent e of the voxel size 2^e m.
//
// A sample of the points shows how wide a cell must be to hold some of them, and as what (a line, a surface, a volume)
// their number grows with the width; that gives the width of a cell that holds leaf_points of all.
int voxel_exponent(const PointSet& points)
{
    const double largest = largest_coordinate(points);
    if (largest == 0) return 0;
    // Finer, and the voxels of the farthest point could not be counted in int32.
    const int finest = std::max(std::ilogb(largest) - 29, smallest_exponent);

    constexpr std::size_t sample_size = 4096;
    constexpr double sampled_in_cell = 8;
    const std::size_t step = (points.size() + sample_size - 1) / sample_size;
    std::vector<Vec3f> sample;
    for (std::size_t i = 0; i < points.size(); i += step) sample.push_back(points.P()[i]);

    // From the coarsest, a cell for all, towards finer ones.
    int cell = std::ilogb(largest) + 2;
    std::size_t coarser = 1, occupied = 1;
    for (; cell - 1 > finest + 3; --cell) {
        const std::size_t finer = occupied_cells(sample, cell - 1);
        if (static_cast<double>(sample.size()) / static_cast<double>(finer) < sampled_in_cell) break;
        coarser = std::exchange(occupied, finer);
    }
    const double dimension =
        std::clamp(std::log2(static_cast<double>(occupied) / static_cast<double>(coarser)), 1.0, 3.0);
    const double points_in_cell = static_cast<double>(points.size()) / static_cast<double>(occupied);
    const double finer_by = std::log2(points_in_cell / leaf_points) / dimension;
    const int exponent = cell - static_cast<int>(std::lround(finer_by)) - std::ilogb(leaf_width);
    return std::clamp(exponent, finest, std::max(finest, std::ilogb(largest) + 2));
}

// Positions as OpenVDB's tools ask for them.
struct Positions {
    using value_type = vdb::Vec3d;
    using PosType = vdb::Vec3d;
    Strided<Vec3f> P;
    std::size_t count;

    std::size_t size() const { return count; }
    void getPos(std::size_t i, vdb::Vec3d& position) const { position = vdb::Vec3d(P[i].x(), P[i].y(), P[i].z()); }
};

// Writes the leaf's share of a column: a uniform array where all its values have the same bits.
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

// A leaf without points, as OpenVDB leaves one whose points were all removed: it knows the attributes.
void add_empty_leaf(PointDataTree& tree)
{
    using Position = vdb::points::TypedAttributeArray<vdb::Vec3f>;
    tree.touchLeaf(vdb::Coord(0))
        ->initializeAttributes(vdb::points::AttributeSet::Descriptor::create(Position::attributeType()), 0);
}

PointDataGrid::Ptr make_grid(const PointSet& points)
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
            [&](const auto& c) {
                using Value = typename VdbValue<std::decay_t<decltype(c[0])>>::Type;
                vdb::points::appendAttribute(tree, name, vdb::points::TypedAttributeArray<Value>::attributeType());
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
                std::visit([&](const auto& c) { fill_array(leaf.attributeArray(descriptor.find(name)), c, order); },
                           column);
        for (const auto& [name, members] : points.groups()) {
            auto handle = leaf.groupWriteHandle(name);
            if (members.is_uniform())
                handle.collapse(members[0] != 0);
            else
                for (vdb::Index k = 0; k < order.size(); ++k) handle.set(k, members[order[k]] != 0);
        }
    });
    return grid;
}

// OpenVDB writes to a stream and forgets to ask it whether that worked, so the stream throws, and with the system's
// reason.
class OutputBuffer : public std::streambuf {
public:
    explicit OutputBuffer(OutputFile& file) : file_(file), block_(std::size_t{1} << 20)
    {
        setp(block_.data(), block_.data() + block_.size());
    }

    void flush()
    {
        file_.write_at(offset_, pbase(), static_cast<std::size_t>(pptr() - pbase()));
        offset_ += static_cast<std::uint64_t>(pptr() - pbase());
        setp(block_.data(), block_.data() + block_.size());
    }

protected:
    int_type overflow(int_type c) override
    {
        flush();
        if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
        return traits_type::not_eof(c);
    }
    int sync() override
    {
        flush();
        return 0;
    }
    pos_type seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode) override
    {
        const std::uint64_t here = offset_ + static_cast<std::uint64_t>(pptr() - pbase());
        end_ = std::max(end_, here);
        if (direction == std::ios_base::cur && offset == 0) return pos_type(static_cast<off_type>(here));
        const off_type base = direction == std::ios_base::beg   ? 0
                              : direction == std::ios_base::cur ? static_cast<off_type>(here)
                                                                : static_cast<off_type>(end_);
        flush();
        offset_ = static_cast<std::uint64_t>(base + offset);
        return pos_type(base + offset);
    }
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) override
    {
        return seekoff(off_type(position), std::ios_base::beg, mode);
    }

private:
    OutputFile& file_;
    std::vector<char> block_;
    std::uint64_t offset_ = 0;  // of the block in the file
    std::uint64_t end_ = 0;
};

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

// OpenVDB marks each file with a random UUID, and the same points would never give the same bytes. This one is made
// from the frame and a sample of its positions.
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

// Where the UUID is: behind the magic number, three versions and a flag.
constexpr std::uint64_t uuid_offset = 8 + 3 * 4 + 1;

void write_vdb(const std::filesystem::path& path, const PointSet& points, const FrameInfo& frame)
{
    initialize_openvdb();
    if (points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(fmt::format("{} points are more than one grid counts; write fewer, or .csv", points.size()));
    try {
        const PointDataGrid::Ptr grid = make_grid(points);
        grid->insertMeta("frame", vdb::Int32Metadata(frame.number));
        grid->insertMeta("time", vdb::DoubleMetadata(frame.time));
        OutputFile file(path);
        OutputBuffer buffer(file);
        std::ostream stream(&buffer);
        stream.exceptions(std::ios_base::badbit | std::ios_base::failbit);  // rethrows the buffer's own error
        Archive().write_to(stream, {grid});
        buffer.flush();
        const std::string uuid = file_uuid(points, frame);
        file.write_at(uuid_offset, uuid.data(), uuid.size());
        file.close();
    } catch (const vdb::Exception& error) {
        throw Error(fmt::format("can't be written: {}", error.what()));
    }
}

// A point of a file's leaf goes to this place on.
struct LeafPlace {
    const Leaf* leaf;
    std::size_t first;
};

std::vector<LeafPlace> leaf_places(const PointDataGrid& grid, std::size_t first)
{
    std::vector<LeafPlace> places;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->getLastValue() > 0) places.push_back({&*leaf, first});
        first += leaf->getLastValue();
    }
    return places;
}

template <class F>
void for_each_leaf(const std::vector<LeafPlace>& places, const F& f)
{
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) { f(*places[i].leaf, places[i].first); });
}

void read_positions(const PointDataGrid& grid, const std::vector<LeafPlace>& places, std::span<Vec3f> P)
{
    const vdb::math::Transform& transform = grid.transform();
    const bool scaled = transform.mapType() == vdb::math::UniformScaleMap::mapType();
    const double voxel = transform.voxelSize()[0];
    for_each_leaf(places, [&](const Leaf& leaf, std::size_t first) {
        const vdb::points::AttributeHandle<vdb::Vec3f> offsets(leaf.constAttributeArray("P"));
        vdb::Index k = 0;
        for (vdb::Index place = 0; place < Leaf::SIZE; ++place) {
            const vdb::Coord voxel_index = leaf.offsetToGlobalCoord(place);
            for (; k < leaf.getValue(place); ++k) {
                const vdb::Vec3f offset = offsets.get(k);
                vdb::Vec3d index;
                // At voxel 0 nothing is added: -0 stays what it is.
                for (int axis = 0; axis < 3; ++axis)
                    index[axis] = voxel_index[axis] == 0 ? static_cast<double>(offset[axis])
                                                         : voxel_index[axis] + static_cast<double>(offset[axis]);
                const vdb::Vec3d world = scaled ? index * voxel : transform.indexToWorld(index);
                P[first + k] = Vec3d(world.x(), world.y(), world.z()).cast<float>();
            }
        }
    });
}

// A value of OpenVDB's as one of Rapid's.
template <class T, class Value>
T rapid_value(const Value& value)
{
    if constexpr (std::is_same_v<T, Vec3f>)
        return Vec3f(static_cast<float>(value[0]), static_cast<float>(value[1]), static_cast<float>(value[2]));
    else if constexpr (std::is_same_v<T, Quatf>)
        return Quatf(static_cast<float>(value[3]), static_cast<float>(value[0]), static_cast<float>(value[1]),
                     static_cast<float>(value[2]));
    else
        return static_cast<T>(value);
}

// The column `name`, made when a grid before had none.
template <class T>
Column<T>& column_for(PointSet& points, const std::string& name)
{
    return std::get<Column<T>>(points.add({name, AttributeValue(Column<T>::zero())}));
}

template <class T, class Value>
void read_attribute(PointSet& points, const std::vector<LeafPlace>& places, const std::string& name,
                    const std::string& column_name, vdb::Index component)
{
    Column<T>& column = column_for<T>(points, column_name);
    if (places.empty()) return;
    const auto handle = [&](const Leaf& leaf) {
        return vdb::points::AttributeHandle<Value>(leaf.constAttributeArray(name));
    };

    std::size_t count = 0;
    const T first = rapid_value<T>(handle(*places[0].leaf).get(0, component));
    const bool uniform = std::all_of(places.begin(), places.end(), [&](const LeafPlace& place) {
        count += place.leaf->getLastValue();
        const auto values = handle(*place.leaf);
        const T here = rapid_value<T>(values.get(0, component));
        return values.isUniform() && std::memcmp(&here, &first, sizeof(T)) == 0;
    });
    if (uniform && count == points.size()) {
        column.fill(first);
        return;
    }
    std::span<T> values = column.write();
    for_each_leaf(places, [&](const Leaf& leaf, std::size_t at) {
        const auto from = handle(leaf);
        for (vdb::Index k = 0; k < leaf.getLastValue(); ++k) values[at + k] = rapid_value<T>(from.get(k, component));
    });
}

using ReadAttribute = void (*)(PointSet&, const std::vector<LeafPlace>&, const std::string&, const std::string&,
                               vdb::Index);

// By OpenVDB's name of the type; text and matrices are not there.
const std::map<std::string, ReadAttribute>& readers()
{
    static const std::map<std::string, ReadAttribute> all = {
        {"float", read_attribute<float, float>},
        {"double", read_attribute<float, double>},
        {"half", read_attribute<float, vdb::math::half>},
        {"bool", read_attribute<std::int32_t, bool>},
        {"int8", read_attribute<std::int32_t, std::int8_t>},
        {"int16", read_attribute<std::int32_t, std::int16_t>},
        {"int32", read_attribute<std::int32_t, std::int32_t>},
        {"int64", read_attribute<std::int64_t, std::int64_t>},
        {"vec3s", read_attribute<Vec3f, vdb::Vec3s>},
        {"vec3d", read_attribute<Vec3f, vdb::Vec3d>},
        {"vec3i", read_attribute<Vec3f, vdb::Vec3i>},
        {"quats", read_attribute<Quatf, vdb::math::Quat<float>>},
        {"quatd", read_attribute<Quatf, vdb::math::Quat<double>>},
    };
    return all;
}

void read_grid(const PointDataGrid& grid, std::size_t first, PointSet& points, bool& has_id)
{
    const std::vector<LeafPlace> places = leaf_places(grid, first);
    const auto any = grid.tree().cbeginLeaf();
    if (!any) return;
    const Leaf& leaf = places.empty() ? *any : *places[0].leaf;
    const auto& descriptor = leaf.attributeSet().descriptor();
    if (descriptor.find("P") == vdb::points::AttributeSet::INVALID_POS)
        throw Error(fmt::format("the points of the grid \"{}\" have no P", grid.getName()));
    if (!places.empty()) read_positions(grid, places, points.P().write());

    for (const auto& [name, position] : descriptor.map()) {
        const AttributeArray& array = leaf.constAttributeArray(position);
        if (name == "P" || vdb::points::isGroup(array)) continue;
        const std::string type = descriptor.valueType(position);
        if (name == "id" && array.stride() == 1 && (type == "int32" || type == "int64")) {
            (type == "int32" ? read_attribute<std::int64_t, std::int32_t>
                             : read_attribute<std::int64_t, std::int64_t>)(points, places, name, name, 0);
            has_id = true;
            continue;
        }
        const auto reader = readers().find(type);
        if (reader == readers().end() || !array.hasConstantStride()) continue;
        for (vdb::Index component = 0; component < array.stride(); ++component)
            reader->second(points, places, name, array.stride() == 1 ? name : fmt::format("{}{}", name, component),
                           component);
    }
    for (const auto& [name, offset] : descriptor.groupMap()) {
        Column<std::uint8_t>& column = points.group(name);
        if (places.empty()) continue;
        std::span<std::uint8_t> members = column.write();
        for_each_leaf(places, [&, group = name](const Leaf& part, std::size_t at) {
            const auto handle = part.groupHandle(group);
            for (vdb::Index k = 0; k < part.getLastValue(); ++k) members[at + k] = handle.get(k);
        });
    }
}

PointSet read_vdb(const std::filesystem::path& path)
{
    initialize_openvdb();
    const InputFile exists(path);  // for the system's reason where it can't be opened
    try {
        vdb::io::File file(path.string());
        file.open(/*delayed loading=*/false);
        std::vector<PointDataGrid::ConstPtr> grids;
        std::string others;
        std::size_t count = 0;
        for (auto name = file.beginName(); name != file.endName(); ++name) {
            const auto metadata = file.readGridMetadata(name.gridName());
            if (!metadata->isType<PointDataGrid>()) {
                others += fmt::format("{}\"{}\" ({})", others.empty() ? "" : ", ", name.gridName(), metadata->type());
                continue;
            }
            grids.push_back(vdb::gridConstPtrCast<PointDataGrid>(file.readGrid(name.gridName())));
            for (auto leaf = grids.back()->tree().cbeginLeaf(); leaf; ++leaf) count += leaf->getLastValue();
        }
        if (grids.empty())
            throw Error(others.empty() ? std::string("the file holds no grids")
                                       : fmt::format("the file holds no points; its grids are {}", others));

        PointSet points;
        points.append(count);
        bool has_id = false;
        std::size_t first = 0;
        for (const PointDataGrid::ConstPtr& grid : grids) {
            read_grid(*grid, first, points, has_id);
            for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) first += leaf->getLastValue();
        }
        if (count == 0) return points;
        if (has_id) return reordered(points, id_order(points.id()));
        std::span<std::int64_t> ids = points.id().overwrite();
        std::iota(ids.begin(), ids.end(), std::int64_t{0});
        return points;
    } catch (const vdb::Exception& error) {
        throw Error(fmt::format("can't be read: {}", error.what()));
    }
}

const bool defined = vdb_writer.define(write_vdb) && vdb_reader.define(read_vdb);

}  // namespace
}  // namespace rapid
