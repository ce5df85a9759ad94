#include "runtime/shapes/motion/deforming_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/mesh/nearest_on_triangle.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/motion/moving_body.h"
#include "runtime/shapes/motion/moving_contact.h"

namespace rapid {

// The faces of a mesh that deforms during an interval, with each vertex on a cubic: the nearest point of the surface at
// any time, and its velocity.
//
// A bounding volume hierarchy. Its tree is built once per mesh, as the topology is constant, and refitted to each
// interval. A box moves linearly from the initial to the final bounds of its faces, and is widened by the deviation of
// their curves from straight lines.

// The tree of faces: a binary tree of parts of the mesh that are near each other in its rest position.
struct TriangleTree {
    explicit TriangleTree(const MeshPtr& mesh);

    // Nodes in preorder: the first child of an inner node directly follows it.
    struct Node {
        std::int32_t first, count;  // of a leaf, in `order`; count is 0 for an inner node
        std::int32_t second;        // second child of an inner node
    };
    std::vector<Node> nodes;
    std::vector<std::int32_t> order;  // triangle indices
    std::vector<Mesh::Triangle> triangles;
};

class MovingTriangles {
public:
    // curves: of the vertices, with t from 0 to 1.
    MovingTriangles(std::shared_ptr<const TriangleTree> tree, std::vector<Cubic<Vec3d>> curves);

    struct SurfacePoint {
        std::int32_t triangle = -1;
        double b1 = 0, b2 = 0;    // barycentric weights of the second and third corner
        Vec3d P = Vec3d::Zero();  // m
        double distance = 0;      // m, from the query position
    };
    // hint: a nearby triangle, if known; it shortens the search.
    SurfacePoint nearest(const Vec3d& P, double t, std::int32_t hint = -1) const;

    Vec3d at(const SurfacePoint& surface_point, double t) const;
    Vec3d velocity(const SurfacePoint& surface_point, double t) const;  // m per interval

    // Positions fixed to a triangle: (x, y, z) means p0 + x (p1 - p0) + y (p2 - p0) + z n.
    Vec3d coordinates(std::int32_t triangle, const Vec3d& P, double t) const;
    Vec3d at(std::int32_t triangle, const Vec3d& coordinates, double t) const;
    Vec3d velocity(std::int32_t triangle, const Vec3d& coordinates, double t) const;  // m per interval
    // Returns the rate at which the moving edges of a triangle change `slip`, a vector in its plane in m per unit of
    // time.
    Vec3d turning(std::int32_t triangle, const Vec3d& slip, double t) const;
    std::size_t triangles() const { return tree_->triangles.size(); }

    // Returns unit tangents and the outward normal as columns; zero if the triangle has no area.
    Eigen::Matrix3d frame(std::int32_t triangle, double t) const;

    Box3d bounds() const;                           // over the whole interval
    double fastest() const { return fastest_; }     // upper bound, m per interval
    double most_curved() const { return curved_; }  // upper bound on the second derivatives

private:
    struct Box {
        Vec3d low0, high0, low1, high1, off;

        double squared_distance(const Vec3d& P, double t) const;
    };
    std::array<Vec3d, 3> corners(std::int32_t triangle, double t) const;
    std::array<Vec3d, 3> rates(std::int32_t triangle, double t) const;
    void test(std::int32_t triangle, const Vec3d& P, double t, double& best, SurfacePoint& surface_point) const;

    std::shared_ptr<const TriangleTree> tree_;
    std::vector<Cubic<Vec3d>> curves_;
    std::vector<Box> boxes_;  // per node
    double fastest_ = 0, curved_ = 0;
};

namespace {

constexpr std::int32_t max_in_leaf = 4;

struct Ordering {
    TriangleTree& tree;
    std::vector<Vec3f> middles;

