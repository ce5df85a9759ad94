// A mesh that deforms: a file for each frame, all with the same faces between the same vertices.
//
// Before its first frame the first file holds, after its last the last. A file is read when its frame is first asked
// for, and the few that were asked for last are kept.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class MeshSequence {
public:
    // Reads the first file. `name`: the pattern, for messages. Error: no files, a frame missing between others, and
    // what read_mesh throws.
    MeshSequence(std::map<int, std::filesystem::path> files, std::string name);

    const std::string& name() const { return name_; }
    int first() const { return files_.begin()->first; }
    int last() const { return files_.rbegin()->first; }
    const MeshPtr& rest() const { return rest_; }  // the first file's

    // The mesh of the file that holds at this frame, with the first one's faces; its values are its own. From any
    // thread. Error: another number of vertices or faces than the first file has (naming the frame and both counts).
    MeshPtr at(std::int64_t frame) const;

private:
    MeshPtr read(int frame) const;

    std::map<int, std::filesystem::path> files_;
    std::string name_;
    std::size_t corners_, faces_;          // of each file
    std::vector<std::int32_t> vertex_of_;  // corners to vertices
    MeshPtr rest_;

    mutable std::mutex mutex_;
    mutable std::deque<std::pair<int, MeshPtr>> kept_;  // the last one asked for in front
};

using MeshSequencePtr = std::shared_ptr<const MeshSequence>;

}  // namespace rapid
