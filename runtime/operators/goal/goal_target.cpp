#include "runtime/operators/goal/goal_target.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/parallel.h"
#include "runtime/points/id_index.h"
#include "runtime/shapes/mesh/nearest_on_triangle.h"
#include "runtime/shapes/motion/mesh_surface.h"

namespace rapid {
namespace {

constexpr std::uint64_t shuffle_use = 25;  // the scatter uses those of positions on surfaces

std::uint64_t number_of(std::int64_t id) { return static_cast<std::uint64_t>(id); }

template <class T>
std::shared_ptr<const T> as(const ObjectPtr& object)
{
    return std::dynamic_pointer_cast<const T>(object);
}

}  // namespace

bool GoalTarget::is_points() const { return as<PointsObject>(object) || as<AnimatedPoints>(object); }

void read_value(const Param& param, const Value& value, GoalTarget& target)
{
    target = {};
    if (const AttributeRef* attribute = value.get<AttributeRef>()) {
        target.attribute = attribute->name;
        return;
    }
    const ObjectPtr* object = value.get<ObjectPtr>();
    if (!object || !*object) wrong_type(param, value);
    target.object = *object;
    const bool known = target.is_points() || as<Mesh>(*object) || as<AnimatedMesh>(*object) || as<Shape>(*object) ||
                       as<AnimatedShape>(*object);
    if (!known)
        throw Error(fmt::format("{} = {} can't be a target; it must be a mesh, a shape, points or rapid.attr",
                                param.name, describe(*object)));
}

class GoalPositions::Kind {
public:
    virtual ~Kind() = default;
    virtual void find(PointSet& points, Strided<std::uint8_t> members, const FrameClock& clock, const Evaluation& now,
                      std::span<Vec3f> positions) = 0;

protected:
    // Sets positions[i] to position_of(i) for each member.
    template <class F>
    static void for_each_member(Strided<std::uint8_t> members, std::span<Vec3f> positions, const F& position_of)
    {
        for_each_chunk(positions.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                if (members[i]) positions[i] = position_of(i);
        });
    }
};

// A target position is a point: the one with the same id, or by order of ids, cyclically.
class GoalPositions::OfPoints : public Kind {
public:
    OfPoints(const PointSet& points, MotionPtr motion, std::string by)
        : of_(points), motion_(std::move(motion)), by_(std::move(by))
    {
        if (of_.empty()) throw Error("to: there are no points to go to");
        for (std::size_t k = 0; k < of_.size(); ++k)
            if (const Vec3f& P = std::as_const(of_).P()[k]; !P.allFinite())
                throw Error(fmt::format("to: point {} is at {}; it must be finite", k + 1,
                                        describe(Value(Vec3d(P.cast<double>())))));
    }

    void find(PointSet& points, Strided<std::uint8_t> members, const FrameClock&, const Evaluation& now,
              std::span<Vec3f> positions) override
    {
        const Eigen::Affine3d pose = motion_ ? motion_->at(now.frame).affine() : Eigen::Affine3d::Identity();
        const auto at = [&](std::uint32_t k) -> Vec3d { return pose * std::as_const(of_).P()[k].cast<double>(); };
        const auto n = static_cast<std::uint32_t>(of_.size());
        if (by_ == "nearest") {
            take_nearest(points, members, at);
            const Strided<std::int64_t> numbers = std::as_const(points).column<std::int64_t>(goal_number).read();
            return for_each_member(members, positions, [&](std::size_t i) -> Vec3f {
                return at(static_cast<std::uint32_t>(numbers[i])).cast<float>();
            });
        }
        const Strided<std::int64_t> id = std::as_const(points).id().read();
        const std::vector<std::uint32_t> order = by_ == "random" ? shuffled(now.random) : std::vector<std::uint32_t>();
        const IdIndex index(std::as_const(of_).id());
        for_each_member(members, positions, [&](std::size_t i) -> Vec3f {
            const auto k = static_cast<std::uint32_t>(number_of(id[i]) % n);
            if (!order.empty()) return at(order[k]).cast<float>();
            const std::uint32_t same = index[id[i]];
            return at(same == IdIndex::none ? k : same).cast<float>();
        });
    }

private:
    std::vector<std::uint32_t> shuffled(RandomKey key) const
    {
        const auto n = static_cast<std::uint32_t>(of_.size());
        std::vector<std::pair<double, std::uint32_t>> draws;
        for (std::uint32_t k = 0; k < n; ++k) draws.emplace_back(uniform4(key, k, shuffle_use)[0], k);
        std::sort(draws.begin(), draws.end());
        std::vector<std::uint32_t> order;
        for (const auto& [draw, k] : draws) order.push_back(k);
        return order;
    }

