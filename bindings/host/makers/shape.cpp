// rapid.shape: a maker for each analytic shape in the library.
#include <fmt/format.h>

#include "bindings/host/maker.h"
#include "runtime/shapes/analytic/shape_type.h"

namespace rapid {
namespace {

using Values = std::vector<ShapeValue>;

Param param_of(const ShapeParam& declared, std::size_t index)
{
    Param param;
    param.name = declared.name;
    param.unit = declared.unit;
    param.doc = declared.doc;
    std::visit(
        [&](const auto& fallback) {
            using T = std::decay_t<decltype(fallback)>;
            param.type = param_type<T>();
            param.fallback = fallback;
            if (std::is_same_v<T, double> && declared.positive) param.range = above(0);
            param.assign = [index](const Param& self, void* values, const Value& value) {
                read_value(self, value, (*static_cast<Values*>(values))[index].template emplace<T>());
            };
        },
        declared.fallback);
    return param;
}

void require_positive_edges(const ShapeParam& param, const ShapeValue& value)
{
    const auto* edges = std::get_if<Vec3d>(&value);
    if (edges && param.positive && !(edges->minCoeff() > 0))
        throw Error(fmt::format("{} = {}: each edge must be above 0", param.name, describe(Value(*edges))));
}

Maker shape_maker(const ShapeType& type)
{
    Maker maker;
    maker.name = "shape." + type.name;
    maker.doc = type.doc;
    for (const ShapeParam& param : type.params) maker.params.push_back(param_of(param, maker.params.size()));
    maker.make = [type](const Maker& self, const Table& arguments, MakeContext&) -> ObjectPtr {
        Values values(type.params.size());
        assign_arguments(self.params, arguments.named, &values);
        for (std::size_t i = 0; i < values.size(); ++i) require_positive_edges(type.params[i], values[i]);
        return type.make(values);
    };
    return maker;
}

std::vector<Maker> shape_makers()
{
    std::vector<Maker> makers;
    for (const ShapeType& type : shape_types()) makers.push_back(shape_maker(type));
    return makers;
}
RAPID_MAKERS(shape_makers);

}  // namespace
}  // namespace rapid
