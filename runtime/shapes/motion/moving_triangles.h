// The faces of a mesh that deforms during an interval, with each vertex on a cubic: the nearest point of the surface at
// any time, and its velocity.
//
// A bounding volume hierarchy. Its tree is built once per mesh, as the topology is constant, and refitted to each
// interval. A box moves linearly from the initial to the final bounds of its faces, and is widened by the deviation of
// their curves from straight lines.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

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

}  // namespace rapid
