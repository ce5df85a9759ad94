// Reads .vdb (vdb.h).
#include <fmt/format.h>
#include <openvdb/points/AttributeArrayString.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointGroup.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>

#include "runtime/base/error.h"
#include "runtime/files/input_file.h"
#include "runtime/files/message.h"
#include "runtime/files/read_sandboxed.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/id_order.h"
#include "runtime/io/text_table.h"
#include "runtime/io/vdb.h"
#include "runtime/io/vdb_types.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/level_set/vdb_file.h"

namespace rapid {
namespace {

// Points in a message between processes (files/read_sandboxed.h).

template <class T>
void send_column(const Column<T>& column, MessageWriter& message)
{
    const std::size_t distinct = column.is_uniform() ? std::min<std::size_t>(column.size(), 1) : column.size();
    message.put<std::uint8_t>(column.is_uniform());
    message.put_array(std::span<const T>(column.read().data, distinct));
}

template <class T>
Column<T> receive_column(std::size_t points, MessageReader& message)
{
    Column<T> column;
    const bool uniform = message.take<std::uint8_t>() != 0;
    if (points == 0) return column;
    if (uniform) return Column<T>(points, message.take<T>(), Column<T>::zero());
    message.check_left(points, sizeof(T));
    message.take_array(column.append_for_writing(points));
    return column;
}

// Sends the strings, because the other process has its own tokens.
void send_column(const Column<Token>& column, MessageWriter& message)
{
    const TextTable table = text_table(column);
    message.put(table.strings.size());
    for (const Token text : table.strings) message.put_text(std::string(text.text()));
    send_column(table.indices, message);
}

template <>
Column<Token> receive_column(std::size_t points, MessageReader& message)
{
    std::vector<Token> strings;
    for (auto left = message.take<std::size_t>(); left > 0; --left) strings.push_back(token_of(message.take_text()));
    return strings_at(strings, receive_column<std::int32_t>(points, message));
}

AnyColumn receive_any(std::uint8_t type, std::size_t points, MessageReader& message)
{
    if (type >= std::variant_size_v<AnyColumn>) throw Error("can't be read: the reader failed, so it must be damaged");
    return std::visit([&]<class T>(const Column<T>&) -> AnyColumn { return receive_column<T>(points, message); },
                      column_of_type<AnyColumn>(type));
}

void send_points(const PointSet& points, MessageWriter& message)
{
    for (const std::size_t count : {points.size(), points.columns().size(), points.groups().size()}) message.put(count);
    for (const auto& [name, column] : points.columns()) {
        message.put_text(name);
        message.put(static_cast<std::uint8_t>(type_of(column)));
        std::visit([&](const auto& c) { send_column(c, message); }, column);
    }
    for (const auto& [name, members] : points.groups()) {
        message.put_text(name);
        send_column(members, message);
    }
}

// Throws Error if the message does not contain a valid set of points.
PointSet receive_points(MessageReader& message)
{
    const auto size = message.take<std::size_t>(), columns = message.take<std::size_t>(),
               groups = message.take<std::size_t>();
    message.check_left(size, sizeof(Vec3f));  // readers set P point by point, so it is not uniform
    PointSet points;
    points.append(size);
    for (std::size_t i = 0; i < columns; ++i) {
        const std::string name = message.take_text();
        const auto type = message.take<std::uint8_t>();
        points.set(name, receive_any(type, size, message));
    }
    for (std::size_t i = 0; i < groups; ++i) {
        const std::string name = message.take_text();
        Column<std::uint8_t> members = receive_column<std::uint8_t>(size, message);
        const std::span<std::uint8_t> bytes = members.is_uniform() ? std::span<std::uint8_t>() : members.write();
        for (std::uint8_t& member : bytes) member = member != 0;
        points.group(name) = std::move(members);
    }
    return points;
}

namespace vdb = openvdb;
using vdb::points::AttributeArray;
using vdb::points::PointDataGrid;
using vdb::points::PointDataTree;
using Leaf = PointDataTree::LeafNodeType;

// Returns true if the voxels' offsets ascend and stay within the arrays. A leaf without points has arrays of one value.
bool has_valid_offsets(const Leaf& leaf)
{
    for (vdb::Index voxel = 1; voxel < Leaf::SIZE; ++voxel)
        if (leaf.getValue(voxel - 1) > leaf.getValue(voxel)) return false;
    const auto& arrays = leaf.attributeSet();
    for (std::size_t a = 0; leaf.getLastValue() > 0 && a < arrays.size(); ++a)
        if (arrays.getConst(a)->size() != leaf.getLastValue()) return false;
    return true;
}

bool have_same_attributes(const Leaf& leaf, const Leaf& other)
{
    const auto &arrays = leaf.attributeSet(), &others = other.attributeSet();
    if (&arrays.descriptor() != &others.descriptor() && arrays.descriptor() != others.descriptor()) return false;
    for (std::size_t a = 0; a < arrays.size(); ++a)
        if (arrays.getConst(a)->stride() != others.getConst(a)->stride()) return false;
    return true;
}

// Returns the number of points of a grid. Throws if reading them would exceed a leaf's arrays.
std::size_t checked_count(const PointDataGrid& grid)
{
    std::size_t count = 0;
    const auto first = grid.tree().cbeginLeaf();
    for (auto leaf = first; leaf; ++leaf) {
        if (!has_valid_offsets(*leaf))
            throw Error(
                fmt::format("can't be read: a leaf of the grid \"{}\" has more points than values", grid.getName()));
        if (!have_same_attributes(*leaf, *first))
            throw Error(
                fmt::format("can't be read: the leaves of the grid \"{}\" differ in their attributes", grid.getName()));
        count += leaf->getLastValue();
    }
    return count;
}

// A leaf with points and the index of its first point in the set.
struct LeafRange {
    const Leaf* leaf;
    std::size_t first;
};

std::vector<LeafRange> leaf_ranges(const PointDataGrid& grid, std::size_t first)
{
    std::vector<LeafRange> ranges;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->getLastValue() > 0) ranges.push_back({&*leaf, first});
        first += leaf->getLastValue();
    }
    return ranges;
}