    void split(std::int32_t first, std::int32_t last)
    {
        const auto own = tree.nodes.size();
        tree.nodes.push_back({first, last - first, 0});
        if (last - first <= max_in_leaf) return;
        Box3f box;
        for (std::int32_t i = first; i < last; ++i) box.extend(middles[static_cast<std::size_t>(tree.order[i])]);
        int axis;
        box.sizes().maxCoeff(&axis);
        const std::int32_t middle = first + (last - first) / 2;
        const auto at = [&](std::int32_t i) { return tree.order.begin() + i; };
        // Ties are ordered too, so that the tree depends only on the mesh.
        std::nth_element(at(first), at(middle), at(last), [&](std::int32_t a, std::int32_t b) {
            const float x = middles[static_cast<std::size_t>(a)][axis], y = middles[static_cast<std::size_t>(b)][axis];
            return x < y || (x == y && a < b);
        });
        tree.nodes[own].count = 0;
        split(first, middle);
        tree.nodes[own].second = static_cast<std::int32_t>(tree.nodes.size());
        split(middle, last);
    }
};

}  // namespace

TriangleTree::TriangleTree(const MeshPtr& mesh) : triangles(mesh->triangles)
{
    order.resize(triangles.size());
    std::iota(order.begin(), order.end(), 0);
    Ordering ordering{*this, {}};
    for (const Mesh::Triangle& t : triangles)
        ordering.middles.push_back((mesh->positions[t[0]] + mesh->positions[t[1]] + mesh->positions[t[2]]) / 3);
    ordering.split(0, static_cast<std::int32_t>(order.size()));
}

MovingTriangles::MovingTriangles(std::shared_ptr<const TriangleTree> tree, std::vector<Cubic<Vec3d>> curves)
    : tree_(std::move(tree)), curves_(std::move(curves)), boxes_(tree_->nodes.size())
{
    std::vector<Box> of_vertex;
    of_vertex.reserve(curves_.size());
    for (const Cubic<Vec3d>& curve : curves_) {
        // A cubic minus its chord is -t(1-t) (c2 + c3 (1+t)).
        const Vec3d off = 0.25 * (curve.c2 + curve.c3).cwiseAbs().cwiseMax((curve.c2 + 2 * curve.c3).cwiseAbs());
        of_vertex.push_back({curve.c0, curve.c0, curve.at(1), curve.at(1), off});
        // The derivative lies in the convex hull of its Bézier points.
        for (const Vec3d& v : {curve.c1, Vec3d(curve.c1 + curve.c2), curve.derivative(1)})
            fastest_ = std::max(fastest_, v.norm());
        curved_ = std::max({curved_, 2 * curve.c2.norm(), (2 * curve.c2 + 6 * curve.c3).norm()});
    }
    const auto join = [](Box& box, const Box& other) {
        box.low0 = box.low0.cwiseMin(other.low0), box.high0 = box.high0.cwiseMax(other.high0);
        box.low1 = box.low1.cwiseMin(other.low1), box.high1 = box.high1.cwiseMax(other.high1);
        box.off = box.off.cwiseMax(other.off);
    };
    for (std::size_t n = boxes_.size(); n-- > 0;) {
        const TriangleTree::Node& node = tree_->nodes[n];
        if (node.count == 0) {
            boxes_[n] = boxes_[n + 1];
            join(boxes_[n], boxes_[static_cast<std::size_t>(node.second)]);
            continue;
        }
        boxes_[n] = of_vertex[static_cast<std::size_t>(tree_->triangles[tree_->order[node.first]][0])];
        for (std::int32_t i = node.first; i < node.first + node.count; ++i)
            for (const std::int32_t vertex : tree_->triangles[tree_->order[i]])
                join(boxes_[n], of_vertex[static_cast<std::size_t>(vertex)]);
    }
}

double MovingTriangles::Box::squared_distance(const Vec3d& P, double t) const
{
    const double bent = 4 * t * (1 - t);
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double low = low0[k] + t * (low1[k] - low0[k]) - bent * off[k];
        const double high = high0[k] + t * (high1[k] - high0[k]) + bent * off[k];
        const double gap = std::max({low - P[k], P[k] - high, 0.0});
        sum += gap * gap;
    }
    return sum;
}

std::array<Vec3d, 3> MovingTriangles::corners(std::int32_t triangle, double t) const
{
    const Mesh::Triangle& face = tree_->triangles[static_cast<std::size_t>(triangle)];
    return {curves_[face[0]].at(t), curves_[face[1]].at(t), curves_[face[2]].at(t)};
}

void MovingTriangles::test(std::int32_t triangle, const Vec3d& P, double t, double& best,
                           SurfacePoint& surface_point) const
{
    const auto [a, b, c] = corners(triangle, t);
    const auto [of_b, of_c] = nearest_weights(P, a, b, c);
    const Vec3d there = a + of_b * (b - a) + of_c * (c - a);
    const double squared = (there - P).squaredNorm();
    if (!(squared < best)) return;
    best = squared;
    surface_point = {triangle, of_b, of_c, there, 0};
}

