// A deforming mesh: one file or one mesh in memory per frame, all with the same vertices and faces in the same order.
//
// FrameSequence determines the mesh beyond the first and last frame. Files are read when first needed, and the most
// recent few stay cached. Meshes in memory are added frame by frame.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "runtime/base/frame_sequence.h"
#include "runtime/shapes/mesh/deforming_mesh.h"

namespace rapid {

class MeshSequence final : public DeformingMesh {
public:
    // Reads the first file. `name`: the pattern, for messages. order: first and last are replaced by those of the
    // files. Throws Error if there are no files, if a frame is missing in between, or if read_mesh() does.
    MeshSequence(std::map<int, std::filesystem::path> files, std::string name, FrameSequence order = {});
    // Holds meshes of consecutive frames, at least one, with the faces of `rest`.
    MeshSequence(MeshPtr rest, std::map<int, MeshPtr> meshes);

    // Adds the mesh of a frame after last(), with the faces of rest(). If frames are left out, the mesh rests until the
    // frame before, and its motion begins there. Meshes that no path to this frame depends on are dropped. Must not be
    // called while the sequence is in use.
    void append(int frame, MeshPtr mesh);
    const std::map<int, MeshPtr>& meshes() const { return meshes_; }  // in memory

    const std::string& name() const { return name_; }
    int first() const { return static_cast<int>(order_.first); }  // first frame that has a file or a mesh
    int last() const { return static_cast<int>(order_.last); }
    const FrameSequence& order() const { return order_; }
    const MeshPtr& rest() const override { return rest_; }  // the first mesh ever
    double begins() const override { return order_.begins(); }
    double ends() const override { return order_.ends(); }
    bool depends_on_clock() const override { return false; }

    // Returns true if the sequence has a mesh at this frame.
    bool has(std::int64_t frame) const override { return order_.file_of(frame).has_value(); }
    // Returns the mesh of this frame, with the faces of the first file and its own values. If there is none, returns
    // that of the nearest file. Thread-safe. Throws Error if the number of vertices or faces differs from the first
    // file (the message has the frame and both counts).
    MeshPtr at(std::int64_t frame) const;
    MeshPtr at(const FrameClock&, std::int64_t frame) const override { return at(frame); }

private:
    MeshPtr read(int frame) const;

    std::map<int, std::filesystem::path> files_;
    std::map<int, MeshPtr> meshes_;  // instead of files
    std::string name_;
    FrameSequence order_;
    std::size_t corners_ = 0, faces_ = 0;  // in each file
    std::vector<std::int32_t> vertex_of_;  // maps corners to vertices
    MeshPtr rest_;

    mutable std::mutex mutex_;
    mutable std::deque<std::pair<int, MeshPtr>> recent_;  // most recent first
};

}  // namespace rapid
