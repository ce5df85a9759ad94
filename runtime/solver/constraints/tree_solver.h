// Direct solution of a tree of links.
//
// One sweep of Gauss-Seidel propagates a correction by one link, so a chain of 1,000 links would need 1,000 sweeps.
// The linear system of a tree is solved in one pass from the leaves to the root and one back, in linear time (Baraff
// 1996). The mobility that a point has left after its subtree is joined to it is a 3 by 3 matrix. A link joins it by a
// rank-one update: no matrix is inverted, and rigid links to fixed points need no special case.
#pragma once

#include <algorithm>
#include <span>

#include "runtime/solver/constraints/forest.h"

namespace rapid {

// Solves one tree for the multipliers λ of its links and the shifts of its points:
//
//   Δ = w Σ g λ           per point, over its links
//   Σ g·Δ + s λ = -e      per link, over its two ends
//
// Each link provides gradients g, e and s >= 0 (infinite: the link does not act). w(k) provides the weights: of the
// root for k = 0, else of the child of link k - 1. A point with weight 0 does not move. Returns the root's shift, and
// sets link.lambda and link.shift. `first` is the index of the tree's first link.
template <class Weight>
Vec3d solve_tree(std::span<Forest::Link> tree, std::size_t first, const Weight& w)
{
    // Compliance of a link that the joined part leaves no freedom, relative to the freedom of its ends alone, so that
    // pins that no tree can reach get a finite load.
    constexpr double least_compliance = 1e-9;

    // From the leaves: `mobility` is the shift of a point per impulse, `shift` that due to its subtree.
    Eigen::Matrix3d root_mobility = w(0) * Eigen::Matrix3d::Identity();
    Vec3d root_shift = Vec3d::Zero();
    for (std::size_t k = 0; k < tree.size(); ++k) {
        tree[k].mobility = w(k + 1) * Eigen::Matrix3d::Identity();
        tree[k].shift.setZero();
    }
    for (std::size_t k = tree.size(); k-- > 0;) {
        Forest::Link& link = tree[k];
        const std::size_t above = link.above - first;
        const double w_above = above == k ? w(0) : w(above + 1);
        Eigen::Matrix3d& mobility = above == k ? root_mobility : tree[above].mobility;
        Vec3d& shift = above == k ? root_shift : tree[above].shift;
        link.reach = mobility * link.gradient_above;
        link.e += link.gradient.dot(link.shift) + link.gradient_above.dot(shift);
        const double least =
            least_compliance * (w(k + 1) * link.gradient.squaredNorm() + w_above * link.gradient_above.squaredNorm());
        link.s = std::max(
            link.s + link.gradient.dot(link.mobility * link.gradient) + link.gradient_above.dot(link.reach), least);
        if (!(link.s > 0)) continue;
        mobility -= link.reach * (link.reach / link.s).transpose();
        shift -= link.e / link.s * link.reach;
    }

    // Back to the leaves: `shift` accumulates the impulses of its links on a point.
    root_shift.setZero();
    for (std::size_t k = 0; k < tree.size(); ++k) {
        Forest::Link& link = tree[k];
        const std::size_t above = link.above - first;
        Vec3d& impulse = above == k ? root_shift : tree[above].shift;
        link.lambda = link.s > 0 ? -(link.e + link.reach.dot(impulse)) / link.s : 0;
        impulse += link.lambda * link.gradient_above;
        link.shift = link.lambda * link.gradient;
    }
    for (std::size_t k = 0; k < tree.size(); ++k) tree[k].shift *= w(k + 1);
    return w(0) * root_shift;
}

}  // namespace rapid
