// The analytic shapes by name. Each declares itself and its parameters in its own file. This makes it available to
// scenes as `rapid.shape.NAME`, with checks, documentation and completion:
//
//   struct SphereType {
//       double radius;
//       Vec3d center;
//
//       static ShapeType declare()
//       {
//           return shape_type<SphereType>("sphere", "Returns a sphere.")
//               .length(&SphereType::radius, "radius", 1.0, "radius of the sphere")
//               .param(&SphereType::center, "center", Vec3d(0, 0, 0), "m", "centre");
//       }
//       ShapePtr make() const { return make_sphere_shape(radius, center); }
//   };
//   RAPID_SHAPE(SphereType);
#pragma once

#include <functional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "runtime/shapes/shape.h"

namespace rapid {

using ShapeValue = std::variant<double, Vec3d>;

struct ShapeParam {
    std::string name, unit, doc;
    ShapeValue fallback;
    bool positive = false;  // the number, or each component, must be above 0
};

struct ShapeType {
    std::string name, doc;
    std::vector<ShapeParam> params;
    // values: in the order of `params`.
    std::function<ShapePtr(std::span<const ShapeValue> values)> make;
};

// T: a struct with a field for each parameter, and make().
template <class T>
class ShapeDeclaration {
public:
    ShapeDeclaration(std::string name, std::string doc)
    {
        type_.name = std::move(name);
        type_.doc = std::move(doc);
    }

    // Adds a parameter. F: double or Vec3d.
    template <class F>
    ShapeDeclaration& param(F T::*field, std::string name, F fallback, std::string unit, std::string doc)
    {
        const std::size_t k = type_.params.size();
        type_.params.push_back({std::move(name), std::move(unit), std::move(doc), fallback});
        assign_.push_back(
            [field, k](T& fields, std::span<const ShapeValue> values) { fields.*field = std::get<F>(values[k]); });
        return *this;
    }
    // Adds a length in metres, above 0.
    template <class F>
    ShapeDeclaration& length(F T::*field, std::string name, F fallback, std::string doc)
    {
        param(field, std::move(name), std::move(fallback), "m", std::move(doc));
        type_.params.back().positive = true;
        return *this;
    }

    operator ShapeType() const
    {
        ShapeType type = type_;
        type.make = [assign = assign_](std::span<const ShapeValue> values) -> ShapePtr {
            T fields{};
            for (const auto& set : assign) set(fields, values);
            return fields.make();
        };
        return type;
    }

private:
    ShapeType type_;
    std::vector<std::function<void(T&, std::span<const ShapeValue>)>> assign_;
};

template <class T>
ShapeDeclaration<T> shape_type(std::string name, std::string doc)
{
    return ShapeDeclaration<T>(std::move(name), std::move(doc));
}

// Returns all analytic shapes, sorted by name.
std::vector<ShapeType> shape_types();

// Registers a type at program start. Used through RAPID_SHAPE in the shape's own file.
struct ShapeRegistration {
    explicit ShapeRegistration(ShapeType (*declare)());
};
#define RAPID_SHAPE(Type) \
    static const ::rapid::ShapeRegistration registration_of_##Type([] { return ShapeType(Type::declare()); })

}  // namespace rapid
