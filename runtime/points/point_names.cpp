#include "runtime/points/point_names.h"

namespace rapid {

std::vector<std::string> point_names_of(PointName::Role role)
{
    std::vector<std::string> names;
    for (const PointName& known : point_names)
        if (known.role == role) names.emplace_back(known.name);
    return names;
}

}  // namespace rapid
