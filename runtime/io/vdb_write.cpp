// Writes .vdb (vdb.h). OpenVDB writes the header and the tree of a grid whose leaves have no attributes. The attributes
// are written here, page by page, in the format of OpenVDB's own leaves. No complete grid is held in memory, and values
// are packed once instead of twice, by all threads.
#include <fmt/format.h>
#include <openvdb/points/AttributeArrayString.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointGroup.h>
#include <openvdb/points/StreamCompression.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "runtime/files/output_file.h"
#include "runtime/io/text_table.h"
#include "runtime/io/vdb.h"
#include "runtime/io/vdb_order.h"
#include "runtime/io/vdb_types.h"
#include "runtime/points/column_files.h"

namespace rapid {
namespace {

namespace vdb = openvdb;
using vdb::points::AttributeSet;
using vdb::points::PointDataGrid;
using vdb::points::PointDataTree;
using Leaf = PointDataTree::LeafNodeType;

void check_names(const PointSet& points)
{
    const auto check = [](const std::string& name, const char* what) {
        if (!AttributeSet::Descriptor::validName(name))
            throw Error(fmt::format(
                "the {} \"{}\" can't be written to .vdb; its name must consist of letters, digits and _", what, name));
    };
    for (const auto& [name, column] : points.columns()) check(name, "attribute");
    for (const auto& [name, members] : points.groups()) check(name, "group");
}

// Returns a tree with one empty leaf that defines the attributes, like a leaf whose points were all removed.
PointDataTree::Ptr empty_tree(const PointSet& points)
{
    using Position = vdb::points::TypedAttributeArray<vdb::Vec3f>;
    auto tree = std::make_shared<PointDataTree>();
    tree->touchLeaf(vdb::Coord(0))
        ->initializeAttributes(AttributeSet::Descriptor::create(Position::attributeType()), 0);
    for (const auto& [name, column] : points.columns()) {
        if (name == "P") continue;
        std::visit(
            [&, &attribute = name]<class T>(const Column<T>&) {
                using Array = std::conditional_t<std::is_same_v<T, Token>, vdb::points::StringAttributeArray,
                                                 vdb::points::TypedAttributeArray<typename VdbValue<T>::Type>>;
                vdb::points::appendAttribute(*tree, attribute, Array::attributeType());
            },
            column);
    }
    vdb::points::appendGroups(*tree, points.group_names());
    return tree;
}

// The number of each string in the grid's list, by token.
using TextNumbers = std::vector<vdb::Index>;

// Stores the grid's list of strings in its metadata, in order of first use.
TextNumbers list_strings(PointDataTree& tree, const PointSet& points)
{
    TextNumbers numbers;
    const std::vector<std::string> names = string_column_names(points);
    if (names.empty()) return numbers;
    vdb::MetaMap& metadata = vdb::points::makeDescriptorUnique(tree)->getMetadata();
    vdb::points::StringMetaInserter list(metadata);
    for (const std::string& name : names)
        for (const Token text : text_table(points.column<Token>(name)).strings) {
            if (numbers.size() <= text.number) numbers.resize(std::size_t{text.number} + 1, 0);
            if (text != Token()) numbers[text.number] = list.insert(std::string(text.text()));
        }
    return numbers;
}

// An attribute's values in the leaves.
struct Attribute {
    std::size_t bytes = 0;  // per value
    std::uint8_t flags = 0;
    // Returns true if all points of a leaf have bit-identical values, which are then written once.
    std::function<bool(const VdbLeaf& leaf)> is_uniform;
    // Copies the values of the first n points of a leaf.
    std::function<void(const VdbLeaf& leaf, std::uint32_t n, char* to)> copy;
};

Attribute attribute_of_positions(const VdbOrder& order, double voxel)
{
    Attribute result;
    result.bytes = sizeof(vdb::Vec3f);
    result.is_uniform = [](const VdbLeaf&) { return false; };
    result.copy = [&order, P = order.points().P().read(), per_metre = 1 / voxel](const VdbLeaf& leaf, std::uint32_t n,
                                                                                 char* to) {
        for (std::uint32_t k = 0; k < n; ++k) {
            const Vec3f& here = P[order.index(leaf.first + k)];
            vdb::Vec3f offset;
            for (int axis = 0; axis < 3; ++axis) {
                const double index = here[axis] * per_metre;
                offset[axis] = static_cast<float>(index - std::floor(index + 0.5));
            }
            std::memcpy(to + k * sizeof offset, &offset, sizeof offset);
        }
    };
    return result;
}

// Returns a value in the file's representation.
template <class T>
typename VdbValue<T>::Type value_in_file(const T& value, const TextNumbers&)
{
    return VdbValue<T>::from(value);
}
vdb::Index value_in_file(const Token& text, const TextNumbers& numbers) { return numbers[text.number]; }

template <class T>
Attribute attribute_of(const VdbOrder& order, const Column<T>& column, const TextNumbers& numbers)
{
    using Value = typename VdbValue<T>::Type;
    Attribute result;
    result.bytes = sizeof(Value);
    result.is_uniform = [&order, values = column.read()](const VdbLeaf& leaf) {
        if (values.stride == 0) return true;
        const T& first = values[order.index(leaf.first)];
        for (std::uint32_t k = 1; k < leaf.size; ++k)
            if (std::memcmp(&values[order.index(leaf.first + k)], &first, sizeof(T)) != 0) return false;
        return true;
    };
    result.copy = [&order, &numbers, values = column.read()](const VdbLeaf& leaf, std::uint32_t n, char* to) {
        for (std::uint32_t k = 0; k < n; ++k) {
            const Value value = value_in_file(values[order.index(leaf.first + k)], numbers);
            std::memcpy(to + k * sizeof value, &value, sizeof value);
        }
    };
    return result;
}

// Returns an attribute that stores up to eight groups, one bit per point for each.
Attribute attribute_of_groups(const VdbOrder& order, const std::vector<std::pair<int, Strided<std::uint8_t>>>& bits)
{
    const auto value = [bits](std::size_t place) {
        unsigned result = 0;
        for (const auto& [bit, members] : bits) result |= (members[place] != 0 ? 1u : 0u) << bit;
        return static_cast<std::uint8_t>(result);
    };
    Attribute result;
    result.bytes = 1;
    result.is_uniform = [&order, value](const VdbLeaf& leaf) {
        const std::uint8_t first = value(order.index(leaf.first));
        for (std::uint32_t k = 1; k < leaf.size; ++k)
            if (value(order.index(leaf.first + k)) != first) return false;
        return true;
    };
    result.copy = [&order, value](const VdbLeaf& leaf, std::uint32_t n, char* to) {
        for (std::uint32_t k = 0; k < n; ++k) to[k] = static_cast<char>(value(order.index(leaf.first + k)));
    };
    return result;
}

// Returns the attributes in the order of the leaf that defines them.
std::vector<Attribute> attributes_of(const VdbOrder& order, double voxel, const AttributeSet& model,
                                     const TextNumbers& numbers)
{
    const PointSet& points = order.points();
    std::vector<Attribute> attributes(model.size());
    for (const auto& [name, column] : points.columns())
        attributes[model.find(name)] =
            name == "P" ? attribute_of_positions(order, voxel)
                        : std::visit([&](const auto& c) { return attribute_of(order, c, numbers); }, column);
    std::map<std::size_t, std::vector<std::pair<int, Strided<std::uint8_t>>>> groups;  // per attribute
    for (const auto& [name, members] : points.groups()) {
        const AttributeSet::Descriptor::GroupIndex index = model.groupIndex(name);
        groups[index.first].emplace_back(index.second, members.read());
    }
    for (const auto& [attribute, bits] : groups) attributes[attribute] = attribute_of_groups(order, bits);
    for (std::size_t a = 0; a < attributes.size(); ++a) attributes[a].flags = model.getConst(a)->flags();
    return attributes;
}

template <class T>
void put(std::ostream& os, const T& value)
{
    os.write(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Packed {
    std::unique_ptr<char[]> bytes;  // null: packing does not pay
    std::size_t size = 0;
};

Packed pack(const char* bytes, std::size_t size)
{
    Packed packed;
    packed.bytes = vdb::compression::bloscCompress(bytes, size, packed.size);
    return packed;
}

// Complete arrays of consecutive leaves, packed together.
struct Page {
    std::size_t attribute = 0, first_leaf = 0, end_leaf = 0, bytes = 0;
    std::int32_t packed = 0;  // bytes in the file, if packed
    bool is_packed = true;    // false: packing would not shrink it, so it is written as it is
};

// Writes the leaves' values in OpenVDB's passes.
class LeafBuffers {
public:
    LeafBuffers(const VdbOrder& order, const std::vector<Attribute>& attributes, const AttributeSet& model)
        : leaves_(order.leaves()), attributes_(attributes), model_(model), uniform_(leaves_.size() * attributes.size())
    {
        tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t k) {
            for (std::size_t a = 0; a < attributes_.size(); ++a)
                uniform_[k * attributes_.size() + a] = attributes_[a].is_uniform(leaves_[k]);
            trim_columns();
        });
        for (std::size_t a = 0; a < attributes_.size(); ++a) add_pages(a);
    }

    // Returns the bytes of all values, unpacked, except for one value per array.
    std::size_t memory() const
    {
        std::size_t bytes = 0;
        for (std::size_t a = 0; a < attributes_.size(); ++a)
            for (std::size_t k = 0; k < leaves_.size(); ++k) bytes += bytes_of(k, a) - attributes_[a].bytes;
        return bytes;
    }

    void write(std::ostream& os)
    {
        put(os, static_cast<std::uint16_t>(4 + 2 * attributes_.size()));  // number of passes
        const std::vector<Packed> voxels = pack_voxels();
        for (const Packed& one : voxels) put(os, size_of(one));
        write_arrays(os);
        // The sizes of pages are known only after packing. They take less space for an unpacked page, in which case
        // everything is written again.
        const std::streampos sizes = os.tellp();
        do {
            os.seekp(sizes);
            write_page_sizes(os);
            write_voxels(os, voxels);
        } while (!write_pages(os));
        const std::streampos end = os.tellp();
        os.seekp(sizes);
        write_page_sizes(os);
        os.seekp(end);
    }

private:
    using Ends = std::array<std::uint32_t, Leaf::SIZE>;  // end of the points of each voxel

    static Ends ends_of(const VdbLeaf& leaf)
    {
        Ends ends;
        std::uint32_t end = 0;
        auto count = leaf.counts.begin();
        for (vdb::Index voxel = 0; voxel < Leaf::SIZE; ++voxel)
            ends[voxel] = end += leaf.voxels.isOn(voxel) ? *count++ : 0;
        return ends;
    }

    std::vector<Packed> pack_voxels() const
    {
        std::vector<Packed> packed(leaves_.size());
        tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t k) {
            const Ends ends = ends_of(leaves_[k]);
            packed[k] = pack(reinterpret_cast<const char*>(ends.data()), sizeof ends);
        });
        return packed;
    }

