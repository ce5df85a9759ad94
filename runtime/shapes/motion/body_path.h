// The curves along which the points of a moving body travel in one frame (paper §3.2): cubic Hermite splines through
// their positions at the surrounding frames, and the derivatives of these.
//
//   p(t) = (1+2t)(1-t)² p_{f-1} + t(1-t)² m0 + t²(3-2t) p_f + t²(t-1) m1,
//   m0 = α (p_f - p_{f-2}),   m1 = α (p_{f+1} - p_{f-1})
//
// with t from 0 at frame f-1 to 1 at frame f. If the motion begins, ends or jumps, a tangent is one-sided:
// m0 = α (-3 p_{f-1} + 4 p_f - p_{f+1}), and its mirror image for m1. Beyond its ends the body is at rest. Frames are
// the steps of the given clock.
//
// The paper prints the first term of the derivative as 6t³, the last pair of indices as t+1 and t-1, and omits that the
// derivative is per frame. A body at rest has a velocity of exactly 0, because everything is built from differences of
// positions.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

struct PathOptions {
    enum Kind { Spline, Linear, None };  // None: at rest at its position at the end of the frame
    Kind kind = Spline;
    double alpha = 0.5;
    // Frames f with a jump of the motion between f-1 and f. If not given, jumps are detected (FramePath::find).
    std::optional<std::set<std::int64_t>> cuts;
};

// The body travels `distance` metres between two frames, and at most `usual` metres in the surrounding frames.
struct Jump {
    double distance, usual;
};

// Returns a description for messages: "jumps by 3 m to frame 12, 40 times as far as in the frames around".
std::string describe(const Jump& jump, std::int64_t frame);

// A cubic in t.
template <class T>
struct Cubic {
    T c0, c1, c2, c3;

    T at(double t) const { return c0 + t * (c1 + t * (c2 + t * c3)); }
    T derivative(double t) const { return c1 + t * (2 * c2 + 3 * t * c3); }
};

// How the points of a body travel from frame f-1 to frame f.
struct FramePath {
    enum Kind {
        Still,     // positions at f
        AfterCut,  // straight to the positions at f, with the velocity after f: nothing is born along a jump
        Straight,
        Curved,
    };
    Kind kind = Still;
    double alpha = 0.5;
    bool before = false, after = false;  // f-2, respectively f+1, belongs to the same motion
    std::optional<Jump> jump = {};       // detected between f-1 and f

    // Determines the path from frame - 1 to frame. travel(i): distance that the body travels between frame i-1 and i
    // (root mean square), m. size: its diagonal, m.
    //
    // A jump is detected if a body travels more than 8 times as far as in both surrounding frames (in one, if the
    // motion begins or ends there), and more than half its size.
    static FramePath find(std::int64_t frame, const FrameRange& range, const PathOptions& options, double size,
                          const std::function<double(std::int64_t)>& travel);

    // Returns the cubic through the positions at f-2, f-1, f, f+1. T: a vector, or an affine map, whose cubic moves
    // every point along its own curve.
    template <class T>
    Cubic<T> through(const T& p0, const T& p1, const T& p2, const T& p3) const
    {
        const T none = T::Zero();
        const T d0 = p1 - p0, d1 = p2 - p1, d2 = p3 - p2;
        switch (kind) {
            case Still:
                return {p2, none, none, none};
            case AfterCut: {
                const T m = after ? T(2 * alpha * d2) : none;
                return {p2 - m, m, none, none};
            }
            case Straight:
                return {p1, d1, none, none};
            case Curved:
                break;
        }
        const T m0 = alpha * (before ? T(d0 + d1) : after ? T(3 * d1 - d2) : T(2 * d1));
        const T m1 = alpha * (after ? T(d1 + d2) : before ? T(3 * d1 - d0) : T(2 * d1));
        return {p1, m0, 3 * d1 - 2 * m0 - m1, m0 + m1 - 2 * d1};
    }
};

// Carries births along with a body, from their positions in the scatter to those at the time of birth.
class BodyPath {
public:
    virtual ~BodyPath() = default;

    // Moves the births to time t[i] of the frame's interval, including their normals if `normals`, and computes their
    // velocities in metres per frame. All have shape [n]. Thread-safe.
    virtual void carry(std::span<const double> t, bool normals, std::span<Birthplace> births,
                       std::span<Vec3d> velocity) const = 0;

    // Returns bounds on the area of each face in the interval, m²; empty unless births are on faces that deform.
    virtual std::vector<double> largest_areas() const { return {}; }
    // Returns the area of a face that deforms at time t, m².
    virtual double area(std::int32_t face, double t) const
    {
        static_cast<void>(face), static_cast<void>(t);
        return 0;
    }
};

using BodyPathPtr = std::shared_ptr<const BodyPath>;

// Returns the path of a rigid motion. Births are given on the rest body.
BodyPathPtr rigid_path(const Motion& motion, const FrameClock& clock, std::int64_t frame, const FramePath& path);

// Returns the path of a deforming mesh. Births are given on the mesh at the frame.
enum class BirthDomain {
    Faces,     // element: a triangle, with barycentric weights
    Vertices,  // element: a vertex
    Volume,    // only P; keeps its ratio between the adjacent faces along x
};
BodyPathPtr deforming_path(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t frame, const FramePath& path,
                           BirthDomain on);

// Returns the curves of the vertices of a deforming mesh.
std::vector<Cubic<Vec3d>> vertex_curves(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t frame,
                                        const FramePath& path);

// Returns a section of a path, starting at t = begin, with this length in t.
BodyPathPtr part_of(BodyPathPtr path, double begin, double length);

// Determines how a body travels in the interval of a frame. Single-threaded, as it evaluates the motions.
FramePath path_of(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t frame, const PathOptions& options);
FramePath path_of(const Motion& motion, const Box3d& rest, const FrameClock& clock, std::int64_t frame,
                  const PathOptions& options);
FramePath path_of(const AnimatedShape& shape, const FrameClock& clock, std::int64_t frame, const PathOptions& options);

// Reparametrises the section of a cubic between two times to the range 0 to 1.
inline Cubic<Vec3d> cubic_part(const Cubic<Vec3d>& curve, double from, double to)
{
    const double d = to - from;
    return {curve.at(from), d * curve.derivative(from), d * d * (curve.c2 + 3 * from * curve.c3), d * d * d * curve.c3};
}

}  // namespace rapid