MovingTriangles::SurfacePoint MovingTriangles::nearest(const Vec3d& P, double t, std::int32_t hint) const
{
    SurfacePoint surface_point;
    surface_point.triangle = tree_->order.front();  // also for a P that is NaN, which is near nothing
    double best = std::numeric_limits<double>::infinity();
    if (hint >= 0) test(hint, P, t, best, surface_point);

    struct Open {
        std::int32_t node;
        double squared;
    };
    Open open[64];  // the tree is balanced, so its depth is at most the number of bits of the face count
    int depth = 0;
    open[depth++] = {0, boxes_[0].squared_distance(P, t)};
    while (depth > 0) {
        const Open now = open[--depth];
        if (!(now.squared < best)) continue;
        const TriangleTree::Node& node = tree_->nodes[static_cast<std::size_t>(now.node)];
        if (node.count > 0) {
            for (std::int32_t i = node.first; i < node.first + node.count; ++i)
                test(tree_->order[static_cast<std::size_t>(i)], P, t, best, surface_point);
            continue;
        }
        Open near{now.node + 1, boxes_[static_cast<std::size_t>(now.node) + 1].squared_distance(P, t)};
        Open far{node.second, boxes_[static_cast<std::size_t>(node.second)].squared_distance(P, t)};
        if (far.squared < near.squared) std::swap(near, far);
        open[depth++] = far;
        open[depth++] = near;
    }
    surface_point.distance = std::sqrt(best);
    return surface_point;
}

Vec3d MovingTriangles::at(const SurfacePoint& surface_point, double t) const
{
    const std::array<Vec3d, 3> corner = corners(surface_point.triangle, t);
    return corner[0] + surface_point.b1 * (corner[1] - corner[0]) + surface_point.b2 * (corner[2] - corner[0]);
}

Vec3d MovingTriangles::velocity(const SurfacePoint& surface_point, double t) const
{
    const Mesh::Triangle& face = tree_->triangles[static_cast<std::size_t>(surface_point.triangle)];
    const Vec3d a = curves_[face[0]].derivative(t);
    return a + surface_point.b1 * (curves_[face[1]].derivative(t) - a) +
           surface_point.b2 * (curves_[face[2]].derivative(t) - a);
}

std::array<Vec3d, 3> MovingTriangles::rates(std::int32_t triangle, double t) const
{
    const Mesh::Triangle& face = tree_->triangles[static_cast<std::size_t>(triangle)];
    return {curves_[face[0]].derivative(t), curves_[face[1]].derivative(t), curves_[face[2]].derivative(t)};
}

namespace {

// Returns the weights x, y of x e1 + y e2, the projection of d onto the plane of both; zero if they span none.
Eigen::Vector2d weights(const Vec3d& e1, const Vec3d& e2, const Vec3d& d)
{
    const double a = e1.squaredNorm(), b = e1.dot(e2), c = e2.squaredNorm(), area2 = a * c - b * b;
    if (!(area2 > 0x1p-40 * a * c)) return Eigen::Vector2d::Zero();
    const double u = d.dot(e1), w = d.dot(e2);
    return {(c * u - b * w) / area2, (a * w - b * u) / area2};
}

}  // namespace

Vec3d MovingTriangles::coordinates(std::int32_t triangle, const Vec3d& P, double t) const
{
    const std::array<Vec3d, 3> p = corners(triangle, t);
    const Vec3d e1 = p[1] - p[0], e2 = p[2] - p[0], d = P - p[0], n = e1.cross(e2);
    const Eigen::Vector2d w = weights(e1, e2, d);
    const double size = n.norm();
    return {w.x(), w.y(), size > 0 ? d.dot(n) / size : 0};
}

Vec3d MovingTriangles::at(std::int32_t triangle, const Vec3d& coordinates, double t) const
{
    const std::array<Vec3d, 3> p = corners(triangle, t);
    const Vec3d e1 = p[1] - p[0], e2 = p[2] - p[0], n = e1.cross(e2);
    const double size = n.norm();
    Vec3d P = p[0] + coordinates.x() * e1 + coordinates.y() * e2;
    if (size > 0) P += coordinates.z() / size * n;
    return P;
}