    static std::uint16_t size_of(const Packed& voxels)
    {
        return voxels.bytes ? static_cast<std::uint16_t>(voxels.size) : std::numeric_limits<std::uint16_t>::max();
    }

    void write_voxels(std::ostream& os, const std::vector<Packed>& packed) const
    {
        for (std::size_t k = 0; k < leaves_.size(); ++k) {
            leaves_[k].voxels.save(os);
            put(os, size_of(packed[k]));
            if (packed[k].bytes)
                os.write(packed[k].bytes.get(), static_cast<std::streamsize>(packed[k].size));
            else
                put(os, ends_of(leaves_[k]));
        }
    }

    bool is_uniform(std::size_t leaf, std::size_t attribute) const
    {
        return uniform_[leaf * attributes_.size() + attribute] != 0;
    }
    std::uint32_t values_of(std::size_t leaf, std::size_t attribute) const
    {
        return is_uniform(leaf, attribute) ? 1 : leaves_[leaf].size;
    }
    std::size_t bytes_of(std::size_t leaf, std::size_t attribute) const
    {
        return values_of(leaf, attribute) * attributes_[attribute].bytes;
    }

    // Writes the same as TypedAttributeArray::writeMetadata().
    void write_arrays(std::ostream& os) const
    {
        constexpr std::uint8_t shared_descriptor = 1, uniform = 2, paged = 8;
        put(os, shared_descriptor);
        model_.writeDescriptor(os, /*transient=*/false);
        for (std::size_t k = 0; k < leaves_.size(); ++k)
            for (std::size_t a = 0; a < attributes_.size(); ++a) {
                put(os, std::uint64_t{sizeof(std::int16_t) + sizeof(vdb::Index) + bytes_of(k, a)});
                put(os, attributes_[a].flags);
                put(os, static_cast<std::uint8_t>(paged | (is_uniform(k, a) ? uniform : 0)));
                put(os, leaves_[k].size);
            }
    }

