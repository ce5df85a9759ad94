// The faces of a mesh that deforms during an interval, each vertex along a cubic: the nearest point of the surface at
// any time of it, and its velocity.
//
// A bounding box hierarchy, whose tree is built once for a mesh, as its topology stays the same, and refitted to each
// interval. A box moves straight from where its faces begin to where they end, and is wider by what their curves are
// off straight lines.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

// The tree of faces: a binary tree of the parts of the mesh that lie together in its rest position.
struct TriangleTree {
    explicit TriangleTree(const MeshPtr& mesh);

    // In preorder: the first child of an inner node comes right after it.
    struct Node {
        std::int32_t first, count;  // of a leaf, in `order`; count is 0 for an inner node
        std::int32_t second;        // child of an inner node
    };
    std::vector<Node> nodes;
    std::vector<std::int32_t> order;  // of triangles
    std::vector<Mesh::Triangle> triangles;
};

class MovingTriangles {
public:
    // curves: of the vertices, with t from 0 to 1.
    MovingTriangles(std::shared_ptr<const TriangleTree> tree, std::vector<Cubic<Vec3d>> curves);

    struct Place {
        std::int32_t triangle = -1;
        double b1 = 0, b2 = 0;    // barycentric weights of the second and third corner
        Vec3d P = Vec3d::Zero();  // m
        double distance = 0;      // m, from the query point
    };
    // hint: a triangle that is near, if one is known; it shortens the search.
    Place nearest(const Vec3d& P, double t, std::int32_t hint = -1) const;

    Vec3d at(const Place& place, double t) const;
    Vec3d velocity(const Place& place, double t) const;  // m an interval

    // A place that keeps to a triangle: (x, y, z) is p0 + x (p1 - p0) + y (p2 - p0) + z n.
    Vec3d coordinates(std::int32_t triangle, const Vec3d& P, double t) const;
    Vec3d at(std::int32_t triangle, const Vec3d& coordinates, double t) const;
    Vec3d velocity(std::int32_t triangle, const Vec3d& coordinates, double t) const;  // m an interval
    // Of a slip along the triangle, a vector in its plane in m a unit of time, by its edges: what these turn it by.
    Vec3d turning(std::int32_t triangle, const Vec3d& slip, double t) const;
    std::size_t triangles() const { return tree_->triangles.size(); }

    // Unit tangents and the outward normal, as columns; zero where the triangle has no area.
    Eigen::Matrix3d frame(std::int32_t triangle, double t) const;

    Box3d bounds() const;                           // of the whole interval
    double fastest() const { return fastest_; }     // a bound, m an interval
    double most_curved() const { return curved_; }  // of the second derivatives

private:
    struct Box {
        Vec3d low0, high0, low1, high1, off;

        double squared_distance(const Vec3d& P, double t) const;
    };
    std::array<Vec3d, 3> corners(std::int32_t triangle, double t) const;
    std::array<Vec3d, 3> rates(std::int32_t triangle, double t) const;
    void test(std::int32_t triangle, const Vec3d& P, double t, double& best, Place& place) const;

    std::shared_ptr<const TriangleTree> tree_;
    std::vector<Cubic<Vec3d>> curves_;
    std::vector<Box> boxes_;  // by node
    double fastest_ = 0, curved_ = 0;
};

}  // namespace rapid