    // Assigns positions to points that have none yet, by id.
    template <class At>
    void take_nearest(PointSet& points, Strided<std::uint8_t> members, const At& at) const
    {
        const Strided<std::int64_t> id = std::as_const(points).id().read();
        const Strided<Vec3f> P = std::as_const(points).P().read();
        const auto n = static_cast<std::int64_t>(of_.size());
        const Strided<std::int64_t> known = std::as_const(points).column<std::int64_t>(goal_number).read();
        std::vector<std::uint32_t> occupancy(of_.size()), open;
        for (std::uint32_t i = 0; i < points.size(); ++i) {
            if (!members[i]) continue;
            if (known[i] >= 0 && known[i] < n)
                ++occupancy[static_cast<std::size_t>(known[i])];
            else
                open.push_back(i);
        }
        if (open.empty()) return;
        std::sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) { return id[a] < id[b]; });
        std::vector<Vec3d> positions;
        for (std::uint32_t k = 0; k < of_.size(); ++k) positions.push_back(at(k));
        FreePositions free(std::move(positions), std::move(occupancy));
        const std::span<std::int64_t> numbers = points.column<std::int64_t>(goal_number).write();
        for (const std::uint32_t i : open) numbers[i] = free.take(P[i].cast<double>());
    }

    const PointSet of_;
    const MotionPtr motion_;
    const std::string by_;
};

// By id, a target position is a vertex; at random, a position on the surface that each point gets from its id for all
// times.
class GoalPositions::OfMesh : public Kind {
public:
    OfMesh(MeshPtr rest, std::shared_ptr<const AnimatedMesh> moving, std::string by)
        : rest_(std::move(rest)), moving_(std::move(moving)), by_(std::move(by))
    {
        if (rest_->positions.empty() || rest_->triangles.empty())
            throw Error(fmt::format("to: the mesh \"{}\" has no faces to go to", rest_->name));
        if (by_ == "random") scatter_ = scatter_on_surface(rest_);
    }

    void find(PointSet& points, Strided<std::uint8_t> members, const FrameClock& clock, const Evaluation& now,
              std::span<Vec3f> positions) override
    {
        const MeshPtr mesh = mesh_at(clock, now.frame);
        const Strided<std::int64_t> id = std::as_const(points).id().read();
        if (by_ == "id")
            return for_each_member(members, positions, [&](std::size_t i) -> Vec3f {
                return mesh->positions[static_cast<std::size_t>(number_of(id[i]) % mesh->positions.size())];
            });
        if (by_ == "random")
            return for_each_member(members, positions, [&](std::size_t i) -> Vec3f {
                Birthplace place;
                scatter_->place(now.random, number_of(id[i]), {&place, 1});
                return on_face(*mesh, place.element, place.b1, place.b2);
            });
        const MovingBodyPtr surface = mesh_surface(mesh);
        const Strided<Vec3f> P = std::as_const(points).P().read();
        for_each_member(members, positions, [&](std::size_t i) -> Vec3f {
            const Vec3d from = P[i].cast<double>();
            const std::int32_t face = surface->material_at(from, 0).face;
            const auto corner = [&](int k) -> Vec3d { return corner_of(*mesh, face, k).cast<double>(); };
            const auto [b1, b2] = nearest_weights(from, corner(0), corner(1), corner(2));
            return on_face(*mesh, face, static_cast<float>(b1), static_cast<float>(b2));
        });
    }

private:
    // Rigid meshes move as a whole, also at subframes; a sequence uses the mesh of the frame.
    MeshPtr mesh_at(const FrameClock& clock, const Frame& frame) const
    {
        if (!moving_) return rest_;
        if (moving_->deforms()) return moving_->at(clock, static_cast<std::int64_t>(std::ceil(frame.number)));
        auto placed = std::make_shared<Mesh>(*rest_);
        const Eigen::Affine3d pose = moving_->motion()->at(frame).affine();
        for (Vec3f& P : placed->positions) P = (pose * P.cast<double>()).cast<float>();
        return placed;
    }