    // Fills pages like PagedOutputStream.
    void add_pages(std::size_t attribute)
    {
        constexpr std::size_t most = vdb::compression::PageSize;
        Page page{attribute};
        const auto end = [&](std::size_t leaf) {
            page.end_leaf = leaf;
            if (page.bytes > 0) pages_.push_back(page);
            page = {attribute, leaf};
        };
        for (std::size_t k = 0; k < leaves_.size(); ++k) {
            const std::size_t bytes = bytes_of(k, attribute);
            if (page.bytes + bytes > most) end(k);
            page.bytes += bytes;
            if (bytes > most) end(k + 1);
        }
        end(leaves_.size());
    }

    void write_page_sizes(std::ostream& os) const
    {
        for (const Page& page : pages_) {
            const auto bytes = static_cast<std::int32_t>(page.bytes);
            if (page.is_packed) put(os, page.packed);
            put(os, page.is_packed ? bytes : -bytes);
        }
    }

    std::vector<char> values_of(const Page& page) const
    {
        std::vector<char> values(page.bytes);
        char* to = values.data();
        for (std::size_t k = page.first_leaf; k < page.end_leaf; ++k) {
            attributes_[page.attribute].copy(leaves_[k], values_of(k, page.attribute), to);
            to += bytes_of(k, page.attribute);
        }
        return values;
    }

