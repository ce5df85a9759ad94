// Reads a motion from a graph's value: an object, a function of the frame, or keys.
#include <fmt/format.h>

#include "runtime/graph/param.h"
#include "runtime/graph/point_function.h"
#include "runtime/shapes/motion/motion.h"

namespace rapid {
namespace {

class FunctionMotion final : public Motion {
public:
    FunctionMotion(std::string name, std::shared_ptr<const FrameFunction> function)
        : name_(std::move(name)), function_(std::move(function))
    {
    }

    Pose at(const Frame& frame) const override
    {
        try {
            const Value value = function_->call(frame);
            if (const auto motion = value.object<Motion>()) return motion->at(frame);
            throw Error(
                fmt::format("{} is a function that returned {}; it must return a motion: rapid.translate, "
                            "rapid.rotate, rapid.scale, or a product",
                            name_, describe(value)));
        } catch (const Error& error) {
            Error placed = error.reworded(fmt::format("{} (frame {})", error.message(), frame.number));
            if (const auto* written = dynamic_cast<const Located*>(function_.get())) placed.at(written->location());
            throw placed;
        }
    }

    FrameRange range() const override
    {
        const double without_end = std::numeric_limits<double>::infinity();
        return {-without_end, without_end};
    }

private:
    std::string name_;
    std::shared_ptr<const FrameFunction> function_;
};

MotionPtr key(const Param& param, std::int64_t frame, const Value& value)
{
    MotionPtr motion = value.object<Motion>();
    if (!motion || motion->varies())
        throw Error(
            fmt::format("{}[{}] = {} can't be a key; keys must be constant motions: rapid.translate, rapid.rotate, "
                        "rapid.scale, or a product",
                        param.name, frame, motion ? "a motion that varies" : describe(value)));
    return motion;
}

}  // namespace

void read_value(const Param& param, const Value& value, MotionPtr& field)
{
    if (value.is_nil()) return field.reset();
    if (value.function()) {
        field = std::make_shared<FunctionMotion>(param.name, *value.get<std::shared_ptr<const FrameFunction>>());
        return;
    }
    const Table* table = value.table();
    if (!table) {
        field = value.object<Motion>();
        if (!field) wrong_type(param, value);
        return;
    }
    if (!table->named.empty()) wrong_type(param, value);
    std::map<std::int64_t, Pose> keys;
    std::map<std::int64_t, Turns> turns;
    const auto add = [&](std::int64_t frame, const Value& given) {
        const MotionPtr motion = key(param, frame, given);
        keys[frame] = motion->at({});
        if (const std::optional<Turns> known = turns_of(*motion)) turns[frame] = *known;
    };
    for (std::size_t i = 0; i < table->list.size(); ++i) add(static_cast<std::int64_t>(i) + 1, table->list[i]);
    for (const auto& [frame, given] : table->numbered) add(frame, given);
    field = keyed_motion(std::move(keys), std::move(turns));
}

}  // namespace rapid
