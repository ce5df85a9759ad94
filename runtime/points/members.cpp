#include "runtime/points/members.h"

namespace rapid {
namespace {

constexpr std::uint8_t every_point = 1, no_point = 0;

}  // namespace

Strided<std::uint8_t> members_of(const PointSet& points, std::string_view group)
{
    if (group.empty()) return {&every_point, 0};
    const Column<std::uint8_t>* column = points.find_group(group);
    return column ? column->read() : Strided<std::uint8_t>{&no_point, 0};
}

}  // namespace rapid