    // Returns false if a page is packed contrary to expectation, so that all pages are at the wrong position.
    bool write_pages(std::ostream& os)
    {
        struct Made {
            Page* page;
            std::vector<char> values;
            Packed packed;
        };
        using MadePtr = std::shared_ptr<Made>;
        constexpr std::size_t at_a_time = 8;
        bool as_expected = true;
        auto next = pages_.begin();
        const auto take = tbb::make_filter<void, Page*>(tbb::filter_mode::serial_in_order, [&](auto& control) -> Page* {
            if (next != pages_.end()) return &*next++;
            control.stop();
            return nullptr;
        });
        const auto make = tbb::make_filter<Page*, MadePtr>(tbb::filter_mode::parallel, [&](Page* page) {
            const auto made = std::make_shared<Made>(Made{page, values_of(*page), {}});
            made->packed = pack(made->values.data(), made->values.size());
            if (made->packed.bytes) made->values = {};
            return made;
        });
        const auto write = tbb::make_filter<MadePtr, void>(tbb::filter_mode::serial_in_order, [&](const MadePtr& made) {
            const bool is_packed = made->packed.bytes != nullptr;
            as_expected &= is_packed == made->page->is_packed;
            made->page->is_packed = is_packed;
            made->page->packed = static_cast<std::int32_t>(made->packed.size);
            if (is_packed)
                os.write(made->packed.bytes.get(), static_cast<std::streamsize>(made->packed.size));
            else
                os.write(made->values.data(), static_cast<std::streamsize>(made->values.size()));
            trim_columns();
        });
        tbb::parallel_pipeline(at_a_time, take & make & write);
        return as_expected;
    }

    const std::vector<VdbLeaf>& leaves_;
    const std::vector<Attribute>& attributes_;
    const AttributeSet& model_;
    std::vector<std::uint8_t> uniform_;  // per leaf and attribute
    std::vector<Page> pages_;
};

// A grid whose leaves have voxels but no points. `buffers` writes the points.
class PointGrid : public PointDataGrid {
public:
    PointGrid(PointDataTree::Ptr tree, LeafBuffers& buffers, vdb::Index64 memory)
        : PointDataGrid(std::move(tree)), buffers_(buffers), memory_(memory)
    {
    }

    vdb::GridBase::Ptr copyGrid() override { return std::make_shared<PointGrid>(*this, vdb::ShallowCopy()); }
    vdb::GridBase::ConstPtr copyGrid() const override { return const_cast<PointGrid*>(this)->copyGrid(); }
    vdb::Index64 memUsage() const override { return memory_; }
    void writeBuffers(std::ostream& os) const override { buffers_.write(os); }

    PointGrid(PointGrid& other, vdb::ShallowCopy shallow)
        : PointDataGrid(other, shallow), buffers_(other.buffers_), memory_(other.memory_)
    {
    }

private:
    LeafBuffers& buffers_;
    vdb::Index64 memory_;  // memory that the grid would take in OpenVDB
};

