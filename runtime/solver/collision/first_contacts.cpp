#include "runtime/solver/collision/first_contacts.h"

namespace rapid {

void FirstContacts::query(std::size_t obstacle)
{
    if (queried_.empty()) return;
    answers_.resize(queried_.size());
    block_.obstacles[obstacle].shape->first_contact(paths_, answers_);
    for (std::size_t j = 0; j < queried_.size(); ++j) {
        const std::uint32_t i = queried_[j];
        if (answers_[j].time == Contact::none) continue;
        if (!has(i))
            found_.push_back(i);
        else if (!(answers_[j].time < contact_[i].time))
            continue;
        obstacle_[i] = static_cast<int>(obstacle);
        contact_[i] = answers_[j];
    }
    queried_.clear();
    paths_.clear();
}

}  // namespace rapid
