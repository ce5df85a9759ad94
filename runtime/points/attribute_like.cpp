#include "runtime/points/attribute_like.h"

namespace rapid {

const AttributeSpec* conventional_attribute(std::string_view name)
{
    static const std::vector<AttributeSpec> usual = {
        {"Alpha", 1.0f},
        {"Cd", Vec3f(Vec3f::Ones())},
        {"N", Vec3f(Vec3f::Zero())},
        {"instance", std::int32_t{0}},
        {"orient", Quatf(Quatf::Identity())},
        {"scale", Vec3f(Vec3f::Ones())},
    };
    for (const AttributeSpec& spec : usual)
        if (spec.name == name) return &spec;
    return nullptr;
}

AttributeSpec attribute_like(const std::string& name, const AttributeValue& like)
{
    if (const AttributeSpec* known = known_attribute(name)) return *known;
    if (const AttributeSpec* usual = conventional_attribute(name); usual && type_of(usual->fallback) == type_of(like))
        return *usual;
    return {name, std::visit([](const auto& v) -> AttributeValue { return Column<std::decay_t<decltype(v)>>::zero(); },
                             like)};
}

}  // namespace rapid
