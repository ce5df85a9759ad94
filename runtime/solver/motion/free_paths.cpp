#include "runtime/solver/motion/free_paths.h"

#include <algorithm>
#include <bit>

#include "runtime/math/path_extent.h"
#include "runtime/solver/motion/packed_points.h"

namespace rapid {
namespace {

using Coordinates = PackedPoints<Doubles>;

[[gnu::always_inline]] inline Coordinates load(const Vec3d* from)
{
    const double* x = from->data();
    return {{load_pack(x), load_pack(x + lanes), load_pack(x + 2 * lanes)}};
}
[[gnu::always_inline]] inline void store(const Coordinates& coordinates, Vec3d* to)
{
    for (std::uint32_t k = 0; k < 3; ++k) store_pack(coordinates[k], to->data() + lanes * k);
}

// Returns the durations of eight points, each repeated three times.
[[gnu::always_inline]] inline Coordinates tripled(const double* t)
{
    const Doubles eight = load_pack(t);
    return {{__builtin_shufflevector(eight, eight, 0, 0, 0, 1, 1, 1, 2, 2),
             __builtin_shufflevector(eight, eight, 2, 3, 3, 3, 4, 4, 4, 5),
             __builtin_shufflevector(eight, eight, 5, 5, 6, 6, 6, 7, 7, 7)}};
}

}  // namespace

void FreePaths::begin(std::span<const Vec3d> P, std::span<const Vec3d> v, Strided<Vec3d> a, std::span<const double> dt)
{
    size_ = P.size();
    const std::size_t padded = (size_ + lanes - 1) / lanes * lanes;
    for (std::vector<Vec3d>* x : {&P_, &v_, &lowest_, &highest_}) x->resize(padded);
    bounds_.setEmpty();
    if (size_ == 0) return;

    const Coordinates uniform = repeated(a[0]);
    Coordinates lowest, highest;
    for (std::size_t first = 0; first < size_; first += lanes) {
        const Vec3d *P0 = P.data() + first, *v0 = v.data() + first, *a0 = a.data + first;
        const double* t0 = dt.data() + first;
        Vec3d P_last[lanes], v_last[lanes], a_last[lanes];
        double t_last[lanes];
        if (size_ - first < lanes) {
            for (std::size_t p = 0; p < lanes; ++p) {
                const std::size_t i = std::min(first + p, size_ - 1);
                P_last[p] = P[i], v_last[p] = v[i], a_last[p] = a[i], t_last[p] = dt[i];
            }
            P0 = P_last, v0 = v_last, a0 = a_last, t0 = t_last;
        }
        const Coordinates x = load(P0), u = load(v0), t = tripled(t0);
        const Coordinates g = a.stride == 0 ? uniform : load(a0);
        Coordinates x1, u1, low, high;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const Doubles gain = t[k] * g[k];
            x1[k] = x[k] + t[k] * (u[k] + 0.5 * gain);
            u1[k] = u[k] + gain;
            const auto extent = PathExtent<Doubles>::of(x[k], x1[k], magnitude(0.125 * t[k] * gain));
            low[k] = extent.low;
            high[k] = extent.high;
            lowest[k] = first == 0 ? low[k] : least(lowest[k], low[k]);
            highest[k] = first == 0 ? high[k] : most(highest[k], high[k]);
        }
        store(x1, &P_[first]);
        store(u1, &v_[first]);
        store(low, &lowest_[first]);
        store(high, &highest_[first]);
    }
    Vec3d low[lanes], high[lanes];
    store(lowest, low);
    store(highest, high);
    for (std::uint32_t p = 0; p < lanes; ++p) {
        bounds_.extend(low[p]);
        bounds_.extend(high[p]);
    }
}

void FreePaths::exchange(std::span<Vec3d> P, std::span<Vec3d> v)
{
    std::swap_ranges(P.begin(), P.end(), P_.begin());
    std::swap_ranges(v.begin(), v.end(), v_.begin());
}

void FreePaths::find_near(const Box3d& box, double radius, std::vector<std::uint32_t>& near) const
{
    near.clear();
    const Box3d wide = widened(box, radius);
    if (!bounds_.intersects(wide)) return;

    const Coordinates min = repeated(wide.min()), max = repeated(wide.max());
    for (std::size_t first = 0; first < size_; first += lanes) {
        const Coordinates low = load(&lowest_[first]), high = load(&highest_[first]);
        std::uint32_t misses = 0;
        for (std::uint32_t k = 0; k < 3; ++k)
            misses |= bits(PathExtent<Doubles>{low[k], high[k]}.misses(min[k], max[k])) << lanes * k;
        std::uint32_t reach = every_point & ~any_of_point(misses);
        for (; reach != 0; reach &= reach - 1) {
            const std::size_t i = first + std::countr_zero(reach) / 3;
            if (i < size_) near.push_back(static_cast<std::uint32_t>(i));
        }
    }
}

}  // namespace rapid
