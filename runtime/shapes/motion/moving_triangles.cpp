#include "runtime/shapes/motion/moving_triangles.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/shapes/mesh/nearest_on_triangle.h"

namespace rapid {
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

}  // namespace rapid
