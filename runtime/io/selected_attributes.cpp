#include "runtime/io/selected_attributes.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {

PointSet select_attributes(const PointSet& points, const std::vector<std::string>& names)
{
    for (const std::string& name : names)
        if (!points.has(name) && !points.find_group(name)) {
            std::vector<std::string> known = points.column_names();
            for (const std::string& group : points.group_names()) known.push_back(group);
            throw Error(
                fmt::format("there is no attribute or group \"{}\" to write{}", name, did_you_mean(name, known)));
        }
    const auto is_requested = [&](const std::string& name) {
        return name == "P" || name == "v" || name == "id" || std::find(names.begin(), names.end(), name) != names.end();
    };
    PointSet selected = points;
    for (const std::string& name : points.column_names())
        if (!is_requested(name)) selected.remove(name);
    for (const std::string& name : points.group_names())
        if (!is_requested(name)) selected.remove_group(name);
    return selected;
}

}  // namespace rapid
