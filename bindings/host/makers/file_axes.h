// Parameters of makers that read files of other programs: the axis that points up there, and the unit of lengths.
#pragma once

#include <cmath>
#include <optional>
#include <string>

#include "bindings/host/maker.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/pose.h"

namespace rapid {

struct FileAxes {
    std::string up;
    double unit;

    template <class T>
    static void declare(MakerDeclaration<T>& declaration)
    {
        declaration
            .param(static_cast<std::string T::*>(&T::up), "up", std::string("y"), any_number(), "",
                   "the axis of the file that points up: \"y\" or \"z\", which becomes y")
            .choices({"y", "z"});
        declaration.param(static_cast<double T::*>(&T::unit), "unit", 1.0, above(0), "m",
                          "one length unit of the file: 0.01 for centimetres");
    }

    bool are_ours() const { return up == "y" && unit == 1; }
    // Returns the map from the file to metres with y up: z becomes y, and y becomes -z.
    Pose pose() const
    {
        Pose pose;
        if (up == "z") pose.rotation = Eigen::Quaterniond(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);
        pose.scale = unit;
        return pose;
    }

    // Maps positions, velocities, normals, turns and radii.
    void apply(PointSet& points) const
    {
        if (are_ours()) return;
        const Pose pose = this->pose();
        const auto each = [&]<class T>(const char* name, T, const auto& map) {
            if (Column<T>* column = points.find<T>(name))
                for (T& value : column->write()) value = map(value);
        };
        each("P", Vec3f(), [&](const Vec3f& P) { return Vec3f((pose * P.cast<double>()).cast<float>()); });
        for (const char* name : {"v", "N", "w"})
            each(name, Vec3f(), [&](const Vec3f& value) {
                const double scale = name[0] == 'v' ? pose.scale : 1;
                return Vec3f((scale * (pose.rotation * value.cast<double>())).cast<float>());
            });
        each("pscale", float(), [&](float radius) { return static_cast<float>(pose.scale * radius); });
        each("orient", Quatf(), [&](const Quatf& turn) { return Quatf(pose.rotation.cast<float>() * turn); });
    }
};

}  // namespace rapid