    static Vec3f corner_of(const Mesh& mesh, std::int32_t face, int k)
    {
        return mesh.positions[static_cast<std::size_t>(mesh.triangles[static_cast<std::size_t>(face)][k])];
    }
    static Vec3f on_face(const Mesh& mesh, std::int32_t face, float b1, float b2)
    {
        const Vec3d a = corner_of(mesh, face, 0).cast<double>(), b = corner_of(mesh, face, 1).cast<double>(),
                    c = corner_of(mesh, face, 2).cast<double>();
        return (a + double{b1} * (b - a) + double{b2} * (c - a)).cast<float>();
    }

    const MeshPtr rest_;
    const std::shared_ptr<const AnimatedMesh> moving_;  // null: at rest
    const std::string by_;
    ScatterPtr scatter_;
};

class GoalPositions::OfShape : public Kind {
public:
    OfShape(ShapePtr shape, MotionPtr motion, const std::string& by)
        : shape_(std::move(shape)), motion_(std::move(motion))
    {
        if (by == "id")
            throw Error(fmt::format("by = \"id\": {} has no points; give \"random\" or \"nearest\"",
                                    describe(ObjectPtr(shape_))));
        if (by == "random") scatter_ = scatter_on_surface(shape_);
    }

    void find(PointSet& points, Strided<std::uint8_t> members, const FrameClock&, const Evaluation& now,
              std::span<Vec3f> positions) override
    {
        const Eigen::Affine3d pose = motion_ ? motion_->at(now.frame).affine() : Eigen::Affine3d::Identity();
        const Eigen::Affine3d to_rest = pose.inverse();
        const Strided<std::int64_t> id = std::as_const(points).id().read();
        const Strided<Vec3f> P = std::as_const(points).P().read();
        if (scatter_)
            return for_each_member(members, positions, [&](std::size_t i) -> Vec3f {
                Birthplace place;
                scatter_->place(now.random, number_of(id[i]), {&place, 1});
                return (pose * place.P.cast<double>()).cast<float>();
            });
        for_each_chunk(positions.size(), [&](std::size_t begin, std::size_t end) {
            std::vector<std::size_t> which;
            std::vector<Vec3d> at;
            for (std::size_t i = begin; i < end; ++i) {
                if (!members[i]) continue;
                which.push_back(i);
                at.push_back(to_rest * P[i].cast<double>());
            }
            go_to_surface(at);
            for (std::size_t k = 0; k < at.size(); ++k) positions[which[k]] = (pose * at[k]).cast<float>();
        });
    }

private:
    // Moves P to P - φ ∇φ / |∇φ|², which is on the surface if φ is a distance; P stays if there is no gradient, beyond
    // the band of a level set.
    void go_to_surface(std::span<Vec3d> P) const
    {
        std::vector<double> phi(P.size());
        std::vector<Vec3d> gradient(P.size(), Vec3d::Zero());
        shape_->distance(P, phi, gradient);
        for (std::size_t k = 0; k < P.size(); ++k)
            if (const double slope2 = gradient[k].squaredNorm(); slope2 > 0) P[k] -= phi[k] / slope2 * gradient[k];
    }

    const ShapePtr shape_;
    const MotionPtr motion_;
    ScatterPtr scatter_;
};

