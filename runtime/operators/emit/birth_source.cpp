#include "runtime/operators/emit/birth_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "runtime/graph/value.h"
#include "runtime/points/id_index.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/mesh/detailed_mesh.h"
#include "runtime/shapes/motion/curves.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/scatter/scatter_by_density.h"

namespace rapid {
namespace {

constexpr std::uint64_t pick_use = 17, accept_use = 18;

// Returns the vertices of a mesh with their attributes, as points.
PointSet vertices_of(const Mesh& mesh)
{
    PointSet vertices;
    vertices.append(mesh.positions.size());
    vertices.P() = Column<Vec3f>(std::span<const Vec3f>(mesh.positions));
    for (const auto& [name, values] : mesh.values)
        std::visit(
            [&, &key = name](const auto& list) {
                using T = typename std::decay_t<decltype(list)>::value_type;
                if (key != "P" && key != "v" && key != "id") vertices.set(key, Column<T>(std::span<const T>(list)));
            },
            values);
    return vertices;
}

// Returns the corners of a mesh's faces, three per face, with all attributes of vertices, corners and faces.
PointSet corners_of(const DetailedMesh& mesh)
{
    PointSet corners;
    const std::size_t faces = mesh.triangles.size();
    corners.append(3 * faces);
    const auto set = [&]<class T>(const std::string& name, const std::vector<T>&, const auto& value_of) {
        if (name == "P" || name == "v" || name == "id" || corners.has(name)) return;
        Column<T> column;
        const std::span<T> to = column.append_for_writing(3 * faces);
        for (std::size_t f = 0; f < faces; ++f)
            for (std::size_t k = 0; k < 3; ++k) to[3 * f + k] = value_of(f, k);
        corners.set(name, std::move(column));
    };
    const auto vertex = [&](std::size_t f, std::size_t k) {
        return static_cast<std::size_t>(mesh.triangles[f][static_cast<int>(k)]);
    };
    const auto each = [&](const std::map<std::string, Mesh::VertexValues>& values, const auto& place) {
        for (const auto& [name, any] : values)
            std::visit(
                [&, &key = name](const auto& list) {
                    set(key, list, [&](std::size_t f, std::size_t k) { return list[place(f, k)]; });
                },
                any);
    };
    each(mesh.values, vertex);
    each(mesh.corner_values, [](std::size_t f, std::size_t k) { return 3 * f + k; });
    each(mesh.face_values, [](std::size_t f, std::size_t) { return f; });
    return corners;
}

// Returns area-weighted vertex normals, not normalised.
Column<Vec3f> vertex_normals(const Mesh& mesh)
{
    std::vector<Vec3f> sum(mesh.positions.size(), Vec3f::Zero());
    for (const Mesh::Triangle& triangle : mesh.triangles) {
        const auto corner = [&](int i) { return static_cast<std::size_t>(triangle[i]); };
        const Vec3f& a = mesh.positions[corner(0)];
        const Vec3f twice_area = (mesh.positions[corner(1)] - a).cross(mesh.positions[corner(2)] - a);
        for (int i = 0; i < 3; ++i) sum[corner(i)] += twice_area;
    }
    return Column<Vec3f>(std::span<const Vec3f>(sum));
}

Vec3f direction(const Vec3f& normal)
{
    const double length = normal.cast<double>().norm();
    return length > 0 ? Vec3f((normal.cast<double>() / length).cast<float>()) : Vec3f(Vec3f::Zero());
}

class PointCurves final : public BodyPath {
public:
    explicit PointCurves(std::vector<Cubic<Vec3d>> curves) : curves_(std::move(curves)) {}

