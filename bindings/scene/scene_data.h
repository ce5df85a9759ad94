// What frames and snapshots hold.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/value.h"
#include "runtime/picture/scene.h"

namespace rapid {

struct [[gnu::visibility("hidden")]] SceneFrame::Data
{
    FrameResult result;
    std::vector<std::string> warnings;
    std::uint64_t scene = 0;  // whose plan it is of, by its number; 0: of none

    // That a frame has chosen at first: "main", or the first one where there is none.
    std::string first_output() const;

    // Columns that are uniform, written out. On first request, from any thread.
    mutable std::mutex mutex;
    mutable std::map<std::string, AnyColumn> expanded;  // by OUTPUT/NAME
};

class StateFile;

struct [[gnu::visibility("hidden")]] SceneSnapshot::Data
{
    // Error: what SceneSnapshot::read() refuses.
    static SceneSnapshot read_from(const StateFile& file);

    Snapshot snapshot;
    std::string file;   // of the scene
    std::string nodes;  // a hash of those of the graph, by type and name
};

struct [[gnu::visibility("hidden")]] SceneShapes::Data
{
    std::shared_ptr<const PictureScene> scene;
    std::vector<std::string> warnings;
};

SceneValue value_of(const DetailValue& detail);

// As the renderer takes it, which refuses sizes. Error: a camera that looks at its own place,
// or nowhere; an angle of view that none has.
std::shared_ptr<const PictureOptions> picture_options(const PictureCamera& camera, PictureSize size);

}  // namespace rapid
