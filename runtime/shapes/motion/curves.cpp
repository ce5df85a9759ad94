#include "runtime/shapes/motion/curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/shapes/mesh/detailed_mesh.h"
#include "runtime/shapes/scatter/alias_table.h"

namespace rapid {
namespace {

class ScatterOnLines final : public Scatter {
public:
    explicit ScatterOnLines(MeshPtr mesh) : mesh_(std::move(mesh))
    {
        std::vector<double> lengths;
        double sum = 0;
        for (const Mesh::Triangle& line : mesh_->triangles) {
            lengths.push_back((at(line, 1) - at(line, 0)).norm());
            sum += lengths.back();
        }
        chances_ = AliasTable(lengths, sum);
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        constexpr std::size_t block_size = 256;
        std::array<std::array<double, 4>, block_size> numbers;
        for (std::size_t begin = 0; begin < out.size(); begin += block_size) {
            const std::size_t n = std::min(block_size, out.size() - begin);
            uniform4(key, first + begin, 0, std::span(numbers).first(n));
            for (std::size_t i = 0; i < n; ++i) {
                Birthplace& birth = out[begin + i];
                birth.element = chances_.draw(numbers[i][0], numbers[i][1]);
                birth.b1 = static_cast<float>(numbers[i][2]);
                birth.b2 = 0;
                const Mesh::Triangle& line = mesh_->triangles[static_cast<std::size_t>(birth.element)];
                const Vec3d a = at(line, 0), segment = at(line, 1) - a;
                birth.P = (a + double(birth.b1) * segment).cast<float>();
                birth.N = segment.normalized().cast<float>();
            }
        }
    }

private:
    Vec3d at(const Mesh::Triangle& line, int end) const
    {
        return mesh_->positions[static_cast<std::size_t>(line[end])].cast<double>();
    }

    MeshPtr mesh_;
    AliasTable chances_;
};

class CurvesPath final : public BodyPath {
public:
    CurvesPath(MeshPtr mesh, std::vector<Cubic<Vec3d>> curves) : mesh_(std::move(mesh)), curves_(std::move(curves)) {}

    void carry(std::span<const double> t, bool normals, std::span<Birthplace> births,
               std::span<Vec3d> velocity) const override
    {
        for (std::size_t i = 0; i < births.size(); ++i) {
            const Mesh::Triangle& line = mesh_->triangles[static_cast<std::size_t>(births[i].element)];
            const Cubic<Vec3d>&a = curves_[static_cast<std::size_t>(line[0])],
                  &b = curves_[static_cast<std::size_t>(line[1])];
            const Vec3d A = a.at(t[i]), segment = b.at(t[i]) - A, v = a.derivative(t[i]);
            const double u = births[i].b1;
            births[i].P = (A + u * segment).cast<float>();
            velocity[i] = v + u * (b.derivative(t[i]) - v);
            if (normals) births[i].N = segment.normalized().cast<float>();
        }
    }

private:
    MeshPtr mesh_;
    std::vector<Cubic<Vec3d>> curves_;  // per point
};

// Returns u at both ends of each line, three values per face. The end of a closed curve has 1, although it is the first
// point, which has 0.
std::vector<float> parts_of_length(const Mesh& mesh, const CurveLines& lines)
{
    std::vector<double> begins, lengths;  // start of each line along its curve; length of each curve
    std::vector<std::size_t> curve;       // of each line
    for (const CurveLines::Line& line : lines.lines) {
        const auto at = [&](std::int32_t k) { return mesh.positions[static_cast<std::size_t>(k)].cast<double>(); };
        const bool goes_on = !curve.empty() && lines.after[static_cast<std::size_t>(line.a)] == line.b &&
                             lines.lines[curve.size() - 1].b == line.a;
        if (!goes_on) lengths.push_back(0);
        curve.push_back(lengths.size() - 1);
        begins.push_back(lengths.back());
        lengths.back() += (at(line.b) - at(line.a)).norm();
    }
    std::vector<float> parts;
    for (std::size_t k = 0; k < curve.size(); ++k) {
        const bool last = k + 1 == curve.size() || curve[k + 1] != curve[k];
        const double whole = lengths[curve[k]], begin = begins[k] / whole;
        const double end = last ? 1 : begins[k + 1] / whole;
        parts.insert(parts.end(), {float(begin), float(end), float(end)});
    }
    return parts;
}

void check_curves(std::span<const Vec3f> points, const CurveLines& lines)
{
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!points[i].allFinite()) throw Error(fmt::format("point {} of the curve is not finite", i + 1));
    for (const CurveLines::Line& line : lines.lines)
        if (points[static_cast<std::size_t>(line.a)] == points[static_cast<std::size_t>(line.b)])
            throw Error(fmt::format("points {} and {} have the same position; remove one", line.a + 1, line.b + 1));
}

}  // namespace

CurveLines::CurveLines(std::span<const std::size_t> counts, bool closed)
{
    std::int32_t first = 0;
    for (const std::size_t count : counts) {
        const auto n = static_cast<std::int32_t>(count);
        for (std::int32_t k = 0; k < n; ++k) {
            before.push_back(k > 0 ? first + k - 1 : closed ? first + n - 1 : -1);
            after.push_back(k + 1 < n ? first + k + 1 : closed ? first : -1);
            if (after.back() >= 0) lines.push_back({first + k, after.back()});
        }
        first += n;
    }
}

