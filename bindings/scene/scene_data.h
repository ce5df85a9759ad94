// What frames and snapshots hold.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "include/rapid/scene.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/value.h"

namespace rapid {

struct SceneFrame::Data {
    FrameResult result;
    std::vector<std::string> warnings;
    const void* scene = nullptr;  // whose plan it is of; not followed

    // Columns that are uniform, written out. On first request, from any thread.
    mutable std::mutex mutex;
    mutable std::map<std::string, AnyColumn> expanded;  // by OUTPUT/NAME
};

struct SceneSnapshot::Data {
    Snapshot snapshot;
    std::string file;   // of the scene
    std::string nodes;  // a hash of those of the graph, by type and name
};

SceneValue value_of(const DetailValue& detail);
// Of a parameter: a boolean, a number, a text or three numbers.
SceneValue value_in_header(const Value& value);

}  // namespace rapid
