#include "runtime/graph/selection.h"

#include <cstring>

#include "runtime/points/members.h"

namespace rapid {

Selection::Selection(const PointSet& points, std::string group, const PointFunction* where, const Evaluation& now,
                     const Before& before)
    : points_(points), group_(std::move(group)), before_(before), test_(where ? where->test_of(points, now) : nullptr)
{
}

void Selection::begin()
{
    members_ = members_of(points_, group_);
    const bool all = members_.stride == 0 && members_[0] && !before_.removals;
    if (test_) test_->begin(all);
}

std::vector<std::uint8_t> Selection::of(const Stretch& stretch) const
{
    std::vector<std::uint8_t> selected = stretch.choose(members_);
    const bool any = std::memchr(selected.data(), 1, selected.size()) != nullptr;
    if (test_ && any) test_->test(stretch.begin, selected);
    return selected;
}

}  // namespace rapid
