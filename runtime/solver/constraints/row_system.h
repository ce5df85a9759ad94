// The linear system of rows that make no tree, by conjugate gradients:
//
//   Δ = w Σ g λ           of each point, over its rows
//   Σ g·Δ + s λ = -e      of each row, over its points
//
// Conjugate gradients, with Jacobi's preconditioner, because every iterate is orthogonal to its residual: where s is 0,
// forces that are found so do no work however few the iterations (tree_motion.h), and impulses that stop the points
// along the rows only lose energy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/row_schedule.h"
#include "runtime/vec.h"

namespace rapid {

class RowSystem {
public:
    // The rows of a sub-step: `arity` points each, by index, of `size` points. Gradients are 0 of rows that do not act.
    void begin(std::size_t rows, std::size_t arity, std::size_t size);
    std::size_t size() const { return e.size(); }

    std::vector<std::uint32_t> points;  // [rows, arity]
    std::vector<Vec3d> gradient;        // [rows, arity]
    std::vector<double> e, s;           // [rows]: residual and compliance
    std::vector<double> lambda;         // [rows]: where the search begins, then the solution
    std::vector<double> w;              // [size]: weights

    // Until the residual is `tolerance` times that at first, or for so many iterations. `schedule`: its coloured rows,
    // by their numbers here.
    void solve(const RowSchedule& schedule, double tolerance, int most_iterations);

    // w Σ g λ of a point.
    Vec3d shift(std::size_t i) const { return w[i] * sum_[i]; }

private:
    void multiply(const RowSchedule& schedule, std::span<const double> x, std::span<double> y);

    std::size_t arity_ = 0;
    std::vector<Vec3d> sum_;  // [size]: Σ g x
    std::vector<double> residual_, direction_, product_, first_, first_product_, conditioned_, inverse_diagonal_;
};

}  // namespace rapid
