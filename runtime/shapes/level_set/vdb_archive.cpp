#include "runtime/shapes/level_set/vdb_archive.h"

#include <fmt/format.h>

#include "runtime/base/error.h"
#include "runtime/files/output_stream.h"

namespace rapid {
namespace {

// Writes the format of openvdb::io::File to a stream.
class Archive : public openvdb::io::Archive {
public:
    void write_to(std::ostream& stream, const openvdb::GridCPtrVec& grids) const
    {
        openvdb::io::Archive::write(stream, grids, /*seekable=*/true);
    }
};

}  // namespace

void write_archive(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids)
{
    for (const auto& grid : grids)
        if (grid->getName().empty())
            throw Error(fmt::format("cannot write \"{}\": the grid needs a name", path.string()));
    try {
        OutputFile file(path);
        OutputStream stream(file);
        Archive().write_to(stream, grids);
        stream.flush();
        file.finish();
    } catch (const std::exception& e) {
        throw Error(fmt::format("cannot write \"{}\": {}", path.string(), e.what()));
    }
}

}  // namespace rapid
