// Reads .vdb files with OpenVDB, from memory.
//
// OpenVDB ignores the state of the stream that it reads from. It would take the values that a cut file lacks from
// memory that was never written. The stream therefore throws at its end, and sizes are checked before OpenVDB relies on
// them (vdb_layout.h).
#pragma once

#include <filesystem>
#include <memory>

#include "runtime/base/openvdb_grids.h"

namespace rapid {

class VdbFile {
public:
    // Reads everything but the values of the grids. Throws Error if the file is cut or damaged, and openvdb::Exception
    // if OpenVDB does not know its contents.
    explicit VdbFile(const std::filesystem::path& path);
    ~VdbFile();

    // Returns the grids without their values, sorted by name.
    const openvdb::GridPtrVec& grids() const;

    // Returns one of grids() with its values. Throws like the constructor.
    openvdb::GridBase::Ptr read(const openvdb::GridBase::Ptr& grid);

private:
    class Archive;
    std::unique_ptr<Archive> archive_;
};

}  // namespace rapid