template <class F>
void for_each_leaf(const std::vector<LeafRange>& ranges, const F& f)
{
    tbb::parallel_for(std::size_t{0}, ranges.size(), [&](std::size_t i) { f(*ranges[i].leaf, ranges[i].first); });
}

void read_positions(const PointDataGrid& grid, const std::vector<LeafRange>& ranges, std::span<Vec3f> P)
{
    const vdb::math::Transform& transform = grid.transform();
    const bool scaled = transform.mapType() == vdb::math::UniformScaleMap::mapType();
    const double voxel = transform.voxelSize()[0];
    for_each_leaf(ranges, [&](const Leaf& leaf, std::size_t first) {
        const vdb::points::AttributeHandle<vdb::Vec3f> offsets(leaf.constAttributeArray("P"));
        vdb::Index k = 0;
        for (vdb::Index voxel_of_leaf = 0; voxel_of_leaf < Leaf::SIZE; ++voxel_of_leaf) {
            const vdb::Coord voxel_index = leaf.offsetToGlobalCoord(voxel_of_leaf);
            for (; k < leaf.getValue(voxel_of_leaf); ++k) {
                const vdb::Vec3f offset = offsets.get(k);
                vdb::Vec3d index;
                // At voxel 0 nothing is added, which preserves -0.
                for (int axis = 0; axis < 3; ++axis)
                    index[axis] = voxel_index[axis] == 0 ? static_cast<double>(offset[axis])
                                                         : voxel_index[axis] + static_cast<double>(offset[axis]);
                const vdb::Vec3d world = scaled ? index * voxel : transform.indexToWorld(index);
                P[first + k] = Vec3d(world.x(), world.y(), world.z()).cast<float>();
            }
        }
    });
}

