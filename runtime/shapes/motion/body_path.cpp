#include "runtime/shapes/motion/body_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/shapes/mesh/ray_crossings.h"

namespace rapid {
namespace {

// A jump travels this many times as far as in the surrounding frames, and this fraction of the body's size.
constexpr double jump_factor = 8, jump_size = 0.5;

using Map = Eigen::Matrix<double, 3, 4>;

Map map_at(const Motion& motion, const FrameClock& clock, std::int64_t frame)
{
    return motion.at(clock.at_step(frame)).affine().matrix().topRows<3>();
}

// Returns the normal of a surface after a linear map. Normals transform by the cofactors of the map.
Vec3f mapped_normal(const Eigen::Matrix3d& map, const Vec3f& normal)
{
    const Vec3d n = normal.cast<double>();
    const Vec3d x = map.col(0), y = map.col(1), z = map.col(2);
    return (n.x() * y.cross(z) + n.y() * z.cross(x) + n.z() * x.cross(y)).normalized().cast<float>();
}

class RigidPath final : public BodyPath {
public:
    explicit RigidPath(const Cubic<Map>& map) : map_(map) {}

    void carry(std::span<const double> t, bool normals, std::span<Birthplace> births,
               std::span<Vec3d> velocity) const override
    {
        for (std::size_t i = 0; i < births.size(); ++i) {
            const Eigen::Vector4d X = births[i].P.cast<double>().homogeneous();
            const Cubic<Vec3d> curve{map_.c0 * X, map_.c1 * X, map_.c2 * X, map_.c3 * X};
            births[i].P = curve.at(t[i]).cast<float>();
            velocity[i] = curve.derivative(t[i]);
            if (normals && !births[i].N.isZero(0))
                births[i].N = mapped_normal(map_.at(t[i]).leftCols<3>(), births[i].N);
        }
    }

private:
    Cubic<Map> map_;
};

// Carries births along the curves of all vertices of a mesh.
class DeformingPath final : public BodyPath {
public:
    DeformingPath(MeshPtr mesh, std::vector<Cubic<Vec3d>> curves, BirthDomain on)
        : mesh_(std::move(mesh)), on_(on), curves_(std::move(curves))
    {
        if (on == BirthDomain::Volume) crossings_.emplace(mesh_);
    }

    void carry(std::span<const double> t, bool normals, std::span<Birthplace> births,
               std::span<Vec3d> velocity) const override
    {
        std::vector<RayCrossings::Crossing> crossings;
        for (std::size_t i = 0; i < births.size(); ++i) {
            Birthplace& birth = births[i];
            if (on_ == BirthDomain::Volume) {
                const Cubic<Vec3d> curve = curve_inside(birth.P, crossings);
                birth.P = curve.at(t[i]).cast<float>();
                velocity[i] = curve.derivative(t[i]);
            } else if (on_ == BirthDomain::Vertices) {
                const Cubic<Vec3d>& curve = curves_[static_cast<std::size_t>(birth.element)];
                birth.P = curve.at(t[i]).cast<float>();
                velocity[i] = curve.derivative(t[i]);
            } else {
                carry_on_face(t[i], normals, birth, velocity[i]);
            }
        }
    }