// With m = e1 x e2 and n = m/|m|:  n' = (m' - n (n·m')) / |m|.
Vec3d MovingTriangles::velocity(std::int32_t triangle, const Vec3d& coordinates, double t) const
{
    const std::array<Vec3d, 3> p = corners(triangle, t), v = rates(triangle, t);
    const Vec3d e1 = p[1] - p[0], e2 = p[2] - p[0], v1 = v[1] - v[0], v2 = v[2] - v[0];
    const Vec3d m = e1.cross(e2), rate = v1.cross(e2) + e1.cross(v2);
    const double size = m.norm();
    Vec3d velocity = v[0] + coordinates.x() * v1 + coordinates.y() * v2;
    if (size > 0) velocity += coordinates.z() / size * (rate - m.dot(rate) / (size * size) * m);
    return velocity;
}

Vec3d MovingTriangles::turning(std::int32_t triangle, const Vec3d& slip, double t) const
{
    const std::array<Vec3d, 3> p = corners(triangle, t), v = rates(triangle, t);
    const Eigen::Vector2d w = weights(p[1] - p[0], p[2] - p[0], slip);
    return w.x() * (v[1] - v[0]) + w.y() * (v[2] - v[0]);
}

Eigen::Matrix3d MovingTriangles::frame(std::int32_t triangle, double t) const
{
    const std::array<Vec3d, 3> corner = corners(triangle, t);
    const Vec3d edge = corner[1] - corner[0], normal = edge.cross(corner[2] - corner[0]);
    const double size = normal.norm();
    Eigen::Matrix3d frame = Eigen::Matrix3d::Zero();
    if (!(size > 0)) return frame;
    frame.col(0) = edge.normalized();
    frame.col(2) = normal / size;
    frame.col(1) = frame.col(2).cross(frame.col(0));
    return frame;
}

Box3d MovingTriangles::bounds() const
{
    const Box& root = boxes_.front();
    return {root.low0.cwiseMin(root.low1) - root.off, root.high0.cwiseMax(root.high1) + root.off};
}

namespace {

using BakedPtr = std::shared_ptr<const BakedLevelSet>;

// Returns the acceleration of a point fixed to a face, as a difference of velocities; m per interval². The velocities
// are polynomials of second degree, apart from the turning normal.
Vec3d by_difference(const MovingTriangles& faces, const MaterialPoint& point, double t)
{
    constexpr double step = 0x1p-10;
    return (faces.velocity(point.face, point.at, t + step) - faces.velocity(point.face, point.at, t - step)) /
           (2 * step);
}

// The distance from a surface that moves from one level set to the next along the curves of its vertices.
class DeformingDistance {
public:
    // begin: null if the interval begins with a jump; the end's level set is then carried back along the curves.
    DeformingDistance(BakedPtr begin, BakedPtr end, MovingTriangles faces, double duration)
        : begin_(std::move(begin)),
          end_(std::move(end)),
          faces_(std::move(faces)),
          duration_(duration),
          fastest_(faces_.fastest() / duration),
          most_curved_(faces_.most_curved() / (duration * duration))
    {
    }

    struct Sample {
        double phi;
        Vec3d gradient;             // length about 1; zero outside if phi is only a bound
        std::int32_t nearest = -1;  // triangle, if one was searched for
        Vec3d vc = Vec3d::Zero();   // velocity of the surface, m/s
    };

    // Samples at a time. Outside, a distance above `exact` may be a cheaper bound. hint: a nearby triangle.
    Sample at(const Vec3d& P, double time, double exact, std::int32_t hint = -1) const
    {
        const double t = part_of(time);
        // The surface at either end differs from that at `time` by at most its speed times the time in between.
        double least = end_->sampler().distance(P) - fastest_ * (duration_ - time);
        if (begin_) least = std::max(least, begin_->sampler().distance(P) - fastest_ * time);
        if (least > exact) return {least, Vec3d::Zero()};

        const MovingTriangles::SurfacePoint surface_point = faces_.nearest(P, t, hint);
        Sample sample{0, Vec3d::Zero(), surface_point.triangle, faces_.velocity(surface_point, t) / duration_};
        const Eigen::Matrix3d now = faces_.frame(surface_point.triangle, t);
        const EndSample at_end = sample_end(*end_, surface_point, P, now, t, 1);
        EndSample at_begin;
        if (begin_) at_begin = sample_end(*begin_, surface_point, P, now, t, 0);

        double weight = 0;
        const auto add = [&](const EndSample& end, double w) {
            if (!end.agrees || w == 0) return;
            sample.phi += w * end.phi;
            sample.gradient += w * end.gradient;
            weight += w;
        };
        add(at_end, begin_ ? t : 1);
        add(at_begin, 1 - t);
        if (weight > 0) {
            sample.phi /= weight;
            sample.gradient /= weight;
        } else {
            // At both ends other parts of the body are nearer, so only the face decides the side.
            const double side = (P - surface_point.P).dot(now.col(2)) < 0 ? -1 : 1;
            sample.phi = side * surface_point.distance;
        }
        if (sample.gradient.isZero(0))
            sample.gradient = surface_point.distance > 0
                                  ? Vec3d(std::copysign(1 / surface_point.distance, sample.phi) * (P - surface_point.P))
                                  : Vec3d(now.col(2));
        return sample;
    }

