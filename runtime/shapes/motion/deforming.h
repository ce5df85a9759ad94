// Level sets of a deforming mesh: colliders from a sequence of files (paper §4.4).
//
// One level set is built per frame. In between, the surface moves with its faces, and each vertex follows the cubic
// Hermite curve that births on it use. A position is expressed in the frame of its nearest face, and the level sets at
// both ends are sampled where that face is then. Sub-steps therefore need no level sets of their own, points cannot
// pass through parts that are thinner than their travel in a frame, and at both ends the shape is bit-identical to the
// level set.
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>

#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

struct TriangleTree;

class DeformingLevelSet : public Object, public std::enable_shared_from_this<DeformingLevelSet> {
public:
    static constexpr std::string_view param_type = "deforming level set";

    // Builds the level set of the first frame, for the errors and warnings of level_set_from_mesh().
    DeformingLevelSet(std::shared_ptr<const AnimatedMesh> mesh, const LevelSetOptions& options,
                      std::vector<std::string>& warnings);

    std::string_view kind() const override { return "deforming level set"; }
    bool varies() const override { return true; }

    const AnimatedMesh& mesh() const { return *mesh_; }
    double voxel() const { return options_.voxel; }
    const Box3d& bounds() const { return bounds_; }  // surface of the first frame
    std::shared_ptr<const DeformingLevelSet> transformed(const MotionPtr& motion) const;

    // Builds the level set of the mesh with other positions and a band of at least `band` m.
    LevelSetPtr build(const MeshPtr& mesh, double band) const;
    // Returns the level set of a whole frame. Reuses one that is still in use and has a wide enough band: several nodes
    // share those of a body. Thread-safe unless the motion is a script.
    LevelSetPtr at(const FrameClock& clock, std::int64_t frame, double band) const;
    // Returns the level set of a mesh of this body, as the state of the body at its frame.
    LevelSetPtr of(const MeshOfFrame& mesh) const;
    const std::shared_ptr<const TriangleTree>& tree() const { return tree_; }

private:
    std::shared_ptr<const AnimatedMesh> mesh_;
    LevelSetOptions options_;
    Box3d bounds_;
    Mesh::Openness open_;  // same for all frames
    std::shared_ptr<const TriangleTree> tree_;

    // Level sets in use, by fps, start and frame; fps and start are 0 if the mesh does not depend on them.
    struct Built {
        std::mutex mutex;
        std::map<std::tuple<double, std::int64_t, std::int64_t>, std::weak_ptr<const LevelSet>> by_frame;
    };
    std::shared_ptr<Built> built_ = std::make_shared<Built>();
};

using DeformingLevelSetPtr = std::shared_ptr<const DeformingLevelSet>;

// Advances a deforming level set through the frames and caches the data that the next interval needs.
class Deformation {
public:
    explicit Deformation(DeformingLevelSetPtr body = nullptr) : body_(std::move(body)) {}

    struct Interval {
        ShapePtr shape;            // times are in seconds since the beginning of the interval
        std::optional<Jump> jump;  // detected in the frame of the interval
    };
    // Returns the shape between two times in one frame (`to` may be its end), in frames. `motion` is applied after its
    // own, unless it is null. The band of the level sets is at least `band` m. Single-threaded, as the motion may be a
    // script.
    Interval over(const FrameClock& clock, double from, double to, const MotionPtr& motion, const PathOptions& options,
                  double band);

    // Returns true if the state belongs to this body, or comes from a snapshot and has no body yet.
    bool is_of(const DeformingLevelSetPtr& body) const { return !body_ || body_ == body; }
    void set_body(DeformingLevelSetPtr body) { body_ = std::move(body); }
    const LevelSetPtr& at_end() const { return at_end_; }  // of the last interval

    // Stores the end and the band of the last interval, whose level set is rebuilt from them.
    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(end_, band_);
    }

private:
    LevelSetPtr build(const MeshPtr& mesh, double band);

    DeformingLevelSetPtr body_;
    double end_ = std::numeric_limits<double>::quiet_NaN();  // end of the last interval
    LevelSetPtr at_end_;
    double band_ = 0;  // requested band, m
};

}  // namespace rapid
