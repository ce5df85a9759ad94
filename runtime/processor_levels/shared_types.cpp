#include "runtime/processor_levels/shared_types.h"

#include <fmt/format.h>

namespace rapid {

std::string layout_difference(std::span<const TypeLayout> hot, std::span<const TypeLayout> cold)
{
    if (hot.size() != cold.size()) return fmt::format("they share {} and {} types", hot.size(), cold.size());
    for (std::size_t t = 0; t < hot.size(); ++t) {
        if (hot[t] == cold[t]) continue;
        return fmt::format("{} of {} bytes aligned to {}, and {} of {} aligned to {}", hot[t].name, hot[t].size,
                           hot[t].alignment, cold[t].name, cold[t].size, cold[t].alignment);
    }
    return {};
}

}  // namespace rapid
