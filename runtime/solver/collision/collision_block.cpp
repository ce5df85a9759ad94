#include "runtime/solver/collision/collision_block.h"

#include <algorithm>

namespace rapid {

bool StuckColumns::are_needed(const Dynamics& dynamics)
{
    return std::any_of(dynamics.colliders().begin(), dynamics.colliders().end(), [](const auto& collider) {
        return collider->response == Response::Stick || (collider->response == Response::Slide && collider->adhesion);
    });
}

void StuckColumns::add_to(PointSet& points)
{
    for (const char* name : {"stuckface", "stuckto"})
        if (!points.has(name)) points.add({name, std::int32_t{0}});
    for (const char* name : {"stuckP", "stuckat"})
        if (!points.has(name)) points.add({name, Vec3f(Vec3f::Zero())});
}

void StuckColumns::remove_from(PointSet& points)
{
    for (const char* name : names) points.remove(name);
}

StuckColumns::StuckColumns(PointSet& points)
    : to(points.column<std::int32_t>("stuckto").write()),
      face(points.column<std::int32_t>("stuckface").write()),
      at(points.column<Vec3f>("stuckat").write()),
      P(points.column<Vec3f>("stuckP").write())
{
}

}  // namespace rapid
