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

void Hits::record(std::size_t i, const Vec3d& P, const Vec3d& n, const Vec3d& vc, double time, double impulse,
                  int collider)
{
    ++total_[i];
    ++num_[i];
    pos_[i] = P.cast<float>();
    nml_[i] = n.cast<float>();
    v_[i] = vc.cast<float>();
    time_[i] = static_cast<float>(time);
    impulse_[i] = static_cast<float>(impulse);
    path_[i] = collider;
}

}  // namespace rapid
