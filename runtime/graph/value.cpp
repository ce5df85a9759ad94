#include "runtime/graph/value.h"

#include <fmt/format.h>

namespace rapid {
namespace {

// Messages have one line, so longer tables end in "...".
constexpr std::size_t entries_shown = 6;

std::string describe_object(const ObjectPtr& object)
{
    if (!object) return "nil";
    const std::string_view kind = object->kind();
    if (kind == "points") return "points";
    return fmt::format("{} {}", std::string_view("aeiou").find(kind.front()) == std::string_view::npos ? "a" : "an",
                       kind);
}

std::string describe_table(const Table& table)
{
    std::vector<std::string> entries;
    for (const Value& value : table.list) entries.push_back(describe(value));
    for (const auto& [key, value] : table.numbered) entries.push_back(fmt::format("[{}] = {}", key, describe(value)));
    for (const auto& [key, value] : table.named) entries.push_back(fmt::format("{} = {}", key, describe(value)));
    if (entries.size() > entries_shown) {
        entries.resize(entries_shown);
        entries.push_back("...");
    }
    return fmt::format("{{{}}}", fmt::join(entries, ", "));
}

struct Describe {
    std::string operator()(std::monostate) const { return "nil"; }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(double value) const { return fmt::format("{}", value); }
    std::string operator()(const std::string& value) const { return fmt::format("\"{}\"", value); }
    std::string operator()(const Vec3d& value) const
    {
        return fmt::format("{{{}, {}, {}}}", value[0], value[1], value[2]);
    }
    std::string operator()(const AttributeRef& value) const { return fmt::format("rapid.attr \"{}\"", value.name); }
    std::string operator()(const std::shared_ptr<const Table>& value) const { return describe_table(*value); }
    std::string operator()(const ObjectPtr& value) const { return describe_object(value); }
    std::string operator()(const std::shared_ptr<const FrameFunction>&) const { return "a function"; }
};

}  // namespace

std::string describe(const Value& value)
{
    return std::visit(
        Describe(),
        static_cast<const std::variant<std::monostate, bool, double, std::string, Vec3d, AttributeRef,
                                       std::shared_ptr<const Table>, ObjectPtr, std::shared_ptr<const FrameFunction>>&>(
            value));
}

}  // namespace rapid
