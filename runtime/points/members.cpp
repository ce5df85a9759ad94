#include "runtime/points/members.h"

namespace rapid {
namespace {

constexpr std::uint8_t everybody = 1, nobody = 0;

}  // namespace

Strided<std::uint8_t> members_of(const PointSet& points, std::string_view group)
{
    if (group.empty()) return {&everybody, 0};
    const Column<std::uint8_t>* column = points.find_group(group);
    return column ? column->read() : Strided<std::uint8_t>{&nobody, 0};
}

}  // namespace rapid
