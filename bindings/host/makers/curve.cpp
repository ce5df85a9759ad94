// rapid.curve: polylines, at rest or moving.
#include <fmt/format.h>

#include <deque>
#include <map>
#include <mutex>

#include "bindings/host/maker.h"
#include "bindings/host/makers/sequence_options.h"
#include "runtime/graph/curve_value.h"
#include "runtime/io/format.h"

namespace rapid {
namespace {

CurvesPtr read_curves(const std::filesystem::path& file, bool closed)
{
    try {
        return curves_of(read_points(file), closed, file.string());
    } catch (Error& error) {
        throw error.at({file.string(), 0});
    }
}

struct CurveFrom {
    CurveValue points;
    bool closed;

    static Maker declare()
    {
        return maker<CurveFrom>("curve.from", "Returns a curve through positions, which may deform.")
            .param(&CurveFrom::points, "points", Value(), any_number(), "m",
                   "list of positions {{x, y, z}, ...}, points, or a function of the frame that returns either, always "
                   "with the same number")
            .required()
            .param(&CurveFrom::closed, "closed", false, any_number(), "", "connects the last point to the first");
    }
    ObjectPtr make(MakeContext&) const { return points.curves(closed); }
};
RAPID_MAKER(CurveFrom);

// Curves with a file for each frame, all with the same number of points and lines.
class CurveFiles final : public CurveFrames {
public:
    CurveFiles(std::map<int, std::filesystem::path> files, std::string name, FrameSequence order, bool closed)
        : files_(std::move(files)), name_(std::move(name)), order_(order), closed_(closed)
    {
        order_.first = files_.begin()->first;
        order_.last = files_.rbegin()->first;
        for (std::int64_t frame = order_.first; frame <= order_.last; ++frame)
            if (!files_.count(static_cast<int>(frame)))
                throw Error(fmt::format("frame {} of \"{}\" is missing; each frame from {} to {} needs a file", frame,
                                        name_, order_.first, order_.last));
        first_ = read(static_cast<int>(order_.first));
    }
    const CurvesPtr& first() const { return first_; }

    CurvesPtr at(const FrameClock&, std::int64_t frame) const override
    {
        const std::int64_t nearest = std::clamp(frame - order_.offset, order_.first, order_.last);
        const int held = static_cast<int>(order_.file_of(frame).value_or(nearest));
        const std::lock_guard lock(mutex_);
        for (const auto& [number, curves] : recent_)
            if (number == held) return curves;
        recent_.emplace_front(held, read(held));
        if (recent_.size() > max_recent) recent_.pop_back();
        return recent_.front().second;
    }
    bool has(std::int64_t frame) const override { return order_.file_of(frame).has_value(); }
    FrameRange range() const override
    {
        return order_.first < order_.last ? FrameRange{order_.begins(), order_.ends()} : FrameRange();
    }

private:
    static constexpr std::size_t max_recent = 8;  // the same as for files of a mesh

    CurvesPtr read(int frame) const
    {
        CurvesPtr curves = read_curves(files_.at(frame), closed_);
        if (first_ && curves->lines()->after != first_->lines()->after)
            throw Error(
                fmt::format("\"{}\" changes at frame {}: it has {} points there and {} at frame {}, or other lines "
                            "between them; a deforming curve must keep its points",
                            name_, frame, curves->points().size(), first_->points().size(), order_.first));
        return curves;
    }

    std::map<int, std::filesystem::path> files_;
    std::string name_;
    FrameSequence order_;
    bool closed_;
    CurvesPtr first_;
    mutable std::mutex mutex_;
    mutable std::deque<std::pair<int, CurvesPtr>> recent_;  // most recent first
};

struct ReadCurve : SequenceOptions {
    std::string path;
    bool closed;

    static Maker declare()
    {
        auto declaration =
            maker<ReadCurve>("curve.read", "Reads curves from a file of points: the lines of an .obj, or all points.");
        declaration
            .param(&ReadCurve::path, "path", Value(), any_number(), "",
                   "path, relative to the graph file; with #### or $F4 a file for each frame, for a curve that deforms")
            .required()
            .param(&ReadCurve::closed, "closed", false, any_number(), "", "connects the last point to the first");
        return SequenceOptions::declare(declaration);
    }
    ObjectPtr make(MakeContext& context) const
    {
        const auto pattern = FramePattern::of_files(context.folder / path);
        check(path, pattern.has_frame());
        if (!pattern.has_frame()) return read_curves(context.resolve(path), closed);
        const auto files = existing_files(pattern);
        if (context.on_read)
            for (const auto& [frame, file] : files) context.on_read(file);
        auto frames = std::make_shared<CurveFiles>(files, pattern.text(), order(), closed);
        const CurvesPtr first = frames->first();
        return std::make_shared<MovingCurves>(first, std::move(frames), constant_motion({}));
    }
};
RAPID_MAKER(ReadCurve);

}  // namespace
}  // namespace rapid
