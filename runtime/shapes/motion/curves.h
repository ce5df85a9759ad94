// Curves: lines from point to point, at rest, moving or deforming.
//
// The lines are held as the faces of a mesh, that from a to b as the triangle (a, b, b): a place on one is that of a
// face, with the weight b1 along it.
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

// Which points follow one another, of curves that are open or closed.
struct CurveLines {
    struct Line {
        std::int32_t a, b;
    };
    std::vector<Line> lines;                  // along each curve, curve by curve
    std::vector<std::int32_t> before, after;  // by point, its neighbours along the curve; -1 beyond an end

    // counts: points of each curve, in order.
    CurveLines(std::span<const std::size_t> counts, bool closed);
};

class Curves : public Object {
public:
    static constexpr std::string_view param_type = "curve";
    std::string_view kind() const override { return "curve"; }

    // values: attributes of the points. Where they have none of the name, u is the part of the length of the curve.
    // Error: no curve, one of fewer than two points, two neighbours at one place, a coordinate that is not finite.
    Curves(std::vector<Vec3f> points, const std::vector<std::size_t>& counts, bool closed,
           std::map<std::string, Mesh::VertexValues> values, std::string name);
    // The same curves with points elsewhere.
    Curves(const Curves& other, std::vector<Vec3f> points);

    std::span<const Vec3f> points() const { return mesh_->positions; }
    const std::shared_ptr<const CurveLines>& lines() const { return lines_; }
    const MeshPtr& mesh() const { return mesh_; }
    // Places uniform by length; N is the direction of the curve.
    ScatterPtr scatter() const;

private:
    std::shared_ptr<const CurveLines> lines_;
    MeshPtr mesh_;
};

using CurvesPtr = std::shared_ptr<const Curves>;

// The curves at whole frames: files, or a script. Each frame has as many points on as many lines.
class CurveFrames {
public:
    virtual ~CurveFrames() = default;

    // On one thread. Error: of a file, or a script; other points than at the first frame.
    virtual CurvesPtr at(const FrameClock& clock, std::int64_t frame) const = 0;
    // Whether there are any at this frame.
    virtual bool has(std::int64_t frame) const = 0;
    // Between which they change.
    virtual FrameRange range() const = 0;
};

class MovingCurves : public Object {
public:
    static constexpr std::string_view param_type = "moving curve";

    // rest: those of the first frame, where frames is not null.
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
    // Whether there are any on the whole way between two frames, in frames.
    bool has(double from, double to) const;
    std::shared_ptr<const MovingCurves> transformed(const MotionPtr& motion) const;

    // At the end of a step of the clock; what deforms is known in those of whole frames. On one thread.
    CurvesPtr at(const FrameClock& clock, std::int64_t step) const;

private:
    CurvesPtr rest_;
    std::shared_ptr<const CurveFrames> frames_;  // null where they do not deform
    MotionPtr motion_;
};

using MovingCurvesPtr = std::shared_ptr<const MovingCurves>;

CurvesPtr transformed(const CurvesPtr& curves, const Eigen::Affine3d& map);

// How they travel in the interval of a step, as meshes do (body_path.h).
FramePath path_of(const MovingCurves& curves, const FrameClock& clock, std::int64_t step, const PathOptions& options);
// The curves of their points in it; those births along which are given on the curves at its end.
std::vector<Cubic<Vec3d>> point_curves(const MovingCurves& curves, const FrameClock& clock, std::int64_t step,
                                       const FramePath& path);
BodyPathPtr curves_path(const MovingCurves& curves, const FrameClock& clock, std::int64_t step, const FramePath& path);

}  // namespace rapid
