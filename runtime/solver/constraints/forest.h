// Rows over two points each that make trees (chains, ropes, branches), solved directly.
//
// One sweep of Gauss-Seidel carries a correction one link far, so that a chain of 1,000 links would need as many. The
// linear system of a tree is solved in one pass from the leaves to the root and one back, in time that grows with the
// number of links (Baraff 1996): a point, with all that hangs from it, is a 3 by 3 matrix.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/vec.h"

namespace rapid {

class Forest {
public:
    // A link of a tree, with what a projection needs; parents come before their children.
    struct Link {
        std::uint32_t row, child, parent;  // places of rows and points
        std::uint32_t above;               // the parent's own link, as a place in `links`; itself at the root
        bool flipped;                      // the child is the row's first point

        // Of the projection.
        Vec3d gradient, gradient_above;  // of the residual, by the child's and the parent's place
        Vec3d along, along_above;        // and what the row acts along there
        Eigen::Matrix3d K;               // kg: how the row's force turns as its points move across it
        Eigen::Matrix3d M;               // kg: of the child and what hangs from it; then its inverse
        Vec3d f, moved;
        double e, s;
    };

    // ends: two points a row. fixed: points that no constraint moves; a tree has its root at one of them where it can.
    // Error: none. Rows of cycles are in no tree.
    Forest(std::span<const std::uint32_t> ends, std::size_t size, std::span<const std::uint8_t> fixed);
    Forest() = default;

    std::vector<Link> links;              // tree by tree
    std::vector<std::uint32_t> begin;     // of each tree, and the end of the last
    std::vector<std::uint32_t> leftover;  // rows that are in no tree
};

// Solves one tree: link.e is then Δλ, link.moved what the child is moved by, m; returns the root's. Given are each
// link's gradients, directions and K, e = C + α~ λ and s = α~, and by w(point) inverse masses.
//
//   (M + K) Δx - K Δx' = f + a λ        of a child, with Δx' and a' those of its parent
//   g Δx + g' Δx' + s λ = -e            of its link
//
// from which Δx and λ are eliminated, leaf by leaf.
template <class InverseMass>
Vec3d solve_tree(std::span<Forest::Link> tree, std::size_t first, const InverseMass& w)
{
    using Link = Forest::Link;
    // A link to a point that nothing moves, without compliance, is this much stiffer than its other end is inert.
    constexpr double softest = 1e-9;
    const auto mass = [&](std::uint32_t point) {
        return Eigen::Matrix3d(Eigen::Matrix3d::Identity() / (w(point) > 0 ? w(point) : 1));
    };
    const std::uint32_t root = tree.front().parent;
    Eigen::Matrix3d root_M = mass(root);
    Vec3d root_f = Vec3d::Zero();
    for (Link& link : tree) link.M = mass(link.child), link.f.setZero();

    for (std::size_t k = tree.size(); k-- > 0;) {
        Link& link = tree[k];
        Eigen::Matrix3d K = link.K;
        Vec3d pulled = Vec3d::Zero();
        if (w(link.child) > 0) {
            link.M = (link.M + link.K).inverse().eval();
            const Vec3d y = link.M * link.along;
            link.s += link.gradient.dot(y);
            link.e += link.gradient.dot(link.M * link.f);
            link.gradient_above += link.K * (link.M.transpose() * link.gradient);
            link.along_above += link.K * y;
            pulled = link.K * (link.M * link.f);
            K -= link.K * link.M * link.K;
        }
        if (!(w(link.parent) > 0)) continue;
        link.s = std::max(link.s, softest * w(link.parent) * link.gradient_above.squaredNorm());
        if (!(link.s > 0)) continue;
        const bool at_root = link.above == first + k;
        Eigen::Matrix3d& M = at_root ? root_M : tree[link.above - first].M;
        Vec3d& f = at_root ? root_f : tree[link.above - first].f;
        M += K + link.along_above * (link.gradient_above / link.s).transpose();
        f += pulled - link.along_above * (link.e / link.s);
    }
    const Vec3d root_moved = w(root) > 0 ? Vec3d(root_M.inverse() * root_f) : Vec3d(Vec3d::Zero());
    for (std::size_t k = 0; k < tree.size(); ++k) {
        Link& link = tree[k];
        const Vec3d& above = link.above == first + k ? root_moved : tree[link.above - first].moved;
        link.e = link.s > 0 ? -(link.e + link.gradient_above.dot(above)) / link.s : 0;
        link.moved =
            w(link.child) > 0 ? Vec3d(link.M * (link.f + link.K * above + link.along * link.e)) : Vec3d(Vec3d::Zero());
    }
    return root_moved;
}

}  // namespace rapid