    // The cross product of two edges, cubics in t, is a polynomial of degree six: a convex combination of its Bernstein
    // coefficients.
    std::vector<double> largest_areas() const override
    {
        if (on_ != BirthDomain::Faces) return {};
        constexpr double of_three[] = {1, 3, 3, 1}, of_six[] = {1, 6, 15, 20, 15, 6, 1};  // binomials
        std::vector<double> areas;
        areas.reserve(mesh_->triangles.size());
        for (const Mesh::Triangle& triangle : mesh_->triangles) {
            const auto ab = bernstein(corner(triangle, 0), corner(triangle, 1));
            const auto ac = bernstein(corner(triangle, 0), corner(triangle, 2));
            double largest = 0;
            for (int k = 0; k <= 6; ++k) {
                Vec3d sum = Vec3d::Zero();
                for (int i = std::max(0, k - 3); i <= std::min(3, k); ++i)
                    sum += of_three[i] * of_three[k - i] / of_six[k] * ab[i].cross(ac[k - i]);
                largest = std::max(largest, sum.norm() / 2);
            }
            areas.push_back(largest);
        }
        return areas;
    }
    double area(std::int32_t face, double t) const override
    {
        const Mesh::Triangle& triangle = mesh_->triangles[static_cast<std::size_t>(face)];
        const Vec3d A = corner(triangle, 0).at(t);
        return (corner(triangle, 1).at(t) - A).cross(corner(triangle, 2).at(t) - A).norm() / 2;
    }

private:
    // Returns the Bernstein coefficients of the edge from a to b.
    static std::array<Vec3d, 4> bernstein(const Cubic<Vec3d>& a, const Cubic<Vec3d>& b)
    {
        const Vec3d c0 = b.c0 - a.c0, c1 = b.c1 - a.c1, c2 = b.c2 - a.c2, c3 = b.c3 - a.c3;
        return {c0, c0 + c1 / 3, c0 + (2 * c1 + c2) / 3, c0 + c1 + c2 + c3};
    }
    const Cubic<Vec3d>& corner(const Mesh::Triangle& triangle, int k) const
    {
        return curves_[static_cast<std::size_t>(triangle[k])];
    }

    void carry_on_face(double t, bool normals, Birthplace& birth, Vec3d& velocity) const
    {
        const Mesh::Triangle& triangle = mesh_->triangles[static_cast<std::size_t>(birth.element)];
        const Cubic<Vec3d>&a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
        const Vec3d A = a.at(t), B = b.at(t), C = c.at(t);
        const double u = birth.b1, w = birth.b2;
        const Vec3d va = a.derivative(t);
        birth.P = (A + u * (B - A) + w * (C - A)).cast<float>();
        velocity = va + u * (b.derivative(t) - va) + w * (c.derivative(t) - va);
        if (normals) birth.N = (B - A).cross(C - A).normalized().cast<float>();
    }

    // Returns the curve of the point at (y, z) of a triangle of the mesh at the frame.
    Cubic<Vec3d> curve_on(std::int32_t t, const Vec3d& P) const
    {
        const Mesh::Triangle& triangle = mesh_->triangles[static_cast<std::size_t>(t)];
        const auto yz = [&](int k) -> Eigen::Vector2d {
            return mesh_->positions[static_cast<std::size_t>(triangle[k])].cast<double>().tail<2>();
        };
        const Eigen::Vector2d ab = yz(1) - yz(0), ac = yz(2) - yz(0), ap = P.tail<2>() - yz(0);
        const double twice_area = ab.x() * ac.y() - ab.y() * ac.x();
        const double u = (ap.x() * ac.y() - ap.y() * ac.x()) / twice_area;
        const double w = (ab.x() * ap.y() - ab.y() * ap.x()) / twice_area;
        return mix(mix(corner(triangle, 0), corner(triangle, 1), u / std::max(1e-300, 1 - w)), corner(triangle, 2), w);
    }

    static Cubic<Vec3d> mix(const Cubic<Vec3d>& a, const Cubic<Vec3d>& b, double t)
    {
        const auto part = [t](const Vec3d& p, const Vec3d& q) -> Vec3d { return p + t * (q - p); };
        return {part(a.c0, b.c0), part(a.c1, b.c1), part(a.c2, b.c2), part(a.c3, b.c3)};
    }

    Cubic<Vec3d> curve_inside(const Vec3f& position, std::vector<RayCrossings::Crossing>& crossings) const
    {
        const Vec3d P = position.cast<double>();
        crossings_->along_x(P.y(), P.z(), crossings);
        const auto behind = std::find_if(crossings.begin(), crossings.end(),
                                         [&](const RayCrossings::Crossing& crossing) { return crossing.x > P.x(); });
        // Rounding to single precision may put P on the last face of its line, or slightly beyond it.
        if (crossings.empty()) return curve_nearest(P);
        const auto& high = behind == crossings.end() ? crossings.back() : *behind;
        const auto& low = behind == crossings.begin() ? crossings.front() : *std::prev(behind);
        const double across = high.x - low.x;
        const double t = across > 0 ? std::clamp((P.x() - low.x) / across, 0.0, 1.0) : 0;
        return mix(curve_on(low.triangle, P), curve_on(high.triangle, P), t);
    }

