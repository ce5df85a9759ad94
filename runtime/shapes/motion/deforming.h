// Level sets of a mesh that deforms: colliders from a sequence of files (paper §4.4).
//
// One level set is built a frame. Between two of them the surface goes the way of its faces, each vertex along the
// cubic Hermite path that births on it go by: a place is seen from the nearest face, and asked of the level sets at
// both ends where that face is then. So sub-steps need no level sets of their own, parts that are thinner than their
// way in a frame pass through nothing, and at the ends the shape is that of the level set, to the bit.
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

struct TriangleTree;

class DeformingLevelSet : public Object {
public:
    static constexpr std::string_view param_type = "deforming level set";

    // Builds the first frame's, for the errors and warnings of level_set_from_mesh.
    DeformingLevelSet(std::shared_ptr<const AnimatedMesh> mesh, const LevelSetOptions& options,
                      std::vector<std::string>& warnings);

    std::string_view kind() const override { return "deforming level set"; }
    bool varies() const override { return true; }

    const AnimatedMesh& mesh() const { return *mesh_; }
    double voxel() const { return options_.voxel; }
    const Box3d& bounds() const { return bounds_; }  // of the first frame's surface
    std::shared_ptr<const DeformingLevelSet> transformed(const MotionPtr& motion) const;

    // Of the mesh, in another of its shapes; its band is at least so wide, m.
    LevelSetPtr build(const MeshPtr& mesh, double band) const;
    const std::shared_ptr<const TriangleTree>& tree() const { return tree_; }

private:
    std::shared_ptr<const AnimatedMesh> mesh_;
    LevelSetOptions options_;
    Box3d bounds_;
    Mesh::Openness open_;  // the same in all frames
    std::shared_ptr<const TriangleTree> tree_;
};

using DeformingLevelSetPtr = std::shared_ptr<const DeformingLevelSet>;

// One deforming level set on its way through the frames: keeps what the next interval needs.
class Deformation {
public:
    explicit Deformation(DeformingLevelSetPtr body) : body_(std::move(body)) {}

    struct Interval {
        ShapePtr shape;            // times are in seconds since its beginning
        std::optional<Jump> jump;  // that was found in its frame
    };
    // Between two moments of one frame (`to` in it, or its end), as numbers of frames; moved by `motion` besides, where
    // there is one. The level sets' band is at least so wide, m. On one thread, as the motion may be a script's.
    Interval over(const FrameClock& clock, double from, double to, const MotionPtr& motion, const PathOptions& options,
                  double band);

    const DeformingLevelSetPtr& body() const { return body_; }
    const LevelSetPtr& at_end() const { return at_end_; }  // of the last interval

private:
    DeformingLevelSetPtr body_;
    double end_ = std::numeric_limits<double>::quiet_NaN();  // of the last interval
    LevelSetPtr at_end_;
};

}  // namespace rapid
