// Curves: polylines that are static, moving or deforming.
//
// The segments are stored as mesh faces: a segment from a to b is the triangle (a, b, b). A position on it is a
// position on the face, with weight b1 along it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// The connectivity of open or closed curves.
struct CurveLines {
    struct Line {
        std::int32_t a, b;
    };
    std::vector<Line> lines;                  // along each curve, curve by curve
    std::vector<std::int32_t> before, after;  // neighbours of each point along its curve; -1 beyond an end

    // counts: points per curve, in order.
    CurveLines(std::span<const std::size_t> counts, bool closed);
};

class Curves : public Object {
public:
    static constexpr std::string_view param_type = "curve";
    std::string_view kind() const override { return "curve"; }

    // values: attributes of the points. If u is not among them, it becomes the fraction of the curve's length. Throws
    // Error if there is no curve, a curve has fewer than two points, two neighbours coincide, or a coordinate is not
    // finite.
    Curves(std::vector<Vec3f> points, const std::vector<std::size_t>& counts, bool closed,
           std::map<std::string, Mesh::VertexValues> values, std::string name);
    // Creates the same curves with other point positions.
    Curves(const Curves& other, std::vector<Vec3f> points);

    std::span<const Vec3f> points() const { return mesh_->positions; }
    const std::shared_ptr<const CurveLines>& lines() const { return lines_; }
    const MeshPtr& mesh() const { return mesh_; }
    // Samples uniformly by length; N is the direction of the curve.
    ScatterPtr scatter() const;

private:
    std::shared_ptr<const CurveLines> lines_;
    MeshPtr mesh_;
};

using CurvesPtr = std::shared_ptr<const Curves>;

// Curves at whole frames, from files or a script. Every frame has the same numbers of points and lines.
class CurveFrames {
public:
    virtual ~CurveFrames() = default;

    // Single-threaded. Throws Error if the file or the script fails, or if the points differ in number from the first
    // frame.
    virtual CurvesPtr at(const FrameClock& clock, std::int64_t frame) const = 0;
    // Returns true if there are curves at this frame.
    virtual bool has(std::int64_t frame) const = 0;
    // Returns the frames between which they change.
    virtual FrameRange range() const = 0;
};

class MovingCurves : public Object {
public:
    static constexpr std::string_view param_type = "moving curve";

    // rest: the curves of the first frame if `frames` is not null.
    MovingCurves(CurvesPtr rest, std::shared_ptr<const CurveFrames> frames, MotionPtr motion)
        : rest_(std::move(rest)), frames_(std::move(frames)), motion_(std::move(motion))
    {
    }
    std::string_view kind() const override { return "moving curve"; }
    bool varies() const override { return true; }

    bool deforms() const { return frames_ != nullptr; }
    const CurvesPtr& rest() const { return rest_; }
    const MotionPtr& motion() const { return motion_; }
    FrameRange range() const;
    // Returns true if there are curves throughout the time between two frames, which may be fractional.
    bool has(double from, double to) const;
    std::shared_ptr<const MovingCurves> transformed(const MotionPtr& motion) const;

    // Returns the curves at the end of a step of the clock. Deforming curves are defined at whole frames only.
    // Single-threaded.
    CurvesPtr at(const FrameClock& clock, std::int64_t step) const;

private:
    CurvesPtr rest_;
    std::shared_ptr<const CurveFrames> frames_;  // null if they do not deform
    MotionPtr motion_;
};

using MovingCurvesPtr = std::shared_ptr<const MovingCurves>;

CurvesPtr transformed(const CurvesPtr& curves, const Eigen::Affine3d& map);

// Determines the travel of curves in the interval of a step, as for meshes (body_path.h).
FramePath path_of(const MovingCurves& curves, const FrameClock& clock, std::int64_t step, const PathOptions& options);
// Returns the curves of their points in the interval. curves_path() takes births on the curves at the end of the step.
std::vector<Cubic<Vec3d>> point_curves(const MovingCurves& curves, const FrameClock& clock, std::int64_t step,
                                       const FramePath& path);
BodyPathPtr curves_path(const MovingCurves& curves, const FrameClock& clock, std::int64_t step, const FramePath& path);

}  // namespace rapid