PointDataTree::Ptr tree_of(const std::vector<VdbLeaf>& leaves)
{
    auto tree = std::make_shared<PointDataTree>();
    for (const VdbLeaf& from : leaves) {
        auto leaf = std::make_unique<Leaf>(vdb::PartialCreate(), from.origin);
        leaf->setValueMask(from.voxels);
        tree->addLeaf(leaf.release());
    }
    return tree;
}

// Returns the memory of a grid of these leaves, fully loaded.
vdb::Index64 memory_of(const PointDataTree& tree, const LeafBuffers& buffers, const AttributeSet& model)
{
    const std::size_t of_leaf = Leaf::SIZE * sizeof(vdb::Index32) + model.memUsage() - AttributeSet().memUsage();
    return tree.memUsage() + tree.leafCount() * of_leaf + buffers.memory();
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

// Returns a hash of the frame and a sample of its positions as the file's UUID. OpenVDB would use a random one, so that
// equal points would give different bytes.
std::string file_uuid(const PointSet& points, const FrameInfo& frame)
{
    std::uint64_t hash = 14695981039346656037ull;
    const auto add = [&](std::uint64_t bits) { hash = (hash ^ bits) * 0x9e3779b97f4a7c15ull, hash ^= hash >> 31; };
    add(static_cast<std::uint64_t>(frame.number));
    add(points.size());
    const std::size_t step = std::max<std::size_t>(1, points.size() / 1024);
    for (std::size_t i = 0; i < points.size(); i += step) {
        for (int axis = 0; axis < 3; ++axis) add(std::bit_cast<std::uint32_t>(points.P()[i][axis]));
        trim_columns();
    }
    const std::uint64_t first = hash;
    add(~first);
    return fmt::format("{:08x}-{:04x}-4{:03x}-8{:03x}-{:012x}", first >> 32, first >> 16 & 0xffff, first & 0xfff,
                       hash >> 48 & 0xfff, hash & 0xffffffffffff);
}

// Offset of the UUID: after the magic number, three versions and a flag.
constexpr std::uint64_t uuid_offset = 8 + 3 * 4 + 1;

void write_grid(OutputFile& file, PointDataGrid& grid, double voxel, const FrameInfo& frame)
{
    grid.setTransform(vdb::math::Transform::createLinearTransform(voxel));
    grid.setName("points");
    grid.insertMeta("frame", vdb::Int32Metadata(frame.number));
    grid.insertMeta("time", vdb::DoubleMetadata(frame.time));
    OutputStream stream(file);
    const vdb::GridBase::ConstPtr not_owned(&grid, [](const vdb::GridBase*) {});
    Archive().write_to(stream, {not_owned});
    const auto end = static_cast<off_t>(stream.tellp());
    stream.flush();
    // Removes the rest of pages that were written twice.
    if (::ftruncate(file.descriptor(), end) != 0) throw file_error("can't be written", errno);
}

void write_vdb(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    initialize_openvdb();
    if (points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(fmt::format("{} points are too many for a grid; write fewer, or write .csv", points.size()));
    check_names(points);
    try {
        const double voxel = std::ldexp(1.0, voxel_exponent(points));
        const PointDataTree::Ptr model = empty_tree(points);
        const TextNumbers numbers = list_strings(*model, points);
        if (points.empty()) {
            PointDataGrid grid(model);
            write_grid(file, grid, voxel, frame);
        } else {
            const AttributeSet& defined = model->cbeginLeaf()->attributeSet();
            const VdbOrder order(points, voxel);
            const std::vector<Attribute> attributes = attributes_of(order, voxel, defined, numbers);
            LeafBuffers buffers(order, attributes, defined);
            const PointDataTree::Ptr tree = tree_of(order.leaves());
            PointGrid grid(tree, buffers, memory_of(*tree, buffers, defined));
            write_grid(file, grid, voxel, frame);
        }
        const std::string uuid = file_uuid(points, frame);
        file.write_at(uuid_offset, uuid.data(), uuid.size());
    } catch (const vdb::Exception& error) {
        throw Error(fmt::format("can't be written: {}", error.what()));
    }
}

RAPID_DEFINE(vdb_writer, write_vdb);

}  // namespace
}  // namespace rapid
