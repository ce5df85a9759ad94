// Points from which a grid is made, as makers take them.
#pragma once

#include <memory>
#include <optional>

#include "bindings/host/maker.h"
#include "runtime/graph/points_object.h"
#include "runtime/shapes/level_set/grid_of_points.h"
#include "runtime/shapes/level_set/level_set.h"

namespace rapid {

// Parameters of a grid that is made from points; T derives from it.
struct PointsOfGrid {
    std::shared_ptr<const PointsObject> points;
    double voxel;
    std::optional<PerPoint<float>> radius;
    PerPoint<float> weight;

    template <class T>
    static void declare(MakerDeclaration<T>& declaration)
    {
        declaration
            .param(static_cast<std::shared_ptr<const PointsObject> T::*>(&T::points), "points", Value(), any_number(),
                   "", "points that are spread over the voxels")
            .required();
        declaration
            .param(static_cast<double T::*>(&T::voxel), "voxel", 0.1, at_least(min_voxel), "m", "edge of a voxel")
            .param(static_cast<std::optional<PerPoint<float>> T::*>(&T::radius), "radius", Value(), above(0), "m",
                   "radius over which a point is spread, at least a voxel; the default is 1.5 voxels")
            .param(static_cast<PerPoint<float> T::*>(&T::weight), "weight", 1.0, at_least(0), "",
                   "weight of a point; the integral of the density is the sum of the weights");
    }

    // Returns a view that refers to this object, which must outlive it.
    SpreadPoints spread() const
    {
        const PointSet& set = points->points;
        const std::size_t n = set.size();
        const Strided<Vec3f> P = set.P().read();
        positions_.clear();
        for (std::size_t i = 0; i < n; ++i) positions_.push_back(P[i]);
        usual_ = static_cast<float>(1.5 * voxel);
        const Strided<float> r = radius ? radius->read(set) : Strided<float>{&usual_, 0}, w = weight.read(set);
        return {positions_, std::span(r.data, r.stride ? n : 1), std::span(w.data, w.stride ? n : 1), {}, voxel};
    }

private:
    mutable std::vector<Vec3f> positions_;
    mutable float usual_ = 0;
};

}  // namespace rapid
