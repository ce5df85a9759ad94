#include "runtime/solver/constraints/system_motion.h"

#include <algorithm>
#include <numeric>

#include "runtime/base/parallel.h"

namespace rapid {
namespace {

double dot(std::span<const double> a, std::span<const double> b)
{
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

void add(double factor, std::span<const double> x, std::span<double> y)
{
    for (std::size_t r = 0; r < y.size(); ++r) y[r] += factor * x[r];
}

}  // namespace

void RowSystem::begin(std::size_t rows, std::size_t arity, std::size_t size)
{
    arity_ = arity;
    points.resize(rows * arity);
    gradient.resize(rows * arity);
    e.resize(rows);
    s.resize(rows);
    lambda.assign(rows, 0);
    w.resize(size);
    sum_.resize(size);
    for (std::vector<double>* v :
         {&residual_, &direction_, &product_, &first_, &first_product_, &conditioned_, &inverse_diagonal_})
        v->resize(rows);
}

// Computes y = (G w Gᵀ + s) x, and sum_ = Gᵀ x.
void RowSystem::multiply(const RowSchedule& schedule, std::span<const double> x, std::span<double> y)
{
    for (const std::uint32_t i : points) sum_[i].setZero();
    schedule.for_each_coloured([&](std::uint32_t r) {
        for (std::size_t k = r * arity_; k < (r + 1) * arity_; ++k) sum_[points[k]] += x[r] * gradient[k];
    });
    for_each_chunk(size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) {
            y[r] = s[r] * x[r];
            for (std::size_t k = r * arity_; k < (r + 1) * arity_; ++k)
                y[r] += w[points[k]] * gradient[k].dot(sum_[points[k]]);
        }
    });
}

// The first direction is that of the given λ, so an unchanged load is found immediately.
void RowSystem::solve(const RowSchedule& schedule, double tolerance, int max_iterations)
{
    const std::size_t n = size();
    for (std::size_t r = 0; r < n; ++r) {
        double diagonal = s[r];
        for (std::size_t k = r * arity_; k < (r + 1) * arity_; ++k)
            diagonal += w[points[k]] * gradient[k].squaredNorm();
        inverse_diagonal_[r] = diagonal > 0 ? 1 / diagonal : 0;
        residual_[r] = diagonal > 0 ? -e[r] : 0;
    }
    const auto condition = [&] {
        double size = 0;
        for (std::size_t r = 0; r < n; ++r) {
            conditioned_[r] = inverse_diagonal_[r] * residual_[r];
            size += conditioned_[r] * residual_[r];
        }
        return size;
    };
    double enough = condition();
    enough *= tolerance * tolerance;
    first_ = lambda;
    std::fill(lambda.begin(), lambda.end(), 0.0);
    double first_size = 0;
    if (std::any_of(first_.begin(), first_.end(), [](double x) { return x != 0; })) {
        multiply(schedule, first_, first_product_);
        first_size = dot(first_, first_product_);
    }
    if (first_size > 0) {
        const double length = dot(first_, residual_) / first_size;
        add(length, first_, lambda);
        add(-length, first_product_, residual_);
    }
    double size = 0;  // of the last direction
    for (int k = 0; k < max_iterations && condition() > enough; ++k) {
        const double along_last = size > 0 ? dot(conditioned_, product_) / size : 0;
        const double along_first = first_size > 0 ? dot(conditioned_, first_product_) / first_size : 0;
        for (std::size_t r = 0; r < n; ++r)
            direction_[r] = conditioned_[r] - along_last * (k > 0 ? direction_[r] : 0) - along_first * first_[r];
        multiply(schedule, direction_, product_);
        size = dot(direction_, product_);
        if (!(size > 0)) break;
        const double length = dot(direction_, residual_) / size;
        add(length, direction_, lambda);
        add(-length, product_, residual_);
    }
    multiply(schedule, lambda, product_);
}

}  // namespace rapid
