#include "runtime/graph/selection.h"

#include <algorithm>

namespace rapid {
namespace {

std::vector<std::uint8_t> members_of(const PointSet& points, std::string_view group)
{
    std::vector<std::uint8_t> members(points.size(), 0);
    const Column<std::uint8_t>* column = points.find_group(group);
    if (!column) return members;
    const Strided<std::uint8_t> member = column->read();
    for (std::size_t i = 0; i < members.size(); ++i) members[i] = member[i];
    return members;
}

}  // namespace

std::vector<std::uint8_t> select(const PointSet& points, std::string_view group, const PointFunction* where,
                                 const Evaluation& now)
{
    std::vector<std::uint8_t> selected =
        group.empty() ? std::vector<std::uint8_t>(points.size(), 1) : members_of(points, group);
    if (!where) return selected;

    const auto members = static_cast<std::size_t>(std::count(selected.begin(), selected.end(), 1));
    if (members == points.size()) {
        where->test(points, now, selected);
        return selected;
    }
    PointSet asked = points;
    asked.keep(selected);
    std::vector<std::uint8_t> answers(members);
    where->test(asked, now, answers);
    auto answer = answers.begin();
    for (std::uint8_t& one : selected)
        if (one) one = *answer++;
    return selected;
}

}  // namespace rapid
