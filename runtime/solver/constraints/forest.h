// Rows over two points that form trees (chains, ropes, branches) and are solved directly (tree_motion.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"

namespace rapid {

class Forest {
public:
    // A link of a tree: a row, between a point and its parent.
    struct Link {
        std::uint32_t row, child, parent;  // indices of rows and points
        std::uint32_t above;               // the parent's own link, as an index in `links`; itself at the root
        bool flipped;                      // the child is the row's first point

        // For the solution of the tree (tree_motion.h).
        Vec3d gradient, gradient_above;  // of the residual, by the child's and the parent's position
        double e, s;                     // residual and compliance; after elimination, including the subtree's
        double lambda;                   // multiplier
        Vec3d shift;                     // of the child
        Vec3d reach;                     // shift of the parent due to the link's impulse
        Eigen::Matrix3d mobility;        // of the child including its subtree
    };

    // Builds the trees. ends: two points per row. fixed: 1 for points of infinite mass; a tree that contains one is
    // rooted there. Rows of a component with a cycle are in no tree.
    Forest(std::span<const std::uint32_t> ends, std::size_t size, std::span<const std::uint8_t> fixed);
    Forest() = default;

    std::vector<Link> links;              // tree by tree; parents precede their children
    std::vector<std::uint32_t> begin;     // index of each tree's first link, then the end of the last
    std::vector<std::uint32_t> leftover;  // rows in no tree

private:
    struct Incidence;
    void grow(std::uint32_t root, std::span<const std::uint32_t> ends, Incidence& incidence);
};

}  // namespace rapid
