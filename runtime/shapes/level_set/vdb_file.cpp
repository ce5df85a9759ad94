#include "runtime/shapes/level_set/vdb_file.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>

#include <algorithm>
#include <istream>
#include <numeric>
#include <streambuf>

#include "runtime/files/input_file.h"
#include "runtime/shapes/level_set/vdb_layout.h"

namespace rapid {
namespace {

namespace vdb = openvdb;
using vdb::GridBase;
using vdb::io::GridDescriptor;

// The first published version, and the first one with Blosc.
constexpr std::uint32_t first_version = 220, first_packed_version = 223;

class MemoryBuffer final : public std::streambuf {
public:
    explicit MemoryBuffer(std::span<const unsigned char> bytes)
    {
        char* const begin = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));
        setg(begin, begin, begin + bytes.size());
    }

protected:
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override
    {
        const off_type size = egptr() - eback();
        const off_type base = from == std::ios_base::beg ? 0 : from == std::ios_base::cur ? gptr() - eback() : size;
        if (offset < -base || offset > size - base) return pos_type(off_type(-1));
        setg(eback(), eback() + base + offset, egptr());
        return pos_type(base + offset);
    }
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) override
    {
        return seekoff(off_type(position), std::ios_base::beg, mode);
    }
};

// Calls f. The stream throws at the end of the file.
template <class F>
auto read_checked(const F& f)
{
    try {
        return f();
    } catch (const std::ios_base::failure&) {
        throw damaged_vdb();
    }
}

}  // namespace

class VdbFile::Archive : public vdb::io::Archive {
public:
    explicit Archive(const std::filesystem::path& path) : file_(path), buffer_(file_.bytes()), stream_(&buffer_)
    {
        stream_.exceptions(std::ios_base::badbit | std::ios_base::failbit);
        readHeader(stream_);
        if (fileVersion() < first_version)
            throw Error(
                fmt::format("can't be read: its format has version {}, which is older than the first public OpenVDB; "
                            "it must be at least {}",
                            fileVersion(), first_version));
        of_file_->setSeekable(true);
        vdb::io::setStreamMetadataPtr(stream_, of_file_, /*transfer=*/false);
        setFormatVersion(stream_);
        setLibraryVersion(stream_);
        setDataCompression(stream_);
        vdb::MetaMap metadata;
        read_metadata(metadata);
        for (std::int32_t left = readGridCount(stream_); left > 0; --left) add_grid();
        sort_by_name();
    }

    const vdb::GridPtrVec& grids() const { return grids_; }

    GridBase::Ptr read(const GridBase::Ptr& grid)
    {
        const auto found = std::find(grids_.begin(), grids_.end(), grid);
        return read(descriptors_[static_cast<std::size_t>(found - grids_.begin())]);
    }

private:
    std::size_t position() { return static_cast<std::size_t>(std::streamoff(stream_.tellg())); }

    void read_metadata(vdb::MetaMap& metadata)
    {
        VdbCursor cursor(file_.bytes(), position());
        check_metadata(cursor);
        metadata.readMeta(stream_);
    }

    // Reads the descriptor of the next grid, or the whole grid if the file has no offsets.
    void add_grid()
    {
        GridDescriptor descriptor;
        descriptor.read(stream_);
        if (!inputHasGridOffsets()) {
            descriptor.setGridPos(stream_.tellg());
            grids_.push_back(read(descriptor));
            descriptors_.push_back(descriptor);
            return;
        }
        const auto size = static_cast<std::int64_t>(file_.bytes().size());
        const std::int64_t begin = descriptor.getGridPos(), end = descriptor.getEndPos();
        if (end > size)
            throw Error(
                fmt::format("can't be read: it is cut off: its grid \"{}\" ends at byte {}, but the file at byte {}",
                            GridDescriptor::nameAsString(descriptor.uniqueName()), end, size));
        if (begin < stream_.tellg() || end < begin) throw damaged_vdb();
        grids_.push_back(begin_grid(descriptor));
        descriptors_.push_back(descriptor);
        stream_.seekg(end);
    }

