// Direct solution of a tree of links.
//
// One sweep of Gauss-Seidel carries a correction one link far, so that a chain of 1,000 links would need as many. The
// linear system of a tree is solved in one pass from the leaves to the root and one back, in linear time (Baraff 1996):
// a point, with its subtree, is a 3 by 3 matrix.
#pragma once

#include <algorithm>
#include <span>

#include "runtime/solver/constraints/forest.h"

namespace rapid {

// Solves one tree: link.e is then Δλ, link.shift what the child is moved by, m; returns the root's shift. Given are the
// index `first` of the tree's first link, each link's gradients, directions and K, e = C + α~ λ and s = α~, and by
// w(point) inverse masses.
//
//   (M + K) Δx - K Δx' = f + a λ        of a child, with Δx' and a' those of its parent
//   g Δx + g' Δx' + s λ = -e            of its link
//
// from which Δx and λ are eliminated, leaf by leaf.
template <class InverseMass>
Vec3d solve_tree(std::span<Forest::Link> tree, std::size_t first, const InverseMass& w)
{
    using Link = Forest::Link;
    // The compliance of a link to a point of infinite mass is at least this part of its other end's inverse mass.
    constexpr double least_compliance = 1e-9;
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
            const Vec3d y = link.M * link.direction;
            link.s += link.gradient.dot(y);
            link.e += link.gradient.dot(link.M * link.f);
            link.gradient_above += link.K * (link.M.transpose() * link.gradient);
            link.direction_above += link.K * y;
            pulled = link.K * (link.M * link.f);
            K -= link.K * link.M * link.K;
        }
        if (!(w(link.parent) > 0)) continue;
        link.s = std::max(link.s, least_compliance * w(link.parent) * link.gradient_above.squaredNorm());
        if (!(link.s > 0)) continue;
        const bool at_root = link.above == first + k;
        Eigen::Matrix3d& M = at_root ? root_M : tree[link.above - first].M;
        Vec3d& f = at_root ? root_f : tree[link.above - first].f;
        M += K + link.direction_above * (link.gradient_above / link.s).transpose();
        f += pulled - link.direction_above * (link.e / link.s);
    }
    const Vec3d root_shift = w(root) > 0 ? Vec3d(root_M.inverse() * root_f) : Vec3d(Vec3d::Zero());
    for (std::size_t k = 0; k < tree.size(); ++k) {
        Link& link = tree[k];
        const Vec3d& above = link.above == first + k ? root_shift : tree[link.above - first].shift;
        link.e = link.s > 0 ? -(link.e + link.gradient_above.dot(above)) / link.s : 0;
        link.shift = w(link.child) > 0 ? Vec3d(link.M * (link.f + link.K * above + link.direction * link.e))
                                       : Vec3d(Vec3d::Zero());
    }
    return root_shift;
}

}  // namespace rapid
