#include "runtime/operators/solve/air_resistance.h"

#include "runtime/points/per_point.h"
#include "runtime/solver/dynamics.h"

namespace rapid {
namespace {

class AirResistance : public Force {
public:
    AirResistance(PerPoint<float> rate, PerPoint<Vec3f> velocity)
        : rate_(std::move(rate)), velocity_(std::move(velocity))
    {
    }

    std::optional<Uniform> uniform() const override
    {
        if (!rate_.attribute.empty() || !velocity_.attribute.empty()) return std::nullopt;
        Uniform drag;
        drag.linear.k = rate_.constant;
        drag.linear.ku = drag.linear.k * velocity_.constant.cast<double>();
        return drag;
    }

    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        const Strided<float> k = chunk.read(rate_);
        const Strided<Vec3f> u = chunk.read(velocity_);
        for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_drag(i, k[i], u[i].cast<double>());
    }

private:
    PerPoint<float> rate_;
    PerPoint<Vec3f> velocity_;
};

// What all points share is a constant.
template <class T>
PerPoint<T> parameter_of(const PointSet& points, const char* name)
{
    const Column<T>* column = points.find<T>(name);
    if (!column) return {};
    return column->is_uniform() ? PerPoint<T>((*column)[0]) : PerPoint<T>::of(name);
}

}  // namespace

std::shared_ptr<const Force> air_resistance_of(const PointSet& points, const Evaluation& now)
{
    PerPoint<float> rate = parameter_of<float>(points, "airresist");
    if (rate.attribute.empty() && rate.constant == 0) return nullptr;
    return dynamic_of<AirResistance>(now, "", std::move(rate), parameter_of<Vec3f>(points, "targetv"));
}

}  // namespace rapid