    // Returns the curve of the nearest vertex, displaced to start at P.
    Cubic<Vec3d> curve_nearest(const Vec3d& P) const
    {
        const auto nearest =
            std::min_element(mesh_->positions.begin(), mesh_->positions.end(), [&](const Vec3f& a, const Vec3f& b) {
                return (a.cast<double>() - P).squaredNorm() < (b.cast<double>() - P).squaredNorm();
            });
        Cubic<Vec3d> curve = curves_[static_cast<std::size_t>(nearest - mesh_->positions.begin())];
        curve.c0 += P - nearest->cast<double>();
        return curve;
    }

    MeshPtr mesh_;  // at the frame
    BirthDomain on_;
    std::vector<Cubic<Vec3d>> curves_;  // per vertex
    std::optional<RayCrossings> crossings_;
};

class PartOfPath final : public BodyPath {
public:
    PartOfPath(BodyPathPtr path, double begin, double length) : path_(std::move(path)), begin_(begin), length_(length)
    {
    }

    void carry(std::span<const double> t, bool normals, std::span<Birthplace> births,
               std::span<Vec3d> velocity) const override
    {
        std::vector<double> of_whole(t.size());
        for (std::size_t i = 0; i < t.size(); ++i) of_whole[i] = begin_ + length_ * t[i];
        path_->carry(of_whole, normals, births, velocity);
        for (Vec3d& v : velocity.first(births.size())) v *= length_;
    }
    std::vector<double> largest_areas() const override { return path_->largest_areas(); }
    double area(std::int32_t face, double t) const override { return path_->area(face, begin_ + length_ * t); }

private:
    BodyPathPtr path_;
    double begin_, length_;
};

// Converts a range of frames to steps of the clock. A script's motion has none before the first.
FrameRange in_steps(FrameRange range, const FrameClock& clock)
{
    const auto start = static_cast<double>(clock.start);
    if (std::isinf(range.first) && range.first < 0) range.first = start;
    for (double* frame : {&range.first, &range.last}) *frame = start + (*frame - start) * clock.subframes;
    return range;
}

// Converts cuts to steps. A jump to a frame happens in its last step.
PathOptions in_steps(PathOptions options, const FrameClock& clock)
{
    if (!options.cuts) return options;
    std::set<std::int64_t> steps;
    for (const std::int64_t frame : *options.cuts) steps.insert(clock.step_of(frame));
    options.cuts = std::move(steps);
    return options;
}

double root_mean_square(const Mesh& a, const Mesh& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.positions.size(); ++i)
        sum += (b.positions[i].cast<double>() - a.positions[i].cast<double>()).squaredNorm();
    return std::sqrt(sum / double(a.positions.size()));
}

}  // namespace

std::string describe(const Jump& jump, std::int64_t frame)
{
    return fmt::format(
        "jumps by {:.3g} m to frame {}, {}", jump.distance, frame,
        jump.usual > 0 ? fmt::format("{:.3g} times as far as in the neighbouring frames", jump.distance / jump.usual)
                       : std::string("and is at rest in the neighbouring frames"));
}

