#include "runtime/operators/emit/point_path.h"

#include <cmath>

#include "runtime/points/id_index.h"

namespace rapid {
namespace {

class PointCurves final : public BodyPath {
public:
    explicit PointCurves(std::vector<Cubic<Vec3d>> curves) : curves_(std::move(curves)) {}

    void carry(std::span<const double> t, bool, std::span<Birthplace> births, std::span<Vec3d> velocity) const override
    {
        for (std::size_t i = 0; i < births.size(); ++i) {
            const Cubic<Vec3d>& curve = curves_[static_cast<std::size_t>(births[i].element)];
            births[i].P = curve.at(t[i]).cast<float>();
            velocity[i] = curve.derivative(t[i]);
        }
    }

private:
    std::vector<Cubic<Vec3d>> curves_;  // by point
};

// v counts as the rate of change where the ways that it predicts are off by less than this part of the ways gone.
constexpr double most_off = 0.5;

bool is_rate_of_change(const PointSet& now, const PointSet& before, std::span<const std::uint32_t> place, double dt)
{
    double off = 0, way = 0;
    for (std::size_t i = 0; i < place.size(); ++i) {
        if (place[i] == IdIndex::none) continue;
        const Vec3d d = now.P()[i].cast<double>() - before.P()[place[i]].cast<double>();
        const Vec3d mean = 0.5 * (now.v()[i].cast<double>() + before.v()[place[i]].cast<double>());
        off += (d - dt * mean).squaredNorm();
        way += d.squaredNorm();
    }
    return way > 0 && off <= most_off * most_off * way;
}

}  // namespace

PointPath point_path(const PointSet& now, const PointSet& before, const PointSet* earlier, bool straight, double dt)
{
    PointPath result;
    const IdIndex index(before.id());
    const std::optional<IdIndex> index_earlier =
        earlier ? std::optional<IdIndex>(std::in_place, earlier->id()) : std::nullopt;
    std::vector<std::uint32_t> place(now.size());
    for (std::size_t i = 0; i < place.size(); ++i) {
        place[i] = index[now.id()[i]];
        result.unmatched += place[i] == IdIndex::none;
    }
    result.follows_v = is_rate_of_change(now, before, place, dt);

    std::vector<Cubic<Vec3d>> curves(now.size());
    const Vec3d none = Vec3d::Zero();
    for (std::size_t i = 0; i < curves.size(); ++i) {
        const Vec3d P = now.P()[i].cast<double>(), m = dt * now.v()[i].cast<double>();
        if (place[i] == IdIndex::none) {
            const bool goes = result.follows_v || result.unmatched == now.size();
            curves[i] = goes ? Cubic<Vec3d>{P - m, m, none, none} : Cubic<Vec3d>{P, none, none, none};
            continue;
        }
        const Vec3d P0 = before.P()[place[i]].cast<double>(), d = P - P0;
        Vec3d m0 = d, m1 = d;
        const std::uint32_t third = index_earlier ? (*index_earlier)[now.id()[i]] : IdIndex::none;
        if (straight) {
        } else if (result.follows_v) {
            m0 = dt * before.v()[place[i]].cast<double>();
            m1 = m;
        } else if (third != IdIndex::none) {
            const Vec3d d0 = P0 - earlier->P()[third].cast<double>();
            m0 = 0.5 * (d0 + d);
            m1 = 0.5 * (3 * d - d0);
        }
        curves[i] = {P0, m0, 3 * d - 2 * m0 - m1, m0 + m1 - 2 * d};
    }
    result.path = std::make_shared<PointCurves>(std::move(curves));
    return result;
}

}  // namespace rapid
