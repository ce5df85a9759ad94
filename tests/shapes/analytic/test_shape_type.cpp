#include "runtime/shapes/analytic/shape_type.h"

#include <algorithm>

#include "runtime/base/error.h"
#include "tests/test.h"

namespace rapid {
namespace {

// A type as a new source file would declare it.
struct HalfBallType {
    double radius;
    Vec3d center;

    static ShapeType declare()
    {
        return shape_type<HalfBallType>("half_ball", "A test.")
            .length(&HalfBallType::radius, "radius", 2.0, "of the ball")
            .param(&HalfBallType::center, "center", Vec3d(1, 0, 0), "m", "its middle");
    }
    ShapePtr make() const { throw Error(std::to_string(radius) + " at " + std::to_string(center.x())); }
};

std::vector<ShapeValue> defaults_of(const ShapeType& type)
{
    std::vector<ShapeValue> values;
    for (const ShapeParam& param : type.params) values.push_back(param.fallback);
    return values;
}

}  // namespace

TEST_CASE("every analytic shape is documented, and made from its own defaults", "[analytic]")
{
    const std::vector<ShapeType> types = shape_types();
    REQUIRE(types.size() >= 3);
    CHECK(std::is_sorted(types.begin(), types.end(), [](const auto& a, const auto& b) { return a.name < b.name; }));
    for (const ShapeType& type : types) {
        CAPTURE(type.name);
        CHECK_FALSE(type.doc.empty());
        for (const ShapeParam& param : type.params) {
            CAPTURE(param.name);
            CHECK_FALSE(param.doc.empty());
        }
        const ShapePtr shape = type.make(defaults_of(type));
        REQUIRE(shape);
        CHECK(shape->kind() == type.name);
    }
}

TEST_CASE("a declared shape takes its values in the order of its parameters", "[analytic]")
{
    const ShapeType type = HalfBallType::declare();
    CHECK(type.params[0].positive);
    CHECK_FALSE(type.params[1].positive);
    CHECK(std::get<Vec3d>(type.params[1].fallback) == Vec3d(1, 0, 0));
    CHECK_THROWS_WITH(type.make(std::vector<ShapeValue>{0.5, Vec3d(3, 0, 0)}), "0.500000 at 3.000000");
}

}  // namespace rapid