GoalPositions::GoalPositions(const GoalTarget& target, const std::string& by)
{
    if (const auto points = as<PointsObject>(target.object))
        kind_ = std::make_unique<OfPoints>(points->points, nullptr, by);
    else if (const auto moving_points = as<AnimatedPoints>(target.object))
        kind_ = std::make_unique<OfPoints>(moving_points->rest(), moving_points->motion(), by);
    else if (const auto mesh = as<Mesh>(target.object))
        kind_ = std::make_unique<OfMesh>(mesh, nullptr, by);
    else if (const auto moving_mesh = as<AnimatedMesh>(target.object))
        kind_ = std::make_unique<OfMesh>(moving_mesh->rest(), moving_mesh, by);
    else if (const auto shape = as<Shape>(target.object))
        kind_ = std::make_unique<OfShape>(shape, nullptr, by);
    else
        kind_ = std::make_unique<OfShape>(as<AnimatedShape>(target.object)->rest(),
                                          as<AnimatedShape>(target.object)->motion(), by);
}

GoalPositions::~GoalPositions() = default;
GoalPositions::GoalPositions(GoalPositions&&) noexcept = default;
GoalPositions& GoalPositions::operator=(GoalPositions&&) noexcept = default;

void GoalPositions::find(PointSet& points, Strided<std::uint8_t> members, const FrameClock& clock,
                         const Evaluation& now, std::span<Vec3f> positions)
{
    kind_->find(points, members, clock, now, positions);
}

FreePositions::FreePositions(std::vector<Vec3d> positions, std::vector<std::uint32_t> occupancy)
    : positions_(std::move(positions)),
      occupancy_(std::move(occupancy)),
      order_(positions_.size()),
      axis_(positions_.size()),
      free_(positions_.size())
{
    RAPID_ASSERT(!positions_.empty() && positions_.size() == occupancy_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    build(0, order_.size());
    round_ = *std::min_element(occupancy_.begin(), occupancy_.end());
    count_free(0, order_.size());
}

void FreePositions::build(std::size_t begin, std::size_t end)
{
    if (begin == end) return;
    Eigen::AlignedBox3d box;
    for (std::size_t k = begin; k < end; ++k) box.extend(positions_[order_[k]]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = begin + (end - begin) / 2;
    const auto key = [&](std::uint32_t index) { return std::pair(positions_[index][axis], index); };
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    axis_[middle] = static_cast<std::uint8_t>(axis);
    build(begin, middle);
    build(middle + 1, end);
}

std::size_t FreePositions::count_free(std::size_t begin, std::size_t end)
{
    if (begin == end) return 0;
    const std::size_t middle = begin + (end - begin) / 2;
    const std::size_t count =
        count_free(begin, middle) + count_free(middle + 1, end) + (occupancy_[order_[middle]] == round_);
    free_[middle] = static_cast<std::uint32_t>(count);
    return count;
}

void FreePositions::search(std::size_t begin, std::size_t end, const Vec3d& P, Nearest& nearest) const
{
    if (begin == end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    if (free_[middle] == 0) return;
    const Vec3d& position = positions_[order_[middle]];
    if (occupancy_[order_[middle]] == round_) {
        const double d2 = (position - P).squaredNorm();
        if (d2 < nearest.distance2 || (d2 == nearest.distance2 && order_[middle] < order_[nearest.node]))
            nearest = {d2, middle};
    }
    const double off = P[axis_[middle]] - position[axis_[middle]];
    const auto before = [&] { search(begin, middle, P, nearest); };
    const auto after = [&] { search(middle + 1, end, P, nearest); };
    off > 0 ? after() : before();
    if (off * off <= nearest.distance2) off > 0 ? before() : after();
}

std::uint32_t FreePositions::take(const Vec3d& P)
{
    if (free_[order_.size() / 2] == 0) {
        ++round_;
        count_free(0, order_.size());
    }
    Nearest nearest{std::numeric_limits<double>::infinity(), 0};
    search(0, order_.size(), P.allFinite() ? P : Vec3d(Vec3d::Zero()), nearest);
    ++occupancy_[order_[nearest.node]];
    // One less in each range that contains it.
    for (std::size_t begin = 0, end = order_.size();;) {
        const std::size_t middle = begin + (end - begin) / 2;
        --free_[middle];
        if (middle == nearest.node) return order_[middle];
        (nearest.node < middle ? end : begin) = nearest.node < middle ? middle : middle + 1;
    }
}

}  // namespace rapid
