// The linear system of rows that are in no tree, solved by conjugate gradients:
//
//   Δ = w Σ g λ           per point, over its rows
//   Σ g·Δ + s λ = -e      per row, over its points
//
// Conjugate gradients, with Jacobi's preconditioner, because every iterate is orthogonal to its residual. If s is 0,
// the resulting forces therefore do no work even after few iterations (tree_motion.h), and impulses that stop the
// points along the rows only lose energy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/row_schedule.h"
#include "runtime/vec.h"

namespace rapid {

class RowSystem {
public:
    // Sets up the rows of a substep: `arity` point indices each, out of `size` points. Gradients of inactive rows are
    // 0.
    void begin(std::size_t rows, std::size_t arity, std::size_t size);
    std::size_t size() const { return e.size(); }

    std::vector<std::uint32_t> points;  // [rows, arity]
    std::vector<Vec3d> gradient;        // [rows, arity]
    std::vector<double> e, s;           // [rows]: residual and compliance
    std::vector<double> lambda;         // [rows]: the initial guess, then the solution
    std::vector<double> w;              // [size]: weights

    // Iterates until the residual is `tolerance` times the initial one, or up to the iteration limit. `schedule` has
    // the coloured rows, numbered as here.
    void solve(const RowSchedule& schedule, double tolerance, int most_iterations);

    // Returns w Σ g λ of a point.
    Vec3d shift(std::size_t i) const { return w[i] * sum_[i]; }

private:
    void multiply(const RowSchedule& schedule, std::span<const double> x, std::span<double> y);

    std::size_t arity_ = 0;
    std::vector<Vec3d> sum_;  // [size]: Σ g x
    std::vector<double> residual_, direction_, product_, first_, first_product_, conditioned_, inverse_diagonal_;
};

}  // namespace rapid
