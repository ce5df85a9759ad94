#include "runtime/solver/motion/free_paths.h"

#include <algorithm>
#include <limits>

namespace rapid {
namespace {

// Along the packed coordinates what belongs to the axes recurs: in whole vectors of 8, and whole points.
constexpr int period = 24, points_a_period = period / 3;
using Period = Eigen::Array<double, period, 1>;

Period by_axis(const Vec3d& x) { return x.array().replicate<points_a_period, 1>(); }

Eigen::Map<const Period> period_at(const Eigen::ArrayXd& x, Eigen::Index at)
{
    return Eigen::Map<const Period>(x.data() + at);
}

}  // namespace

void FreePaths::begin(std::span<const Vec3d> P, std::span<const Vec3d> v, Strided<Vec3d> a, std::span<const double> dt)
{
    size_ = P.size();
    const auto n = static_cast<Eigen::Index>(3 * size_);
    const Eigen::Index padded = (n + period - 1) / period * period;
    for (Eigen::ArrayXd* x : {&t_, &gain_, &P_, &v_}) x->resize(n);
    lowest_.resize(padded);
    highest_.resize(padded);

    for (std::size_t i = 0; i < size_; ++i) t_.segment<3>(3 * i).setConstant(dt[i]);
    if (a.stride == 0) {
        const Period g = by_axis(a[0]);
        Eigen::Index at = 0;
        for (; at + period <= n; at += period) gain_.segment<period>(at) = t_.segment<period>(at) * g;
        gain_.tail(n - at) = t_.tail(n - at) * g.head(n - at);
    } else {
        gain_ = t_ * Eigen::Map<const Eigen::ArrayXd>(a.data->data(), n);
    }

    const Eigen::Map<const Eigen::ArrayXd> p(coordinates(P), n), u(coordinates(v), n);
    P_ = p + t_ * (u + 0.5 * gain_);
    v_ = u + gain_;
    // The parabola is off the straight line by a t²/8 at most. The factor keeps a point that is flush with a box and
    // rounded away from it.
    gain_ = (0.125 * t_ * gain_).abs() + 0x1p-21 * p.abs();
    lowest_.head(n) = p.min(P_) - gain_;
    highest_.head(n) = p.max(P_) + gain_;

    // What is beyond the last point is a copy of it.
    for (Eigen::Index at = n; at < padded; ++at) {
        lowest_[at] = lowest_[at - 3];
        highest_[at] = highest_[at - 3];
    }
    Period lowest = period_at(lowest_, 0), highest = period_at(highest_, 0);
    for (Eigen::Index at = period; at < padded; at += period) {
        lowest = lowest.min(period_at(lowest_, at));
        highest = highest.max(period_at(highest_, at));
    }
    bounds_.setEmpty();
    for (int at = 0; at < period; at += 3) {
        bounds_.extend(Vec3d(lowest.segment<3>(at)));
        bounds_.extend(Vec3d(highest.segment<3>(at)));
    }
}

void FreePaths::exchange(std::span<Vec3d> P, std::span<Vec3d> v)
{
    std::swap_ranges(P_.begin(), P_.end(), coordinates(P));
    std::swap_ranges(v_.begin(), v_.end(), coordinates(v));
}

void FreePaths::find_near(const Box3d& box, double radius, std::vector<std::uint32_t>& near) const
{
    near.clear();
    const Vec3d margin = Vec3d::Constant(radius * (1 + 0x1p-21));
    const Box3d wide(box.min() - margin, box.max() + margin);
    if (!bounds_.intersects(wide)) return;

    const Period least = by_axis(wide.min()), most = by_axis(wide.max());
    for (std::size_t first = 0; first < size_; first += points_a_period) {
        const auto at = static_cast<Eigen::Index>(3 * first);
        const Period beyond = (least - period_at(highest_, at)).max(period_at(lowest_, at) - most);
        const std::size_t last = std::min(size_, first + points_a_period);
        for (std::size_t i = first, l = 0; i < last; ++i, l += 3)
            if (std::max({beyond[l], beyond[l + 1], beyond[l + 2]}) <= 0) near.push_back(static_cast<std::uint32_t>(i));
    }
}

}  // namespace rapid