    // Reads a grid up to its tree.
    GridBase::Ptr begin_grid(const GridDescriptor& descriptor)
    {
        stream_.seekg(descriptor.getGridPos());
        const GridBase::Ptr grid = GridBase::createGrid(descriptor.gridType());
        grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());
        of_grid_ = std::make_shared<vdb::io::StreamMetadata>(*of_file_);
        of_grid_->setHalfFloat(descriptor.saveFloatAsHalf());
        vdb::io::setStreamMetadataPtr(stream_, of_grid_, /*transfer=*/false);
        vdb::io::setGridBackgroundValuePtr(stream_, nullptr);
        readGridCompression(stream_);
        read_metadata(*grid);
        grid->removeMeta(GridBase::META_FILE_DELAYED_LOAD);
        vdb::io::setGridClass(stream_, grid->getGridClass());
        grid->readTransform(stream_);
        return grid;
    }

    GridBase::Ptr read(const GridDescriptor& descriptor)
    {
        const GridBase::Ptr grid = begin_grid(descriptor);
        if (descriptor.isInstance()) {
            const auto end = stream_.tellg();
            grid->setTree(read(parent_of(descriptor))->baseTreePtr());
            stream_.seekg(end);
            return grid;
        }
        const std::size_t end = fileVersion() < first_packed_version ? 0 : check_tree(*grid);
        grid->readTopology(stream_);
        grid->readBuffers(stream_);
        if (end != 0 && position() != end) throw damaged_vdb();
        return grid;
    }

    const GridDescriptor& parent_of(const GridDescriptor& instance) const
    {
        const auto found = std::find_if(descriptors_.begin(), descriptors_.end(), [&](const GridDescriptor& other) {
            return other.uniqueName() == instance.instanceParentName() && !other.isInstance();
        });
        if (found == descriptors_.end())
            throw Error(
                fmt::format("can't be read: the grid \"{}\" is missing, which the grid \"{}\" shares values with",
                            GridDescriptor::nameAsString(instance.instanceParentName()),
                            GridDescriptor::nameAsString(instance.uniqueName())));
        return *found;
    }

    // Checks the tree that begins here and returns its end.
    std::size_t check_tree(const GridBase& grid)
    {
        VdbCursor cursor(file_.bytes(), position());
        VdbValues values;
        values.compression = vdb::io::getDataCompression(stream_);
        const bool has_points = grid.type() == "Tree_ptdataidx32_5_4_3";
        const bool is_half = grid.saveFloatAsHalf() && !has_points;
        if (grid.isType<vdb::Vec3SGrid>())
            values.bytes = sizeof(vdb::Vec3s);
        else if (grid.isType<vdb::FloatGrid>() || has_points)
            values.bytes = sizeof(float);
        else
            throw Error(fmt::format("can't be read: grids of the type {} are not supported", grid.type()));
        values.stored_bytes = is_half ? values.bytes / 2 : values.bytes;
        const std::vector<std::uint16_t> active = check_topology(cursor, values);
        if (has_points)
            check_points(cursor, active.size());
        else
            check_voxels(cursor, values, active);
        return cursor.at();
    }

    void sort_by_name()
    {
        std::vector<std::size_t> order(grids_.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            return descriptors_[a].gridName() < descriptors_[b].gridName();
        });
        vdb::GridPtrVec grids;
        std::vector<GridDescriptor> descriptors;
        for (const std::size_t k : order) grids.push_back(grids_[k]), descriptors.push_back(descriptors_[k]);
        grids_ = std::move(grids);
        descriptors_ = std::move(descriptors);
    }

    InputFile file_;
    MemoryBuffer buffer_;
    // The stream holds pointers to these.
    vdb::io::StreamMetadata::Ptr of_file_ = std::make_shared<vdb::io::StreamMetadata>(), of_grid_;
    std::istream stream_;
    std::vector<GridDescriptor> descriptors_;
    vdb::GridPtrVec grids_;
};

VdbFile::VdbFile(const std::filesystem::path& path)
{
    vdb::initialize();
    archive_ = read_checked([&] { return std::make_unique<Archive>(path); });
}

VdbFile::~VdbFile() = default;

const vdb::GridPtrVec& VdbFile::grids() const { return archive_->grids(); }

GridBase::Ptr VdbFile::read(const GridBase::Ptr& grid)
{
    return read_checked([&] { return archive_->read(grid); });
}

}  // namespace rapid