FramePath FramePath::find(std::int64_t frame, const FrameRange& range, const PathOptions& options, double size,
                          const std::function<double(std::int64_t)>& travel)
{
    FramePath path;
    path.alpha = options.kind == PathOptions::Spline ? options.alpha : 0.5;
    const auto moves = [&](std::int64_t i) { return range.first <= double(i - 1) && double(i) <= range.last; };
    if (options.kind == PathOptions::None || !moves(frame)) return path;

    const auto jump_at = [&](std::int64_t i) -> std::optional<Jump> {
        if (!moves(i) || !(moves(i - 1) || moves(i + 1))) return std::nullopt;
        const double here = travel(i);
        if (!(here > jump_size * size)) return std::nullopt;
        const double usual = std::max(moves(i - 1) ? travel(i - 1) : 0, moves(i + 1) ? travel(i + 1) : 0);
        return here > jump_factor * usual ? std::optional(Jump{here, usual}) : std::nullopt;
    };
    const auto is_cut = [&](std::int64_t i) {
        return options.cuts ? options.cuts->count(i) > 0 : jump_at(i).has_value();
    };
    path.after = moves(frame + 1) && !is_cut(frame + 1);
    path.before = moves(frame - 1) && !is_cut(frame - 1);
    if (options.cuts ? options.cuts->count(frame) > 0 : (path.jump = jump_at(frame)).has_value())
        path.kind = AfterCut;
    else
        path.kind = options.kind == PathOptions::Linear ? Straight : Curved;
    return path;
}

BodyPathPtr rigid_path(const Motion& motion, const FrameClock& clock, std::int64_t frame, const FramePath& path)
{
    return std::make_shared<RigidPath>(path.through<Map>(map_at(motion, clock, path.before ? frame - 2 : frame),
                                                         map_at(motion, clock, frame - 1), map_at(motion, clock, frame),
                                                         map_at(motion, clock, path.after ? frame + 1 : frame)));
}

BodyPathPtr deforming_path(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t frame, const FramePath& path,
                           BirthDomain on)
{
    return std::make_shared<DeformingPath>(mesh.at(clock, frame), vertex_curves(mesh, clock, frame, path), on);
}

std::vector<Cubic<Vec3d>> vertex_curves(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t frame,
                                        const FramePath& path)
{
    const MeshPtr now = mesh.at(clock, frame);
    const MeshPtr at[] = {path.before ? mesh.at(clock, frame - 2) : now,
                          path.kind == FramePath::Still ? now : mesh.at(clock, frame - 1), now,
                          path.after ? mesh.at(clock, frame + 1) : now};
    const auto position = [&](int k, std::size_t i) -> Vec3d { return at[k]->positions[i].cast<double>(); };
    std::vector<Cubic<Vec3d>> curves;
    curves.reserve(now->positions.size());
    for (std::size_t i = 0; i < now->positions.size(); ++i)
        curves.push_back(path.through<Vec3d>(position(0, i), position(1, i), position(2, i), position(3, i)));
    return curves;
}

BodyPathPtr part_of(BodyPathPtr path, double begin, double length)
{
    return std::make_shared<PartOfPath>(std::move(path), begin, length);
}

FramePath path_of(const Motion& motion, const Box3d& rest, const FrameClock& clock, std::int64_t frame,
                  const PathOptions& options)
{
    const auto travel = [&](std::int64_t i) {
        const Map step = map_at(motion, clock, i) - map_at(motion, clock, i - 1);
        double sum = 0;
        for (int k = 0; k < 8; ++k)
            sum += (step * Vec3d(rest.corner(static_cast<Box3d::CornerType>(k))).homogeneous()).squaredNorm();
        return std::sqrt(sum / 8);
    };
    const double scale = motion.at(clock.at_step(frame)).scale;
    return FramePath::find(frame, in_steps(motion.range(), clock), in_steps(options, clock),
                           scale * rest.diagonal().norm(), travel);
}

FramePath path_of(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t frame, const PathOptions& options)
{
    const Box3d rest = mesh.rest()->bounds().cast<double>();
    if (!mesh.deforms()) return path_of(*mesh.motion(), rest, clock, frame, options);
    const auto travel = [&](std::int64_t i) { return root_mean_square(*mesh.at(clock, i - 1), *mesh.at(clock, i)); };
    return FramePath::find(frame, in_steps(mesh.range(), clock), in_steps(options, clock),
                           mesh.at(clock, frame)->bounds().diagonal().norm(), travel);
}

FramePath path_of(const AnimatedShape& shape, const FrameClock& clock, std::int64_t frame, const PathOptions& options)
{
    return path_of(*shape.motion(), shape.rest()->bounds(), clock, frame, options);
}

}  // namespace rapid