    Vec3d velocity(const Vec3d& P, double time) const
    {
        const double t = part_of(time);
        return faces_.velocity(faces_.nearest(P, t), t) / duration_;
    }

    // Returns the motion of a point fixed to a face.
    MovingBody::State follow(const MaterialPoint& point, double time) const
    {
        const double t = part_of(time);
        return {faces_.at(point.face, point.at, t), faces_.velocity(point.face, point.at, t) / duration_,
                acceleration(point, t)};
    }
    Vec3d acceleration(const Vec3d& P, const Vec3d& v, double time) const
    {
        const double t = part_of(time);
        const MaterialPoint point = material(P, time);
        const Vec3d slip = v - faces_.velocity(point.face, point.at, t) / duration_;
        return acceleration(point, t) + 2 / duration_ * faces_.turning(point.face, slip, t);
    }
    MaterialPoint material(const Vec3d& P, double time) const
    {
        const double t = part_of(time);
        const std::int32_t face = faces_.nearest(P, t).triangle;
        return {face, faces_.coordinates(face, P, t)};
    }
    bool has(const MaterialPoint& point) const
    {
        return point.face >= 0 && static_cast<std::size_t>(point.face) < faces_.triangles();
    }

    const BakedLevelSet& end() const { return *end_; }
    double band() const { return begin_ ? std::min(begin_->band(), end_->band()) : end_->band(); }
    double slope_bound() const
    {
        return begin_ ? std::max(begin_->slope_bound(), end_->slope_bound()) : end_->slope_bound();
    }
    double voxel() const { return end_->voxel(); }
    double rounding() const { return 0x1p-21 * end_->band(); }  // m
    double fastest() const { return fastest_; }                 // bound on the faces' speed, m/s
    double most_curved() const { return most_curved_; }         // bound on the faces' acceleration, m/s²
    Box3d bounds() const
    {
        const Vec3d margin = Vec3d::Constant(voxel());
        return {faces_.bounds().min() - margin, faces_.bounds().max() + margin};
    }

private:
    Vec3d acceleration(const MaterialPoint& point, double t) const
    {
        return by_difference(faces_, point, t) / (duration_ * duration_);
    }

    double part_of(double time) const { return std::clamp(time / duration_, 0.0, 1.0); }

    // A sample of the level set at one end of the interval, at the position that P then has in the frame of its nearest
    // face.
    struct EndSample {
        double phi = 0;
        Vec3d gradient = Vec3d::Zero();  // rotated to the current orientation
        bool agrees = false;             // no other part of the body is nearer
    };
    EndSample sample_end(const BakedLevelSet& level_set, const MovingTriangles::SurfacePoint& surface_point,
                         const Vec3d& P, const Eigen::Matrix3d& now, double t, double then) const
    {
        Vec3d X = P;
        Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
        if (t != then) {
            turn = faces_.frame(surface_point.triangle, then) * now.transpose();
            if (turn.isZero(0)) turn.setIdentity();
            X = faces_.at(surface_point, then) + turn * (P - surface_point.P);
        }
        EndSample sample;
        sample.phi = level_set.sampler().distance(X, sample.gradient);
        sample.gradient = turn.transpose() * sample.gradient;
        const double band = level_set.band();
        sample.agrees = std::abs(sample.phi) >= std::min(surface_point.distance, band) - level_set.voxel();
        // Beyond the band the distance to the face is more accurate.
        if (sample.gradient.isZero(0)) sample.phi = std::copysign(std::max(band, surface_point.distance), sample.phi);
        return sample;
    }

