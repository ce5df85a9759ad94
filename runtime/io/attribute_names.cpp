#include "runtime/io/attribute_names.h"

#include <fmt/format.h>

#include <set>

namespace rapid {
namespace {

constexpr std::string_view suffixes = "xyzw";

bool is_component(const std::string& name, std::string_view stem, char suffix)
{
    return name.size() == stem.size() + 1 && name.back() == suffix && name.compare(0, stem.size(), stem) == 0;
}

}  // namespace

std::size_t component_count(AttributeType type)
{
    return std::visit([]<class T>(const Column<T>&) { return components_of<T>; },
                      column_of_type<AnyColumn>(static_cast<std::size_t>(type)));
}

std::vector<std::string> component_names(std::string_view name, std::size_t count)
{
    if (count == 1) return {std::string(name)};
    std::vector<std::string> names;
    for (std::size_t c = 0; c < count; ++c) names.push_back(std::string(name) + suffixes[c]);
    return names;
}

std::vector<JoinedColumns> join_components(std::span<const std::string> names)
{
    std::vector<JoinedColumns> joined;
    for (std::size_t i = 0; i < names.size();) {
        std::size_t count = 0;
        const std::string stem = names[i].substr(0, names[i].empty() ? 0 : names[i].size() - 1);
        while (!stem.empty() && count < suffixes.size() && i + count < names.size() &&
               is_component(names[i + count], stem, suffixes[count]))
            ++count;
        if (count < 3) count = 1;
        JoinedColumns& attribute = joined.emplace_back();
        attribute.name = count == 1 ? names[i] : stem;
        for (std::size_t c = 0; c < count; ++c) attribute.columns.push_back(i + c);
        i += count;
    }
    return joined;
}

void check_column_names(std::span<const std::string> names, std::string_view forbidden)
{
    std::set<std::string_view> seen;
    for (const std::string& name : names) {
        if (name.empty()) throw Error("a column has no name; every attribute must have one");
        const std::size_t bad = name.find_first_of(forbidden);
        if (bad != std::string::npos)
            throw Error(
                fmt::format("the name \"{}\" can't be written: this format does not allow the character '{}' in names; "
                            "rename the attribute or group",
                            name, name[bad]));
        if (!seen.insert(name).second)
            throw Error(fmt::format("two columns would be called \"{}\"; rename one of the attributes", name));
    }
}

std::vector<std::string> further_attributes(const PointSet& points)
{
    std::vector<std::string> names;
    for (const auto& [name, column] : points.columns())
        if (name != "P" && name != "v" && name != "id") names.push_back(name);
    return names;
}

}  // namespace rapid
