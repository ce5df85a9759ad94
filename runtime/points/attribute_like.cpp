#include "runtime/points/attribute_like.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/base/error.h"
#include "runtime/points/point_names.h"

namespace rapid {

const AttributeSpec* conventional_attribute(std::string_view name)
{
    static const std::vector<AttributeSpec> usual = {
        {"Alpha", 1.0f},
        {"Cd", Vec3f(Vec3f::Ones())},
        {"N", Vec3f(Vec3f::Zero())},
        {"curve", std::int32_t{-1}},
        {"instance", std::int32_t{0}},
        {"name", Token()},
        {"orient", Quatf(Quatf::Identity())},
        {"scale", Vec3f(Vec3f::Ones())},
    };
    for (const AttributeSpec& spec : usual)
        if (spec.name == name) return &spec;
    return nullptr;
}

std::string advice_for_making(const std::string& name, int numbers)
{
    const AttributeSpec* usual = conventional_attribute(name);
    if (!usual) usual = known_attribute(name);
    if (!usual) return name + (numbers == 3 ? " = {0, 0, 0}" : numbers == 4 ? " = {0, 0, 0, 1}" : " = 0");
    // Every node already has a parameter of this name.
    if (type_of(usual->fallback) == AttributeType::String) return fmt::format("attributes = {{ {} = \"\" }}", name);
    const auto list = [&](const auto& value, auto... k) {
        std::string text;
        ((text += fmt::format("{}{:g}", text.empty() ? "" : ", ", value[k])), ...);
        return fmt::format("{} = {{{}}}", name, text);
    };
    if (const auto* vector = std::get_if<Vec3f>(&usual->fallback)) return list(*vector, 0, 1, 2);
    if (const auto* turn = std::get_if<Quatf>(&usual->fallback)) return list(turn->coeffs(), 0, 1, 2, 3);
    if (const auto* whole = std::get_if<std::int32_t>(&usual->fallback)) return fmt::format("{} = {}", name, *whole);
    const auto* number = std::get_if<float>(&usual->fallback);
    return fmt::format("{} = {:g}", name, !number ? 0 : std::isfinite(*number) ? *number : 1);
}

std::string_view name_of_synonym(std::string_view word)
{
    static const std::map<std::string_view, std::string_view> names = {
        {"alpha", "Alpha"},     {"col", "Cd"},        {"color", "Cd"},      {"colour", "Cd"},
        {"normal", "N"},        {"lifespan", "life"}, {"lifetime", "life"}, {"opacity", "Alpha"},
        {"pos", "P"},           {"position", "P"},    {"radius", "pscale"}, {"rgb", "Cd"},
        {"rotation", "orient"}, {"size", "pscale"},   {"vel", "v"},         {"velocity", "v"},
    };
    const auto found = names.find(word);
    return found == names.end() ? std::string_view() : found->second;
}

std::string no_attribute(const std::string& name, const std::vector<std::string>& names, int numbers)
{
    if (const PointName* computed = find_point_name(name); computed && computed->role == PointName::Field)
        return fmt::format(
            "\"{0}\" is not an attribute; only kernels compute p.{0}; copy it into an attribute: :points(\"NAME\", "
            "function(p) p.heat = p.{0} end)",
            name);
    if (const std::string known(name_of_synonym(name)); !known.empty()) {
        const bool is_there = std::find(names.begin(), names.end(), known) != names.end();
        const std::string remedy =
            is_there ? "" : fmt::format(": add :attribute{{ {} }} before it", advice_for_making(known));
        return fmt::format("no attribute \"{}\"; the {} of points is {}{}", name, name, known, remedy);
    }
    const std::string near = conventional_attribute(name) || known_attribute(name) ? "" : nearest_name(name, names);
    const std::string made = advice_for_making(name, numbers);
    return near.empty() ? fmt::format("no attribute \"{}\"; add :attribute{{ {} }} before it", name, made)
                        : fmt::format("no attribute \"{}\"; did you mean \"{}\"? (or add :attribute{{ {} }} before it)",
                                      name, near, made);
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