    BakedPtr begin_, end_;
    MovingTriangles faces_;
    double duration_;               // s
    double fastest_, most_curved_;  // bounds for the faces: m/s, m/s²
};

// Adapts DeformingDistance to ContactWalk, as seen from one path.
struct DeformingField {
    using Hint = std::int32_t;  // nearest triangle
    struct Sample {
        double height;
        Vec3d X, gradient, velocity, vc;
        double slope;
        Hint hint;
        static constexpr double scale = 1;
    };
    static constexpr double kink = 0x1p-8;

    const DeformingDistance& body;
    const Path& path;
    double level;  // m

    double exact_within(Exact exact) const
    {
        switch (exact) {
            case Exact::InStep:
                return level + body.voxel();
            case Exact::AtStart:
                return path.radius + 2 * body.voxel();
            case Exact::InBand:
                break;
        }
        return path.radius + body.band();
    }

    Sample sample(double s, double height, const DeformingDistance::Sample& there) const
    {
        Sample sample{height, path.at(s), there.gradient, path.velocity(s) - there.vc, there.vc, 0, there.nearest};
        sample.slope = sample.gradient.dot(sample.velocity);
        return sample;
    }
    Sample at(double s, Hint hint, Exact exact) const
    {
        const auto there = body.at(path.at(s), path.begin + s, exact_within(exact), hint);
        return sample(s, there.phi - level, there);
    }
    double height(double s, Hint hint) const
    {
        return body.at(path.at(s), path.begin + s, exact_within(Exact::InStep), hint).phi - level;
    }
    Vec3d gradient_at(const Vec3d& X, double s, const Sample& here) const
    {
        return body.at(X, path.begin + s, exact_within(Exact::InBand), here.hint).gradient;
    }
    Contact contact(double s, const Vec3d& n, const Sample& here) const
    {
        Contact contact;
        contact.time = s;
        contact.n = n;
        contact.vc = here.vc;
        return contact;
    }

    // Returns a step that is free of the surface. If a quarter of a voxel of travel relative to the nearest part takes
    // longer, it returns that, limited to one voxel of closing distance because another part may approach.
    double step(double s, const Sample& here) const
    {
        const double fastest = std::max(path.velocity(s).norm(), path.velocity(path.duration).norm()) + body.fastest();
        if (!(fastest > 0)) return path.duration;
        const double free = here.height / (body.slope_bound() * fastest), voxel = body.voxel();
        if (here.hint < 0) return free;
        const double beside = time_to_travel(voxel / 4, here.velocity.norm(), acceleration());
        return std::max(free, std::min(beside, voxel / fastest));
    }
    double hop(const Sample&) const { return 0; }
    double fastest(double s, const Sample&, double) const
    {
        return path.velocity(s).norm() + path.duration * path.a.norm() + body.fastest();
    }
    double approach_speed(const Sample& ahead, const Sample&) const { return ahead.gradient.dot(ahead.velocity); }
    double acceleration() const { return path.a.norm() + body.most_curved(); }
    double close(const Sample&) const { return touching_within(path, body.rounding()); }
    double smallest_feature() const { return body.voxel(); }
    Box3d bounds() const { return body.bounds(); }
    bool open_ended() const { return false; }
};

class DeformingShape final : public MovingBody {
public:
    explicit DeformingShape(DeformingDistance body) : body_(std::move(body)), bounds_(body_.bounds()) {}

    std::string_view kind() const override { return "level set"; }
    Box3d bounds() const override { return bounds_; }
    double band() const override { return body_.band(); }
    double slope_bound() const override { return body_.slope_bound(); }
    double smallest_feature() const override { return body_.voxel(); }
    bool moves() const override { return true; }
    MeshPtr surface() const override { return body_.end().surface(); }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        body_.end().distance(P, phi, gradient);
    }

    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) {
            const auto sample = body_.at(P[i], time[i], band());
            phi[i] = sample.phi;
            if (!gradient.empty()) gradient[i] = sample.gradient;
        }
    }

    Vec3d velocity_at(const Vec3d& P, double time) const override { return body_.velocity(P, time); }
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const override
    {
        return body_.acceleration(P, v, time);
    }
    MaterialPoint material_at(const Vec3d& P, double time) const override { return body_.material(P, time); }
    bool has(const MaterialPoint& point) const override { return body_.has(point); }
    State follow(const MaterialPoint& point, double time) const override { return body_.follow(point, time); }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        for (std::size_t i = 0; i < paths.size(); ++i)
            contacts[i] = may_reach(paths[i], bounds_) ? first_contact_of<DeformingField>(body_, paths[i]) : Contact();
    }

