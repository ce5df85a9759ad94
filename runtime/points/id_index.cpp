#include "runtime/points/id_index.h"

#include <algorithm>

namespace rapid {

IdIndex::IdIndex(const Column<std::int64_t>& ids) : ids_(ids.read()), size_(ids.size())
{
    bool ascend = true;
    for (std::size_t i = 1; i < size_; ++i) ascend &= ids_[i - 1] < ids_[i];
    if (ascend) return;
    sorted_.resize(size_);
    for (std::size_t i = 0; i < size_; ++i) sorted_[i] = {ids_[i], static_cast<std::uint32_t>(i)};
    std::sort(sorted_.begin(), sorted_.end());
}

std::uint32_t IdIndex::operator[](std::int64_t id) const
{
    if (sorted_.empty()) return find_ascending(id);
    const auto found = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair(id, std::uint32_t{0}));
    return found != sorted_.end() && found->first == id ? found->second : none;
}

std::uint32_t IdIndex::find_ascending(std::int64_t id) const
{
    if (size_ > 0) {  // ids are consecutive as long as no point has died
        const auto nth = static_cast<std::uint64_t>(id) - static_cast<std::uint64_t>(ids_[0]);
        if (nth < size_ && ids_[nth] == id) return static_cast<std::uint32_t>(nth);
    }
    const std::size_t at = first_not_below(ids_, 0, size_, id);
    return at < size_ && ids_[at] == id ? static_cast<std::uint32_t>(at) : none;
}

}  // namespace rapid
