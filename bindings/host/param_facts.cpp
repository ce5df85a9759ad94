#include "bindings/host/param_facts.h"

#include <fmt/format.h>

namespace rapid {

std::string facts_of(const Param& param)
{
    std::vector<std::string> facts = {param.type};
    if (!param.unit.empty()) facts.push_back(param.unit);
    if (param.range.bounded()) facts.push_back(param.range.text());
    if (!param.choices.empty()) facts.push_back(fmt::format("one of {}", fmt::join(param.choices, ", ")));
    if (param.required)
        facts.push_back("required");
    else if (!param.fallback.is_nil())
        facts.push_back("default " + describe(param.fallback));
    if (param.per_point) facts.push_back("takes rapid.attr");
    if (!param.of_the_frame && param.type.find("function") == std::string::npos) facts.push_back("constant");
    return fmt::format("[{}]", fmt::join(facts, ", "));
}

}  // namespace rapid
