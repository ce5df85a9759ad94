// The motion of meshes that a program offers again for each frame.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bindings/host/session.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/mesh/mesh_sequence.h"
#include "runtime/shapes/motion/animated.h"

namespace rapid {

// The meshes of one name in the last frames. A snapshot shares them. Its file stores the positions, except those of a
// mesh that was offered before the start and never again.
struct OfferedPath {
    std::string name;
    int first = 0;  // frame of the first mesh
    MeshPtr rest;   // the first one with these faces, which may have been dropped from `meshes`
    std::vector<MeshPtr> meshes;
    bool is_of_start = false;

    std::size_t bytes() const;  // in a file

    template <class Archive>
    void serialize(Archive& keep)
    {
        std::vector<Mesh::Triangle> triangles;
        std::vector<std::vector<Vec3f>> positions;
        if constexpr (!Archive::is_loading::value)
            if (!is_of_start) list(triangles, positions);
        keep(name, first, is_of_start, triangles, positions);
        if constexpr (Archive::is_loading::value) take(triangles, positions);
    }

private:
    void list(std::vector<Mesh::Triangle>& triangles, std::vector<std::vector<Vec3f>>& positions) const;
    // Throws Error if list() cannot have returned them.
    void take(const std::vector<Mesh::Triangle>& triangles, const std::vector<std::vector<Vec3f>>& positions);
};

// Makes a mesh that is offered for a frame continue the one of the frame before, if both have the same faces: functions
// of the frame then get it as the state of a mesh that deforms (Offers::in_motion). If the program offers no mesh for a
// frame, the last one rests.
class OfferedMeshes {
public:
    explicit OfferedMeshes(Offers& offers) : offers_(offers) {}

    // Begins again at a frame: each mesh offered last is at rest there.
    void start(std::int64_t frame);
    // Takes an object for a frame that has not been computed. Several for one frame replace each other.
    void offer(const std::string& name, const ObjectPtr& object, std::int64_t frame);
    // Returns the warnings since the last call: one for each mesh whose faces changed, once after each start.
    std::vector<std::string> take_warnings();

    std::vector<OfferedPath> save() const;
    // Restores the meshes of a snapshot, also those at rest. Must be called after start().
    void load(const std::vector<OfferedPath>& paths);

private:
    struct Offered {
        std::shared_ptr<MeshSequence> sequence;
        std::shared_ptr<MeshSequence> replaced = nullptr;      // by one with other faces, in its first frame
        std::shared_ptr<const AnimatedMesh> moving = nullptr;  // the same; null at rest
        bool is_of_start = false;                              // not offered since then
        bool warned = false;
    };

    void set_in_motion(const std::string& name, Offered& offered);

    Offers& offers_;
    std::map<std::string, Offered> meshes_;  // by name
    std::vector<std::string> warnings_;
};

}  // namespace rapid
