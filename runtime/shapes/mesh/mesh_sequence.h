// A mesh that deforms: a file for each frame, all with the same faces between the same vertices.
//
// Beyond the first and the last frame goes what a FrameSequence says. A file is read when its frame is first needed,
// and the few most recent ones are kept.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "runtime/frame_sequence.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class MeshSequence {
public:
    // Reads the first file. `name`: the pattern, for messages. Error: no files, a frame missing between others, and
    // what read_mesh throws.
    // order: of the frames; its first and last are those of the files, whatever they were.
    MeshSequence(std::map<int, std::filesystem::path> files, std::string name, FrameSequence order = {});

    const std::string& name() const { return name_; }
    int first() const { return files_.begin()->first; }  // file
    int last() const { return files_.rbegin()->first; }
    const FrameSequence& order() const { return order_; }
    const MeshPtr& rest() const { return rest_; }  // the first file's

    // Whether there is a mesh at this frame.
    bool has(std::int64_t frame) const { return order_.file_of(frame).has_value(); }
    // The mesh of the file of this frame, with the faces of the first one; its values are its own. Where there is none,
    // that of the nearest file. From any thread. Error: another number of vertices or faces than in the first file
    // (with the frame and both counts).
    MeshPtr at(std::int64_t frame) const;

private:
    MeshPtr read(int frame) const;

    std::map<int, std::filesystem::path> files_;
    std::string name_;
    FrameSequence order_;
    std::size_t corners_, faces_;          // of each file
    std::vector<std::int32_t> vertex_of_;  // corners to vertices
    MeshPtr rest_;

    mutable std::mutex mutex_;
    mutable std::deque<std::pair<int, MeshPtr>> kept_;  // most recent first
};

using MeshSequencePtr = std::shared_ptr<const MeshSequence>;

}  // namespace rapid