// Returns the column `name`. Adds it if an earlier grid had none.
template <class T>
Column<T>& column_for(PointSet& points, const std::string& name)
{
    return std::get<Column<T>>(points.add({name, AttributeValue(Column<T>::zero())}));
}

template <class T, class Value>
void read_attribute(PointSet& points, const std::vector<LeafRange>& ranges, const std::string& name,
                    const std::string& column_name, vdb::Index component)
{
    Column<T>& column = column_for<T>(points, column_name);
    if (ranges.empty()) return;
    const auto handle = [&](const Leaf& leaf) {
        return vdb::points::AttributeHandle<Value>(leaf.constAttributeArray(name));
    };

    std::size_t count = 0;
    const T first = rapid_value<T>(handle(*ranges[0].leaf).get(0, component));
    const bool uniform = std::all_of(ranges.begin(), ranges.end(), [&](const LeafRange& range) {
        count += range.leaf->getLastValue();
        const auto values = handle(*range.leaf);
        const T here = rapid_value<T>(values.get(0, component));
        return values.isUniform() && std::memcmp(&here, &first, sizeof(T)) == 0;
    });
    if (uniform && count == points.size()) {
        column.fill(first);
        return;
    }
    std::span<T> values = column.write();
    for_each_leaf(ranges, [&](const Leaf& leaf, std::size_t at) {
        const auto from = handle(leaf);
        for (vdb::Index k = 0; k < leaf.getLastValue(); ++k) values[at + k] = rapid_value<T>(from.get(k, component));
    });
}

using ReadAttribute = void (*)(PointSet&, const std::vector<LeafRange>&, const std::string&, const std::string&,
                               vdb::Index);

void read_strings(PointSet& points, const std::vector<LeafRange>& ranges, const std::string& name)
{
    Column<Token>& column = column_for<Token>(points, name);
    if (ranges.empty()) return;
    std::map<vdb::Index, Token> strings;  // by number in the file
    strings[0] = Token();
    const vdb::points::StringMetaCache list(ranges[0].leaf->attributeSet().descriptor().getMetadata());
    for (const auto& [text, number] : list.map()) strings[number] = token_of(text);
    const std::span<Token> values = column.write();
    for_each_leaf(ranges, [&](const Leaf& leaf, std::size_t at) {
        const auto& array = vdb::points::StringAttributeArray::cast(leaf.constAttributeArray(name));
        const vdb::points::AttributeHandle<vdb::Index, vdb::points::StringCodec<false>> numbers(array);
        for (vdb::Index k = 0; k < leaf.getLastValue(); ++k) {
            const auto found = strings.find(numbers.get(k));
            if (found == strings.end())
                throw Error(fmt::format("the attribute \"{}\" uses string number {}, which does not exist", name,
                                        numbers.get(k)));
            values[at + k] = found->second;
        }
    });
}

