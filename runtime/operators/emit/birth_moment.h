// The parameter `birth` of emit: when in the frame's interval points are born, or a function that edits each newborn
// point, which is then born at a random time.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "runtime/graph/param.h"
#include "runtime/graph/point_editor.h"
#include "runtime/graph/point_function.h"

namespace rapid {

struct BirthMoment {
    // Functions are made kernels by the host of the scripting language, as the end of this says.
    static constexpr std::string_view param_type = "moment or function of a point";

    std::string when = "random";
    // Null where there is none; the same function.
    std::shared_ptr<const PointFunction> function;
    std::shared_ptr<const PointEditor> edit;
};

inline void read_value(const Param& param, const Value& value, BirthMoment& field)
{
    field = {};
    field.function = value.object<PointFunction>();
    if ((field.edit = std::dynamic_pointer_cast<const PointEditor>(field.function))) return;
    if (!value.get<std::string>()) wrong_type(param, value);
    read_value(param, value, field.when);
}

}  // namespace rapid
