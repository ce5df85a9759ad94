#include "runtime/graph/curve_value.h"

#include <fmt/format.h>

#include <deque>
#include <limits>
#include <mutex>
#include <tuple>

#include "runtime/graph/points_object.h"
#include "runtime/graph/value.h"
#include "runtime/points/trail.h"

namespace rapid {
namespace {

// Returns the number of points in each run of equal values of the attribute.
std::vector<std::size_t> runs_of(const PointSet& points)
{
    const auto* curve = points.find<std::int32_t>(curve_attribute);
    if (!curve) return {points.size()};
    std::vector<std::size_t> counts;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (i == 0 || (*curve)[i] != (*curve)[i - 1]) counts.push_back(0);
        ++counts.back();
    }
    return counts;
}

PointSet trails_as_curves(const PointSet& points)
{
    PointSet ordered = in_order_of_lines(with_lines(points));
    for (const AttributeSpec& column : trail_columns(Trails(points).places())) ordered.remove(column.name);
    return ordered;
}

// Returns the points of a value that is not a function.
PointSet points_in(const Param& param, const Value& value)
{
    if (const auto points = value.object<PointsObject>()) return points->points;
    if (!value.table()) wrong_type(param, value);
    std::vector<Vec3f> positions;
    rapid::read_value(param, value, positions);
    PointSet points;
    points.append(positions.size());
    points.P() = Column<Vec3f>(std::span<const Vec3f>(positions));
    return points;
}

class FunctionCurves final : public CurveFrames {
public:
    FunctionCurves(std::shared_ptr<const FrameFunction> function, bool closed)
        : function_(std::move(function)), closed_(closed)
    {
        first_ = call(FrameClock().at(1));
    }
    const CurvesPtr& first() const { return first_; }

    CurvesPtr at(const FrameClock& clock, std::int64_t frame) const override
    {
        const std::lock_guard lock(mutex_);
        const Key key{clock.fps, clock.start, frame};
        for (const auto& [known, curves] : recent_)
            if (known == key) return curves;
        CurvesPtr curves = call(clock.at(static_cast<double>(frame)));
        if (curves->lines()->after != first_->lines()->after)
            throw Error(
                fmt::format("the function of a curve returned {} points in frame {} and {} in the first, or other "
                            "lines between them; a deforming curve must keep its points",
                            curves->points().size(), frame, first_->points().size()));
        recent_.emplace_front(key, std::move(curves));
        if (recent_.size() > max_recent) recent_.pop_back();
        return recent_.front().second;
    }
    bool has(std::int64_t) const override { return true; }
    FrameRange range() const override
    {
        const double without_end = std::numeric_limits<double>::infinity();
        return {-without_end, without_end};
    }

private:
    using Key = std::tuple<double, std::int64_t, std::int64_t>;
    static constexpr std::size_t max_recent = 8;  // as for the files of a mesh

    CurvesPtr call(const Frame& frame) const
    {
        try {
            const Value value = function_->call(frame);
            Param param;
            param.name = "points";
            param.type = "list of vec3, or points";
            return curves_of(points_in(param, value), closed_, "curve");
        } catch (const Error& error) {
            throw error.reworded(fmt::format("{} (frame {})", error.message(), frame.number));
        }
    }

    std::shared_ptr<const FrameFunction> function_;
    bool closed_;
    CurvesPtr first_;
    mutable std::mutex mutex_;
    mutable std::deque<std::pair<Key, CurvesPtr>> recent_;  // most recent first
};

}  // namespace

CurvesPtr curves_of(const PointSet& points, bool closed, const std::string& name)
{
    std::vector<std::size_t> counts;
    if (Trails(points).places() > 0) return curves_of(trails_as_curves(points), closed, name);
    const auto* curve = points.find<std::int32_t>(curve_attribute);
    std::vector<std::size_t> kept;  // without the last point of a closed curve if it equals the first one
    std::size_t first = 0;
    for (const std::size_t count : runs_of(points)) {
        if (curve && (*curve)[first] < 0) {  // belongs to no line
            first += count;
            continue;
        }
        const bool repeats = closed && count > 2 && points.P()[first] == points.P()[first + count - 1];
        counts.push_back(count - repeats);
        for (std::size_t k = 0; k < counts.back(); ++k) kept.push_back(first + k);
        first += count;
    }
    std::vector<Vec3f> positions;
    for (const std::size_t i : kept) positions.push_back(points.P()[i]);
    std::map<std::string, Mesh::VertexValues> values;
    for (const auto& [attribute, any] : points.columns()) {
        if (attribute == "P" || attribute == "v" || attribute == "N") continue;
        std::visit(
            [&, &key = attribute]<class T>(const Column<T>& column) {
                if constexpr (std::is_same_v<T, float> || std::is_same_v<T, Vec3f>) {
                    std::vector<T> list;
                    for (const std::size_t i : kept) list.push_back(column[i]);
                    values.emplace(key, std::move(list));
                }
            },
            any);
    }
    return std::make_shared<Curves>(std::move(positions), counts, closed, std::move(values), name);
}

ObjectPtr CurveValue::curves(bool closed) const
{
    if (!function) return curves_of(points, closed, "curve");
    auto frames = std::make_shared<FunctionCurves>(function, closed);
    const CurvesPtr first = frames->first();
    return std::make_shared<MovingCurves>(first, std::move(frames), constant_motion({}));
}

void read_value(const Param& param, const Value& value, CurveValue& field)
{
    field = {};
    if (value.function())
        field.function = *value.get<std::shared_ptr<const FrameFunction>>();
    else
        field.points = points_in(param, value);
}

}  // namespace rapid