    void carry(std::span<const double> t, bool, std::span<Birthplace> births, std::span<Vec3d> velocity) const override
    {
        for (std::size_t i = 0; i < births.size(); ++i) {
            const Cubic<Vec3d>& curve = curves_[static_cast<std::size_t>(births[i].element)];
            births[i].P = curve.at(t[i]).cast<float>();
            velocity[i] = curve.derivative(t[i]);
        }
    }

private:
    std::vector<Cubic<Vec3d>> curves_;  // by point
};

// v counts as the rate of change if the error of the paths it predicts is below this fraction of the actual paths.
constexpr double max_off = 0.5;

bool is_rate_of_change(const PointSet& now, const PointSet& before, std::span<const std::uint32_t> place, double dt)
{
    double off = 0, distance2 = 0;
    for (std::size_t i = 0; i < place.size(); ++i) {
        if (place[i] == IdIndex::none) continue;
        const Vec3d d = now.P()[i].cast<double>() - before.P()[place[i]].cast<double>();
        const Vec3d mean = 0.5 * (now.v()[i].cast<double>() + before.v()[place[i]].cast<double>());
        off += (d - dt * mean).squaredNorm();
        distance2 += d.squaredNorm();
    }
    return distance2 > 0 && off <= max_off * max_off * distance2;
}

// The curves along which the points of a source travel in one step, if the source is another set at each step: a
// function of the frame, such as one that reads a sequence of files. Points are matched by id.
//
// If the attribute v is the rate at which positions change, the curve is the cubic Hermite spline of both, which is
// the path to third order. Otherwise its tangents are differences: of second order from the third step on, straight
// before. A new point is traced back along its v, or is at rest.
struct PointPath {
    BodyPathPtr path;           // births are given on the points of `now`, by element
    std::size_t unmatched = 0;  // points of `now` that were not there before
    bool follows_v = false;     // v is the rate of change of positions: path provides it instead of the attribute
};

// now, before: the source at the end and the beginning of a step of `dt` seconds; earlier: one step before that, or
// null.
PointPath point_path(const PointSet& now, const PointSet& before, const PointSet* earlier, bool straight, double dt)
{
    PointPath result;
    const IdIndex index(before.id());
    const std::optional<IdIndex> index_earlier =
        earlier ? std::optional<IdIndex>(std::in_place, earlier->id()) : std::nullopt;
    std::vector<std::uint32_t> place(now.size());
    for (std::size_t i = 0; i < place.size(); ++i) {
        place[i] = index[now.id()[i]];
        result.unmatched += place[i] == IdIndex::none;
    }
    result.follows_v = is_rate_of_change(now, before, place, dt);

    std::vector<Cubic<Vec3d>> curves(now.size());
    const Vec3d none = Vec3d::Zero();
    for (std::size_t i = 0; i < curves.size(); ++i) {
        const Vec3d P = now.P()[i].cast<double>(), m = dt * now.v()[i].cast<double>();
        if (place[i] == IdIndex::none) {
            const bool goes = result.follows_v || result.unmatched == now.size();
            curves[i] = goes ? Cubic<Vec3d>{P - m, m, none, none} : Cubic<Vec3d>{P, none, none, none};
            continue;
        }
        const Vec3d P0 = before.P()[place[i]].cast<double>(), d = P - P0;
        Vec3d m0 = d, m1 = d;
        const std::uint32_t third = index_earlier ? (*index_earlier)[now.id()[i]] : IdIndex::none;
        if (straight) {
        } else if (result.follows_v) {
            m0 = dt * before.v()[place[i]].cast<double>();
            m1 = m;
        } else if (third != IdIndex::none) {
            const Vec3d d0 = P0 - earlier->P()[third].cast<double>();
            m0 = 0.5 * (d0 + d);
            m1 = 0.5 * (3 * d - d0);
        }
        curves[i] = {P0, m0, 3 * d - 2 * m0 - m1, m0 + m1 - 2 * d};
    }
    result.path = std::make_shared<PointCurves>(std::move(curves));
    return result;
}

}  // namespace

BirthSource::BirthSource(ObjectPtr object, std::string from, std::string density, std::string group)
    : object_(std::move(object)), from_(std::move(from)), density_(std::move(density)), group_(std::move(group))
{
    const auto points = std::dynamic_pointer_cast<const PointsObject>(object_);
    moving_points_ = std::dynamic_pointer_cast<const AnimatedPoints>(object_);
    const bool is_mesh =
        std::dynamic_pointer_cast<const Mesh>(object_) || std::dynamic_pointer_cast<const AnimatedMesh>(object_);
    if (!group_.empty() && !(is_mesh && (from_.empty() || from_ == "surface")))
        throw Error(fmt::format("source_group = \"{}\" needs a mesh and from = \"surface\"; remove it", group_));
    if (points || moving_points_) {
        if (!from_.empty() && from_ != "points")
            throw Error(fmt::format("from = \"{}\" needs a mesh or a shape; for points give \"points\"", from_));
        take_points(points ? points->points : moving_points_->rest());
    } else if ((moving_mesh_ = std::dynamic_pointer_cast<const AnimatedMesh>(object_))) {
        take_mesh(moving_mesh_->rest());
    } else if (const auto mesh = std::dynamic_pointer_cast<const Mesh>(object_)) {
        take_mesh(mesh);
    } else if ((moving_shape_ = std::dynamic_pointer_cast<const AnimatedShape>(object_))) {
        take_shape(moving_shape_->rest());
    } else if (const auto shape = std::dynamic_pointer_cast<const Shape>(object_)) {
        take_shape(shape);
    } else if (const auto fog = std::dynamic_pointer_cast<const DensityGrid>(object_)) {
        take_fog(*fog);
    } else if ((moving_curves_ = std::dynamic_pointer_cast<const MovingCurves>(object_))) {
        take_curves(*moving_curves_->rest());
    } else if (const auto curves = std::dynamic_pointer_cast<const Curves>(object_)) {
        take_curves(*curves);
    } else if (std::dynamic_pointer_cast<const DeformingLevelSet>(object_)) {
        throw Error("source = a deforming level set can't emit points; give the mesh that it was made from");
    } else {
        throw Error(
            fmt::format("source = {} can't emit points; it must be a mesh, a level set, a shape, a fog, a curve, "
                        "points or a position",
                        describe(object_)));
    }
}

void BirthSource::take_fog(const DensityGrid& fog)
{
    if (!from_.empty() && from_ != "volume")
        throw Error(fmt::format("from = \"{}\" needs a mesh or a shape; for a fog give \"volume\"", from_));
    if (!density_.empty())
        throw Error(fmt::format(
            "density = \"{}\" must be an attribute of points or of a mesh's vertices; a fog uses its own density",
            density_));
    scatter_ = fog.scatter();
}

void BirthSource::take_curves(const Curves& curves)
{
    if (!from_.empty()) throw Error(fmt::format("from = \"{}\" needs a mesh or a shape; remove it for a curve", from_));
    if (!density_.empty())
        throw Error(fmt::format(
            "density = \"{}\" must be an attribute of points or of a mesh's vertices; a curve emits evenly by length",
            density_));
    has_normals_ = true;
    mesh_ = curves.mesh();
    values_ = corners_of(*detailed(mesh_));
    is_of_corners_ = true;
    scatter_ = curves.scatter();
}

void BirthSource::take_shape(const ShapePtr& shape)
{
    if (from_ == "points")
        throw Error(
            fmt::format("from = \"points\" needs points or a mesh, but source is {}; give \"surface\" or \"volume\"",
                        describe(object_)));
    if (!density_.empty())
        throw Error(
            fmt::format("density = \"{}\" must be an attribute of points or of a mesh's vertices, and {} has none",
                        density_, describe(object_)));
    has_normals_ = from_ != "volume";
    scatter_ = from_ == "volume" ? scatter_in_volume(shape) : scatter_on_surface(shape);
}

FramePath BirthSource::path_at(const FrameClock& clock, std::int64_t step, const PathOptions& options) const
{
    if (moving_points_) {
        Box3d bounds;
        for (std::size_t i = 0; i < values_.size(); ++i) bounds.extend(values_.P()[i].cast<double>());
        return path_of(*moving_points_->motion(), bounds, clock, step, options);
    }
    if (moving_curves_) return path_of(*moving_curves_, clock, step, options);
    return moving_mesh_ ? path_of(*moving_mesh_, clock, step, options) : path_of(*moving_shape_, clock, step, options);
}

void BirthSource::follow(const BirthSource& last)
{
    const auto is_curve = [](const BirthSource& source) {
        return std::dynamic_pointer_cast<const Curves>(source.object_) != nullptr;
    };
    if (is_curve(*this) && is_curve(last))
        throw Error(
            "source: a function of the frame that returns a new curve each time can't be followed between frames; give "
            "the function to rapid.curve.from: source = rapid.curve.from { points = function(frame) ... end }");
    if (!is_of_points_ || !last.is_of_points_ || moving_points_) return;
    before_ = last.values_;
    earlier_ = last.before_;
    is_fresh_ = true;
}

// A set that stays the same is at rest, wherever it was before.
BirthSource::Move BirthSource::move_points_to(const FrameClock& clock, std::int64_t step, const PathOptions& options)
{
    path_ = nullptr;
    path_is_of_v_ = false;
    const bool is_another = std::exchange(is_fresh_, false);
    const std::int64_t frame = clock.start + (step - clock.start + clock.subframes - 1) / clock.subframes;
    const bool jumps = options.cuts && options.cuts->count(frame) && clock.is_whole(step);
    if (jumps || step <= clock.start) {
        before_.reset();
    } else if (!is_another) {
        before_ = values_;
    } else if (before_ && !values_.empty() && options.kind != PathOptions::None) {
        const PointPath found = point_path(values_, *before_, earlier_ ? &*earlier_ : nullptr,
                                           options.kind == PathOptions::Linear, 1 / clock.steps_per_second());
        path_ = found.path;
        path_is_of_v_ = found.follows_v;
        return {std::nullopt, false, found.unmatched};
    }
    return {};
}

BirthSource::Move BirthSource::move_to(const FrameClock& simulation, std::int64_t step, const PathOptions& options)
{
    is_absent_ = false;
    if (is_of_points_ && !moving_points_) return move_points_to(simulation, step, options);
    if (!moving_mesh_ && !moving_shape_ && !moving_points_ && !moving_curves_) return {};
    if (moving_points_ && values_.empty()) return {};
    const bool deforms = (moving_mesh_ && moving_mesh_->deforms()) || (moving_curves_ && moving_curves_->deforms());
    if (deforms) {
        const double to = simulation.at_step(step).number;
        const double from = step > simulation.start ? simulation.at_step(step - 1).number : to;
        is_absent_ = !(moving_mesh_ ? moving_mesh_->has(from, to) : moving_curves_->has(from, to));
        if (is_absent_) return path_ = nullptr, Move();
    }
    FrameClock clock = simulation;
    if (deforms) clock.subframes = 1;
    // At the start there is no interval yet: births take place at the beginning of the next one, unless it is a jump.
    bool at_beginning = step <= clock.start;
    const std::int64_t last = at_beginning ? step + 1 : step, parts = deforms ? simulation.subframes : 1;
    std::int64_t end = clock.start + (last - clock.start + parts - 1) / parts;
    FramePath path = path_at(clock, end, options);
    if (at_beginning && (path.kind == FramePath::Still || path.kind == FramePath::AfterCut)) {
        at_beginning = false;
        end = step;
        path = FramePath();
    }
    if (moving_curves_) {
        take_curves(*moving_curves_->at(clock, end));
        path_ = curves_path(*moving_curves_, clock, end, path);
    } else if (!deforms) {
        const Motion& motion = *(moving_mesh_    ? moving_mesh_->motion()
                                 : moving_shape_ ? moving_shape_->motion()
                                                 : moving_points_->motion());
        path_ = rigid_path(motion, clock, end, path);
    } else {
        const BirthDomain on = from_ == "volume"   ? BirthDomain::Volume
                               : from_ == "points" ? BirthDomain::Vertices
                                                   : BirthDomain::Faces;
        path_ = deforming_path(*moving_mesh_, clock, end, path, on);
        largest_areas_ = path_->largest_areas();
        take_mesh(moving_mesh_->at(clock, end));
    }
    if (parts > 1) {
        const double length = 1.0 / static_cast<double>(parts);
        path_ = part_of(path_, static_cast<double>((last - 1 - clock.start) % parts) * length, length);
    }
    return {at_beginning ? std::nullopt : path.jump, at_beginning};
}

void BirthSource::take_mesh(const MeshPtr& mesh)
{
    has_normals_ = from_ != "volume";
    if (from_ == "volume") {
        if (!density_.empty())
            throw Error(
                fmt::format("density = \"{}\" is an attribute of vertices, which a volume does not have; give from = "
                            "\"surface\" or \"points\"",
                            density_));
        scatter_ = scatter_in_volume(mesh);
        return;
    }
    const DetailedMeshPtr details = detailed(mesh);
    is_of_corners_ = from_ != "points" && details && (!details->corner_values.empty() || !details->face_values.empty());
    values_ = is_of_corners_ ? corners_of(*details) : vertices_of(*mesh);
    if (from_ == "points") {
        normals_ = vertex_normals(*mesh);
        take_chances();
        return;
    }
    mesh_ = mesh;
    scatter_ = scatter_on(mesh);
}

// Scatters by the density at the corners of faces, with 0 on faces outside the group.
ScatterPtr BirthSource::scatter_on(const MeshPtr& mesh) const
{
    if (density_.empty() && group_.empty()) return scatter_on_surface(mesh, largest_areas_);
    const std::vector<float> values = density_.empty() ? std::vector<float>() : densities();
    const std::vector<std::uint8_t>* members = nullptr;
    if (!group_.empty()) {
        static const std::map<std::string, std::vector<std::uint8_t>> none;
        const DetailedMeshPtr details = detailed(mesh);
        const auto& groups = details ? details->face_groups : none;
        const auto found = groups.find(group_);
        if (found == groups.end()) {
            std::vector<std::string> names;
            for (const auto& [name, faces] : groups) names.push_back(name);
            const std::string near = did_you_mean(group_, names);
            throw Error(fmt::format("source_group: the mesh \"{}\" has no group of faces \"{}\"{}", mesh->name, group_,
                                    !near.empty()   ? near
                                    : names.empty() ? std::string("; it has none")
                                                    : fmt::format("; it has {}", fmt::join(names, ", "))));
        }
        members = &found->second;
    }
    std::vector<float> corners;
    corners.reserve(3 * mesh->triangles.size());
    for (std::size_t f = 0; f < mesh->triangles.size(); ++f)
        for (int k = 0; k < 3; ++k) {
            const std::size_t place = is_of_corners_ ? corners.size() : static_cast<std::size_t>(mesh->triangles[f][k]);
            const float density = values.empty() ? 1 : values[place];
            corners.push_back(members && !(*members)[f] ? 0 : density);
        }
    return scatter_by_density(mesh, corners, largest_areas_);
}

std::vector<float> BirthSource::densities() const
{
    const Column<float>* column = std::as_const(values_).find<float>(density_);
    if (!column) {
        std::vector<std::string> floats;
        for (const auto& [name, any] : values_.columns())
            if (type_of(any) == AttributeType::Float) floats.push_back(name);
        throw Error(fmt::format("density = \"{}\": the source has no float with this name{}", density_,
                                floats.empty() ? "; it has none" : did_you_mean(density_, floats)));
    }
    std::vector<float> densities(values_.size());
    for (std::size_t i = 0; i < densities.size(); ++i) {
        densities[i] = (*column)[i];
        if (!(densities[i] >= 0 && std::isfinite(densities[i])))
            throw Error(fmt::format("{} is {} at point {} of the source; a density must be finite and at least 0",
                                    density_, densities[i], i));
    }
    return densities;
}

void BirthSource::take_chances()
{
    chances_ = AliasTable();
    if (density_.empty() || values_.empty()) return;
    const std::vector<float> values = densities();
    const std::vector<double> weights(values.begin(), values.end());
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    if (!(sum > 0))
        throw Error(fmt::format("{} is 0 at all points of the source; it must be above 0 somewhere", density_));
    chances_ = AliasTable(weights, sum);
}

void BirthSource::take_points(PointSet points)
{
    values_ = std::move(points);
    is_of_points_ = true;
    if (const Column<Vec3f>* normals = std::as_const(values_).find<Vec3f>("N")) {
        normals_ = *normals;
        has_normals_ = true;
    }
    take_chances();
}

std::vector<std::string> BirthSource::inherited() const
{
    std::vector<std::string> names;
    for (const std::string& name : values_.column_names()) {
        const auto own = {"P", "v", "id", "dt", "age", "life", "birthtime", "force"};
        // The normals of a rotating mesh belong to the mesh at rest.
        const bool turns = name == "N" && moving_mesh_ && !moving_mesh_->deforms();
        if (!turns && std::find(own.begin(), own.end(), name) == own.end() && name.rfind("hit", 0) != 0)
            names.push_back(name);
    }
    return names;
}

void BirthSource::place(RandomKey key, const Items& births, bool in_order, std::span<Birthplace> out) const
{
    if (scatter_) {
        // Places runs of consecutive births together.
        for (std::size_t begin = 0, end = 1; begin < out.size(); begin = end++) {
            while (end < out.size() && births[end] == births[begin] + (end - begin)) ++end;
            scatter_->place(key, births[begin], out.subspan(begin, end - begin));
        }
        return;
    }

    const std::uint64_t n = values_.size();
    const Strided<Vec3f> P = values_.P().read(), N = normals_.read();
    const bool draws = !chances_.empty() || !in_order;
    std::array<std::array<double, 4>, 64> numbers;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const std::size_t k = i % numbers.size();
        if (draws && k == 0)
            uniform4(key, births.from(i), pick_use, std::span(numbers).first(std::min(numbers.size(), out.size() - i)));
        const auto& u = numbers[k];
        std::uint64_t point = births[i] % n;
        if (!chances_.empty()) {
            point = static_cast<std::uint64_t>(chances_.draw(u[0], u[1]));
        } else if (!in_order) {
            point = std::min(n - 1, static_cast<std::uint64_t>((u[0] + u[1] * 0x1p-32) * static_cast<double>(n)));
        }
        out[i] = {P[point], has_normals_ ? direction(N[point]) : Vec3f(Vec3f::Zero()),
                  static_cast<std::int32_t>(point)};
    }
}

// Rejection sampling: birthplaces are drawn in proportion to each face's largest area, and accepted with the
// probability area(t) / largest area.
void BirthSource::redraw(RandomKey key, const Items& births, std::span<Birthplace> out,
                         const std::function<double(std::size_t)>& time) const
{
    constexpr std::uint64_t max_trials = 256;  // the last one stays: at this time the mesh has next to no area
    for (std::size_t i = 0; i < out.size(); ++i)
        for (std::uint64_t trial = 0; trial < max_trials; ++trial) {
            const double largest = largest_areas_[static_cast<std::size_t>(out[i].element)];
            const double u = uniform4(key, births[i], accept_use | trial << 32)[0];
            if (u * largest < path_->area(out[i].element, time(i))) break;
            RandomKey next = key;
            next.value += trial + 1;
            scatter_->place(next, births[i], out.subspan(i, 1));
        }
}

}  // namespace rapid
