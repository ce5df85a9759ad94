#include "runtime/graph/frame_set.h"

#include <fmt/format.h>

#include <cmath>

namespace rapid {

void read_value(const Param& param, const Value& value, FrameSet& field)
{
    std::vector<double> numbers;
    read_value(param, value, numbers);
    field.frames.clear();
    for (const double number : numbers) {
        if (number != std::floor(number))
            throw Error(fmt::format("{} has the frame {}; frames must be whole numbers", param.name, number));
        field.frames.insert(static_cast<std::int64_t>(number));
    }
}

}  // namespace rapid
