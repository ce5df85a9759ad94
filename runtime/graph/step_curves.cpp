#include "runtime/graph/step_curves.h"

#include <algorithm>

#include "runtime/shapes/motion/body_path.h"

namespace rapid {

void StepCurves::at(double time, std::vector<Vec3d>& P, std::vector<Vec3d>& v) const
{
    const double t = duration_ > 0 ? std::clamp((time - begin_) / duration_, 0.0, 1.0) : 1;
    P.resize(cubics_.size());
    v.resize(cubics_.size());
    for (std::size_t i = 0; i < cubics_.size(); ++i) {
        P[i] = cubics_[i].at(t);
        v[i] = duration_ > 0 ? Vec3d(cubics_[i].derivative(t) / duration_) : Vec3d::Zero();
    }
}

std::shared_ptr<const StepCurves> step_curves(const ObjectPtr& object, const FrameClock& clock, const Frame& frame)
{
    const auto moving = std::dynamic_pointer_cast<const MovingCurves>(object);
    if (!moving) return nullptr;
    const std::int64_t step = clock.step_at(frame);
    const bool is_start = step <= clock.start;
    const Frame end = clock.at_step(is_start ? clock.start : step), begin = clock.at_step(is_start ? step : step - 1);
    if (!moving->has(is_start ? end.number : begin.number, end.number))
        return std::make_shared<StepCurves>(nullptr, std::vector<Cubic<Vec3d>>(), begin.time, 0);

    // Deforming objects are known only at whole frames.
    FrameClock known = clock;
    if (moving->deforms()) known.subframes = 1;
    const int parts = clock.subframes / known.subframes;
    const std::int64_t last = clock.start + (step - clock.start + parts - 1) / parts;
    const FramePath path = is_start ? FramePath() : path_of(*moving, known, last, {});
    std::vector<Cubic<Vec3d>> cubics = point_curves(*moving, known, is_start ? clock.start : last, path);
    if (parts > 1 && !is_start)
        for (Cubic<Vec3d>& cubic : cubics) {
            const double from = static_cast<double>((step - 1 - clock.start) % parts) / parts;
            cubic = cubic_part(cubic, from, from + 1.0 / parts);
        }
    return std::make_shared<StepCurves>(moving->rest()->lines(), std::move(cubics), begin.time,
                                        is_start ? 0 : 1 / clock.steps_per_second());
}

}  // namespace rapid
