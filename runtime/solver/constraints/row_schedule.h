// The order of row projection: rows that form trees are solved directly, tree by tree; all others by Gauss-Seidel,
// colour by colour.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/math/vec.h"

namespace rapid {

// Rows over two points that form trees (chains, ropes, branches) and are solved directly (system_motion.h).
class Forest {
public:
    // A link of a tree: a row, between a point and its parent.
    struct Link {
        std::uint32_t row, child, parent;  // indices of rows and points
        std::uint32_t above;               // the parent's own link, as an index in `links`; itself at the root
        bool flipped;                      // the child is the row's first point

        // For the solution of the tree (system_motion.h).
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

// Graph colouring: rows of the same colour share no point.
//
// Gauss-Seidel does not depend on the order within a colour. The rows of a colour can therefore be projected in
// parallel, bit-identically for any number of threads.
struct GraphColouring {
    std::vector<std::uint32_t> order;  // row indices, colour by colour
    std::vector<std::uint32_t> begin;  // index in `order` of each colour's first row, then the end of the last
    std::size_t uncoloured = 0;        // rows at the end of `order`, to be projected sequentially

    // Colours greedily: each row, in order, takes the first colour that none of its points has. points: `arity` per
    // row.
    GraphColouring(std::span<const std::uint32_t> points, std::size_t arity, std::size_t size);
    GraphColouring() = default;
};

class RowSchedule {
public:
    RowSchedule() = default;
    // rows: those to project; points: `arity` of each. fixed: 1 for points of infinite mass.
    RowSchedule(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> points, std::size_t arity,
                std::span<const std::uint8_t> fixed, bool trees);

    // Calls solve(tree, index of its first link).
    template <class Solve>
    void for_each_tree(const Solve& solve)
    {
        const std::size_t trees = forest_.begin.empty() ? 0 : forest_.begin.size() - 1;
        const auto solve_trees = [&](std::size_t from, std::size_t to) {
            for (std::size_t t = from; t < to; ++t) {
                const std::uint32_t begin = forest_.begin[t];
                solve(std::span(forest_.links).subspan(begin, forest_.begin[t + 1] - begin), std::size_t{begin});
            }
        };
        constexpr std::size_t worth_a_task = 256;  // links: tens of microseconds
        if (forest_.links.size() < worth_a_task) return solve_trees(0, trees);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, trees),
                          [&](const auto& range) { solve_trees(range.begin(), range.end()); });
    }

    // The rows in no tree.
    std::span<const std::uint32_t> others() const { return others_; }

    // Calls project(k) for each row in no tree, with its index in others().
    template <class Project>
    void for_each_coloured(const Project& project) const
    {
        const std::span<const std::uint32_t> order = colours_.order;
        for (std::size_t c = 0; c + 1 < colours_.begin.size(); ++c)
            for_each_chunk(colours_.begin[c + 1] - colours_.begin[c], [&](std::size_t begin, std::size_t end) {
                for (std::size_t k = begin; k < end; ++k) project(order[colours_.begin[c] + k]);
            });
        for (const std::uint32_t k : order.last(colours_.uncoloured)) project(k);
    }

private:
    Forest forest_;
    std::vector<std::uint32_t> others_;
    GraphColouring colours_;
};

}  // namespace rapid