Curves::Curves(std::vector<Vec3f> points, const std::vector<std::size_t>& counts, bool closed,
               std::map<std::string, Mesh::VertexValues> values, std::string name)
{
    if (counts.empty()) throw Error("there are no points; a curve needs at least two");
    for (std::size_t k = 0; k < counts.size(); ++k)
        if (counts[k] < 2)
            throw Error(fmt::format("{} {} {}; a curve needs at least two",
                                    counts.size() == 1 ? std::string("it has") : fmt::format("curve {} has", k),
                                    counts[k], counts[k] == 1 ? "point" : "points"));
    auto lines = std::make_shared<CurveLines>(counts, closed);
    auto mesh = std::make_shared<DetailedMesh>();
    check_curves(points, *lines);
    mesh->positions = std::move(points);
    for (const CurveLines::Line& line : lines->lines) mesh->triangles.push_back({line.a, line.b, line.b});
    mesh->values = std::move(values);
    mesh->name = std::move(name);
    if (!mesh->values.count("u")) mesh->corner_values["u"] = parts_of_length(*mesh, *lines);
    lines_ = std::move(lines);
    mesh_ = std::move(mesh);
}

Curves::Curves(const Curves& other, std::vector<Vec3f> points) : lines_(other.lines_)
{
    auto mesh = std::make_shared<DetailedMesh>(*detailed(other.mesh_));
    check_curves(points, *lines_);
    mesh->positions = std::move(points);
    mesh_ = std::move(mesh);
}

ScatterPtr Curves::scatter() const { return std::make_shared<ScatterOnLines>(mesh_); }

CurvesPtr transformed(const CurvesPtr& curves, const Eigen::Affine3d& map)
{
    std::vector<Vec3f> points;
    points.reserve(curves->points().size());
    for (const Vec3f& P : curves->points()) points.push_back((map * P.cast<double>()).cast<float>());
    return std::make_shared<Curves>(*curves, std::move(points));
}

FrameRange MovingCurves::range() const
{
    FrameRange range = motion_->range();
    if (frames_) range.extend(frames_->range());
    return range;
}

bool MovingCurves::has(double from, double to) const
{
    return !frames_ || (frames_->has(static_cast<std::int64_t>(std::floor(from))) &&
                        frames_->has(static_cast<std::int64_t>(std::ceil(to))));
}

MovingCurvesPtr MovingCurves::transformed(const MotionPtr& motion) const
{
    return std::make_shared<MovingCurves>(rest_, frames_, product(motion, motion_));
}

CurvesPtr MovingCurves::at(const FrameClock& clock, std::int64_t step) const
{
    const CurvesPtr curves = frames_ ? frames_->at(clock, step) : rest_;
    const Pose pose = motion_->at(clock.at_step(step));
    if (pose.translation.isZero(0) && pose.rotation.vec().isZero(0) && pose.scale == 1) return curves;
    return rapid::transformed(curves, pose.affine());
}

FramePath path_of(const MovingCurves& curves, const FrameClock& clock, std::int64_t step, const PathOptions& options)
{
    const Box3d rest = curves.rest()->mesh()->bounds().cast<double>();
    if (!curves.deforms()) return path_of(*curves.motion(), rest, clock, step, options);
    FrameRange range = curves.range();
    range.first = std::max(range.first, static_cast<double>(clock.start));
    const auto travel = [&](std::int64_t i) {
        const CurvesPtr a = curves.at(clock, i - 1), b = curves.at(clock, i);
        double sum = 0;
        for (std::size_t k = 0; k < a->points().size(); ++k)
            sum += (b->points()[k].cast<double>() - a->points()[k].cast<double>()).squaredNorm();
        return std::sqrt(sum / double(a->points().size()));
    };
    return FramePath::find(step, range, options, curves.at(clock, step)->mesh()->bounds().diagonal().norm(), travel);
}

std::vector<Cubic<Vec3d>> point_curves(const MovingCurves& curves, const FrameClock& clock, std::int64_t step,
                                       const FramePath& path)
{
    const CurvesPtr now = curves.at(clock, step);
    const CurvesPtr at[] = {path.before ? curves.at(clock, step - 2) : now,
                            path.kind == FramePath::Still ? now : curves.at(clock, step - 1), now,
                            path.after ? curves.at(clock, step + 1) : now};
    const auto place = [&](int k, std::size_t i) -> Vec3d { return at[k]->points()[i].cast<double>(); };
    std::vector<Cubic<Vec3d>> cubics;
    cubics.reserve(now->points().size());
    for (std::size_t i = 0; i < now->points().size(); ++i)
        cubics.push_back(path.through<Vec3d>(place(0, i), place(1, i), place(2, i), place(3, i)));
    return cubics;
}

BodyPathPtr curves_path(const MovingCurves& curves, const FrameClock& clock, std::int64_t step, const FramePath& path)
{
    return std::make_shared<CurvesPath>(curves.at(clock, step)->mesh(), point_curves(curves, clock, step, path));
}

}  // namespace rapid
