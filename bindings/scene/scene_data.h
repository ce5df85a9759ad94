// Data of frames and snapshots.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bindings/scene/offered_meshes.h"
#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"
#include "runtime/graph/error_sources.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/value.h"
#include "runtime/picture/scene.h"

namespace rapid {

struct [[gnu::visibility("hidden")]] SceneFrame::Data
{
    FrameResult result;
    std::shared_ptr<const ErrorSources> errors;  // null if its figures are not known
    std::vector<std::string> warnings;
    std::uint64_t scene = 0;  // number of the scene to whose plan it belongs; 0: none

    // Returns the initial output of a frame: "main", or the first one if there is no "main".
    std::string first_output() const;

    // Uniform columns, written out. On first request, from any thread.
    mutable std::mutex mutex;
    mutable std::map<std::string, AnyColumn> expanded;  // by OUTPUT/NAME
};

class StateFile;

struct [[gnu::visibility("hidden")]] SceneSnapshot::Data
{
    // Throws Error if the file is refused by SceneSnapshot::read().
    static SceneSnapshot read_from(const StateFile& file);

    Snapshot snapshot;
    std::vector<OfferedPath> meshes;
    std::string file;   // of the scene
    std::string nodes;  // a hash of the graph's nodes, by type and name

    // Lists what a file stores besides its header.
    template <class Archive>
    void serialize(Archive & keep)
    {
        keep(snapshot, meshes);
    }
};

struct [[gnu::visibility("hidden")]] SceneShapes::Data
{
    std::shared_ptr<const PictureScene> scene;
    std::vector<std::string> warnings;
};

SceneValue value_of(const DetailValue& detail);

// Returns options for the renderer, which checks sizes. Throws Error for a camera that looks at its own position, or
// nowhere, or an impossible angle of view.
std::shared_ptr<const PictureOptions> picture_options(const PictureCamera& camera, PictureSize size);

}  // namespace rapid
