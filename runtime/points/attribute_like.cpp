#include "runtime/points/attribute_like.h"

namespace rapid {

AttributeSpec attribute_like(const std::string& name, const AttributeValue& like)
{
    if (const AttributeSpec* known = known_attribute(name)) return *known;
    if (name == "Cd" && std::holds_alternative<Vec3f>(like))
        return {name, Vec3f(Vec3f::Ones())};  // white, as in Houdini
    return {name, std::visit([](const auto& v) -> AttributeValue { return Column<std::decay_t<decltype(v)>>::zero(); },
                             like)};
}

}  // namespace rapid