private:
    DeformingDistance body_;
    Box3d bounds_;
};

// The surface of a mesh without an inside.
class DeformingSurface final : public MovingBody {
public:
    DeformingSurface(MovingTriangles faces, double duration) : faces_(std::move(faces)), duration_(duration) {}

    std::string_view kind() const override { return "mesh"; }
    Box3d bounds() const override { return faces_.bounds(); }
    bool moves() const override { return faces_.fastest() > 0; }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) sample(i, P, duration_, phi, gradient);
    }
    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) sample(i, P, time[i], phi, gradient);
    }

    Vec3d velocity_at(const Vec3d& P, double time) const override
    {
        const double t = part_of(time);
        return faces_.velocity(faces_.nearest(P, t), t) / duration_;
    }
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const override
    {
        const double t = part_of(time);
        const MaterialPoint point = material_at(P, time);
        const Vec3d slip = v - faces_.velocity(point.face, point.at, t) / duration_;
        return acceleration(point, t) + 2 / duration_ * faces_.turning(point.face, slip, t);
    }
    MaterialPoint material_at(const Vec3d& P, double time) const override
    {
        const double t = part_of(time);
        const std::int32_t face = faces_.nearest(P, t).triangle;
        return {face, faces_.coordinates(face, P, t)};
    }
    bool has(const MaterialPoint& point) const override
    {
        return point.face >= 0 && static_cast<std::size_t>(point.face) < faces_.triangles();
    }
    State follow(const MaterialPoint& point, double time) const override
    {
        const double t = part_of(time);
        return {faces_.at(point.face, point.at, t), faces_.velocity(point.face, point.at, t) / duration_,
                acceleration(point, t)};
    }

    // Finds no contacts, because there is no inside.
    void first_contact(std::span<const Path>, std::span<Contact> contacts) const override
    {
        std::fill(contacts.begin(), contacts.end(), Contact());
    }

private:
    double part_of(double time) const { return std::clamp(time / duration_, 0.0, 1.0); }

    // Computes the distance and the gradient. On the surface itself the gradient is the normal of the face.
    void sample(std::size_t i, std::span<const Vec3d> P, double time, std::span<double> phi,
                std::span<Vec3d> gradient) const
    {
        const double t = part_of(time);
        const MovingTriangles::SurfacePoint surface_point = faces_.nearest(P[i], t);
        phi[i] = surface_point.distance;
        if (gradient.empty()) return;
        if (surface_point.distance > 0)
            gradient[i] = (P[i] - surface_point.P) / surface_point.distance;
        else
            gradient[i] = faces_.frame(surface_point.triangle, t).col(2);
    }
    Vec3d acceleration(const MaterialPoint& point, double t) const
    {
        return by_difference(faces_, point, t) / (duration_ * duration_);
    }

    MovingTriangles faces_;
    double duration_;  // s
};

}  // namespace

std::shared_ptr<const TriangleTree> triangle_tree(const MeshPtr& mesh)
{
    static std::mutex mutex;
    static std::map<std::weak_ptr<const Mesh>, std::weak_ptr<const TriangleTree>, std::owner_less<>> known;
    const std::lock_guard lock(mutex);
    std::erase_if(known, [](const auto& entry) { return entry.second.expired(); });
    std::shared_ptr<const TriangleTree> tree = known[mesh].lock();
    if (!tree) known[mesh] = tree = std::make_shared<TriangleTree>(mesh);
    return tree;
}

std::shared_ptr<const MovingBody> deforming_surface(const std::shared_ptr<const TriangleTree>& tree,
                                                    std::vector<Cubic<Vec3d>> curves, double duration)
{
    return std::make_shared<DeformingSurface>(MovingTriangles(tree, std::move(curves)), duration);
}

ShapePtr deforming_shape(const LevelSetPtr& begin, const LevelSetPtr& end,
                         const std::shared_ptr<const TriangleTree>& tree, std::vector<Cubic<Vec3d>> curves,
                         double duration)
{
    return std::make_shared<DeformingShape>(DeformingDistance(std::static_pointer_cast<const BakedLevelSet>(begin),
                                                              std::static_pointer_cast<const BakedLevelSet>(end),
                                                              MovingTriangles(tree, std::move(curves)), duration));
}

}  // namespace rapid
