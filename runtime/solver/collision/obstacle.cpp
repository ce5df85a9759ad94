#include "runtime/solver/collision/obstacle.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "runtime/points/members.h"
#include "runtime/solver/collision/distance_query.h"

namespace rapid {
namespace {

// Returns the FNV-1a hash, above 0.
std::int32_t key_of(std::string_view node)
{
    std::uint32_t hash = 0x811c9dc5u;
    for (const char c : node) hash = (hash ^ static_cast<unsigned char>(c)) * 0x01000193u;
    return static_cast<std::int32_t>(hash >> 1 | 1);
}

bool is_zero_for_all(const PerPoint<float>& parameter)
{
    return parameter.attribute.empty() && parameter.constant == 0;
}

Strided<float> adhesion_of(const Collider& collider, const PointSet& points)
{
    static constexpr float none = 0, endless = std::numeric_limits<float>::infinity();
    if (collider.adhesion) return collider.adhesion->read(points);
    return {collider.response == Response::Stick ? &endless : &none, 0};
}

}  // namespace

Obstacle::Obstacle(const Collider& collider, const PointSet& points, Strided<float> radius_of_points)
    : shape(collider.shape.get()),
      bounds(shape->bounds()),
      feature(shape->smallest_feature()),
      moves(shape->moves()),
      body(dynamic_cast<const MovingBody*>(shape)),
      plane(shape->half_space()),
      method(collider.method),
      response(collider.response),
      record(collider.record),
      bounce(collider.bounce.read(points)),
      friction(collider.friction.read(points)),
      radius(radius_of_points),
      adhesion(adhesion_of(collider, points)),
      viscosity(collider.viscosity.read(points)),
      key(key_of(collider.node)),
      members(members_of(points, collider.group)),
      adheres_(collider.adhesion && !is_zero_for_all(*collider.adhesion)),
      flows_(!is_zero_for_all(collider.viscosity))
{
}

double Obstacle::largest_radius(std::span<const std::uint32_t> points) const
{
    float largest = 0;
    for (std::size_t i = 0; i < (radius.stride ? points.size() : 1); ++i)
        largest = std::max(largest, radius[points[i]]);
    return largest;
}

Vec3d Obstacle::normal_at(const Vec3d& P, double time) const
{
    double phi = 0;
    Vec3d gradient = Vec3d::Zero();
    shape->distance_at({&P, 1}, {&time, 1}, {&phi, 1}, {&gradient, 1});
    return gradient.normalized();
}

void keep_outside(std::span<const Obstacle> obstacles, std::span<const std::uint32_t> points, std::span<const Vec3d> P,
                  std::span<std::uint8_t> marks)
{
    DistanceQuery query;
    for (const Obstacle& obstacle : obstacles) {
        query.clear();
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (!marks[i] || !obstacle.members[points[i]]) continue;
            const Vec3d x = P[i].cast<float>().cast<double>();
            if (obstacle.is_clear_of(x, obstacle.radius[points[i]])) continue;
            query.add(i, x);
        }
        if (query.empty()) continue;
        query.find_distances(*obstacle.shape);
        for (std::size_t j = 0; j < query.size(); ++j)
            if (!(query.phi[j] > obstacle.radius[points[query.point[j]]])) marks[query.point[j]] = 0;
    }
}

// v+ = vc + vt max(0, 1 - μ (1 + ε) |vn| / |vt|) - ε vn,   vn = ((v - vc)·n) n,   vt = (v - vc) - vn
//
// The paper prints (4) with v instead of v - vc, which holds only for shapes at rest. The impulse along n is m (1 + ε)
// |vn|, so Coulomb friction takes at most μ times that from the tangent; the max with 0 is static friction.
Vec3d contact_response(const Vec3d& v, const Vec3d& vc, const Vec3d& n, double bounce, double friction)
{
    const Vec3d relative = v - vc;
    const double approach = -relative.dot(n);  // |vn| of a closing pair
    if (approach <= 0) return v;

    const Vec3d vt = relative + approach * n;
    const double slide = vt.norm();
    const double lost = friction * (1 + bounce) * approach;
    const double kept = slide > lost ? 1 - lost / slide : 0;
    return vc + kept * vt + bounce * approach * n;
}

}  // namespace rapid
