#include "runtime/solver/collision/hits.h"

#include <algorithm>

namespace rapid {

Hits::Hits(PointSet& points, bool begins_frame)
    : impulse_(points.column<float>("hitimpulse").write()),
      time_(points.column<float>("hittime").write()),
      nml_(points.column<Vec3f>("hitnml").write()),
      pos_(points.column<Vec3f>("hitpos").write()),
      v_(points.column<Vec3f>("hitv").write()),
      num_(points.column<std::int32_t>("hitnum").write()),
      path_(points.column<std::int32_t>("hitpath").write()),
      total_(points.column<std::int32_t>("hittotal").write())
{
    if (begins_frame) std::fill(num_.begin(), num_.end(), 0);
}

void Hits::record(std::size_t point, int collider, const Impact& impact, double impulse)
{
    ++total_[point];
    ++num_[point];
    pos_[point] = impact.P.cast<float>();
    nml_[point] = impact.n.cast<float>();
    v_[point] = impact.vc.cast<float>();
    time_[point] = static_cast<float>(impact.time);
    impulse_[point] = static_cast<float>(impulse);
    path_[point] = collider;
}

}  // namespace rapid