// Readers by OpenVDB's name of the type. Matrices are not read.
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
    const std::vector<LeafRange> ranges = leaf_ranges(grid, first);
    const auto any = grid.tree().cbeginLeaf();
    if (!any) return;
    const Leaf& leaf = ranges.empty() ? *any : *ranges[0].leaf;
    const auto& descriptor = leaf.attributeSet().descriptor();
    if (descriptor.find("P") == vdb::points::AttributeSet::INVALID_POS)
        throw Error(fmt::format("the points of the grid \"{}\" have no P", grid.getName()));
    if (!ranges.empty()) read_positions(grid, ranges, points.P().write());

    for (const auto& [name, position] : descriptor.map()) {
        const AttributeArray& array = leaf.constAttributeArray(position);
        if (name == "P" || vdb::points::isGroup(array)) continue;
        const std::string type = descriptor.valueType(position);
        if (name == "id" && array.stride() == 1 && (type == "int32" || type == "int64")) {
            (type == "int32" ? read_attribute<std::int64_t, std::int32_t>
                             : read_attribute<std::int64_t, std::int64_t>)(points, ranges, name, name, 0);
            has_id = true;
            continue;
        }
        if (vdb::points::isString(array) && array.stride() == 1) {
            read_strings(points, ranges, name);
            continue;
        }
        const auto reader = readers().find(type);
        if (reader == readers().end() || !array.hasConstantStride()) {
            SkippedContents::add(fmt::format("the attribute \"{}\" of the type {}", name, type));
            continue;
        }
        for (vdb::Index component = 0; component < array.stride(); ++component)
            reader->second(points, ranges, name, array.stride() == 1 ? name : fmt::format("{}{}", name, component),
                           component);
    }
    for (const auto& [name, offset] : descriptor.groupMap()) {
        Column<std::uint8_t>& column = points.group(name);
        if (ranges.empty()) continue;
        std::span<std::uint8_t> members = column.write();
        for_each_leaf(ranges, [&, group = name](const Leaf& part, std::size_t at) {
            const auto handle = part.groupHandle(group);
            for (vdb::Index k = 0; k < part.getLastValue(); ++k) members[at + k] = handle.get(k);
        });
    }
}

// The points of a file, in file order.
struct VdbPoints {
    PointSet points;
    bool has_id = false;
    std::vector<std::string> skipped = {};
};

VdbPoints read_grids(const std::filesystem::path& path, const std::string&)
{
    initialize_openvdb();
    const SkippedContents skipped;
    try {
        VdbFile file(path);
        std::vector<PointDataGrid::ConstPtr> grids;
        std::string others;
        std::size_t count = 0;
        for (const vdb::GridBase::Ptr& grid : file.grids()) {
            if (!grid->isType<PointDataGrid>()) {
                const std::string what = fmt::format("\"{}\" ({})", grid->getName(), grid->type());
                SkippedContents::add("the grid " + what);
                others += (others.empty() ? "" : ", ") + what;
                continue;
            }
            grids.push_back(vdb::gridConstPtrCast<PointDataGrid>(file.read(grid)));
            count += checked_count(*grids.back());
        }
        if (grids.empty())
            throw Error(others.empty() ? std::string("the file contains no grids")
                                       : fmt::format("the file contains no points; its grids are {}", others));

        VdbPoints read;
        read.points.append(count);
        std::size_t first = 0;
        for (const PointDataGrid::ConstPtr& grid : grids) {
            read_grid(*grid, first, read.points, read.has_id);
            for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) first += leaf->getLastValue();
        }
        read.skipped = skipped.list();
        return read;
    } catch (const vdb::Exception& error) {
        throw Error(fmt::format("can't be read: {}", error.what()));
    }
}

void send(const VdbPoints& read, MessageWriter& message)
{
    message.put(read.has_id);
    message.put(read.skipped.size());
    for (const std::string& what : read.skipped) message.put_text(what);
    send_points(read.points, message);
}

VdbPoints receive(MessageReader& message)
{
    const bool has_id = message.take<std::uint8_t>() != 0;
    std::vector<std::string> skipped;
    for (auto left = message.take<std::size_t>(); left > 0; --left) skipped.push_back(message.take_text());
    return {receive_points(message), has_id, std::move(skipped)};
}

const SandboxedReader<VdbPoints> reader("points of .vdb", read_grids, send, receive);

PointSet read_vdb(const std::filesystem::path& path)
{
    check_readable(path);
    auto [points, has_id, skipped] = reader(path);
    for (const std::string& what : skipped) SkippedContents::add(what);
    if (points.empty()) return points;
    if (has_id) return reordered(points, id_order(points.id()));
    std::span<std::int64_t> ids = points.id().overwrite();
    std::iota(ids.begin(), ids.end(), std::int64_t{0});
    return points;
}

RAPID_DEFINE(vdb_reader, read_vdb);

}  // namespace
}  // namespace rapid
