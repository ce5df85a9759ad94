#include "runtime/graph/param.h"

#include <cmath>

#include "tests/test.h"

namespace rapid {
namespace {

struct Thing : Object {
    static constexpr std::string_view param_type = "thing";
    std::string_view kind() const override { return "thing"; }
};

struct Other : Object {
    std::string_view kind() const override { return "other"; }
};

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class T>
Param param(Range range = any_number(), std::vector<std::string> choices = {})
{
    Param p;
    p.name = "x";
    p.type = param_type<T>();
    p.range = range;
    p.choices = std::move(choices);
    p.per_point = std::is_same_v<T, PerPoint<float>> || std::is_same_v<T, PerPoint<Vec3f>>;
    return p;
}

template <class T>
T read(const Value& value, const Param& p = param<T>())
{
    T field{};
    read_value(p, value, field);
    return field;
}

template <class T>
std::string refusal(const Value& value, const Param& p = param<T>())
{
    try {
        read<T>(value, p);
        return "";
    } catch (const Error& error) {
        return error.message();
    }
}

Value list(std::vector<Value> values) { return std::make_shared<const Table>(Table{std::move(values), {}, {}}); }
Value named(std::map<std::string, Value> values)
{
    return std::make_shared<const Table>(Table{{}, {}, std::move(values)});
}

}  // namespace

TEST_CASE("a range says which numbers are right", "[param]")
{
    CHECK(between(0, 1).text() == "from 0 to 1");
    CHECK(at_least(0).text() == "at least 0");
    CHECK(above(0).text() == "above 0");
    CHECK(Range{-inf, 5}.text() == "at most 5");
    CHECK(Range{0, 5, true}.text() == "above 0 and at most 5");
    CHECK(any_number().text() == "any number");
}

TEST_CASE("a number is taken when it is in range, its ends included unless they are not", "[param]")
{
    CHECK(read<double>(0.0, param<double>(between(0, 1))) == 0);
    CHECK(read<double>(1.0, param<double>(between(0, 1))) == 1);
    CHECK(refusal<double>(1.4, param<double>(between(0, 1))) == "x = 1.4 is out of range; it must be from 0 to 1");
    CHECK(refusal<double>(-0.1, param<double>(between(0, 1))) == "x = -0.1 is out of range; it must be from 0 to 1");
    CHECK(refusal<double>(0.0, param<double>(above(0))) == "x = 0 is out of range; it must be above 0");
}

TEST_CASE("a number in range is stored unchanged", "[param]")
{
    using Limits = std::numeric_limits<double>;
    const double number = GENERATE(0.0, 1.0 / 3, -1e-300, Limits::denorm_min(), Limits::max(), Limits::lowest());
    CHECK(read<double>(number) == number);
}

TEST_CASE("NaN and infinity are no numbers, but where infinity means for ever", "[param][extreme]")
{
    CHECK(refusal<double>(nan) == "x = nan is out of range; it must be finite");
    CHECK(refusal<double>(inf) == "x = inf is out of range; it must be finite");
    CHECK(refusal<double>(nan, param<double>(or_infinity(at_least(0)))) ==
          "x = nan is out of range; it must be at least 0");
    CHECK(read<double>(inf, param<double>(or_infinity(at_least(0)))) == inf);
    CHECK(refusal<double>(-inf, param<double>(or_infinity(at_least(0)))) ==
          "x = -inf is out of range; it must be at least 0");
    CHECK(refusal<Vec3d>(Vec3d(0, nan, 0)) == "x = nan is out of range; it must be finite");
}

TEST_CASE("a number too large for single precision is out of range", "[param][extreme]")
{
    CHECK(refusal<float>(1e39) == "x = 1e+39 is out of range; it must be within ±3.4e+38");
    CHECK(read<double>(1e39) == 1e39);
}

TEST_CASE("an integer is whole, and in the range that it can hold", "[param]")
{
    CHECK(read<int>(-3.0) == -3);
    CHECK(refusal<int>(1.5) == "x = 1.5 is not whole; it must be an integer");
    CHECK(refusal<int>(3e9) == "x = 3000000000 is out of range; it must be from -2147483648 to 2147483647");
    CHECK(refusal<int>(0.0, param<int>(at_least(1))) == "x = 0 is out of range; it must be at least 1");
}

TEST_CASE("a value of another type is refused, and shown", "[param]")
{
    CHECK(refusal<double>("up") == "x = \"up\" has the wrong type; it must be a number");
    CHECK(refusal<double>(Value()) == "x is nil; it must be a number");
    CHECK(refusal<int>(true) == "x = true has the wrong type; it must be an integer");
    CHECK(refusal<bool>(1.0) == "x = 1 has the wrong type; it must be a boolean");
    CHECK(refusal<std::string>(1.0) == "x = 1 has the wrong type; it must be a string");
    CHECK(refusal<Vec3d>(list({0.0, 1.0})) == "x = {0, 1} has the wrong type; it must be a vec3 or {x, y, z}");
    CHECK(refusal<Vec3f>(list({0.0, 1.0, "z"})) ==
          "x = {0, 1, \"z\"} has the wrong type; it must be a vec3 or {x, y, z}");
    CHECK(refusal<PerPoint<float>>("b") == "x = \"b\" has the wrong type; it must be a number, or rapid.attr \"name\"");
}

TEST_CASE("a wrong choice gets the nearest word as a suggestion, or all words", "[param]")
{
    const Param p = param<std::string>(any_number(), {"begin", "end", "even"});
    CHECK(read<std::string>("even", p) == "even");
    CHECK(refusal<std::string>("evne", p) == "x = \"evne\" is unknown; did you mean \"even\"?");
    CHECK(refusal<std::string>("sometimes", p) == "x = \"sometimes\" is unknown; it must be one of begin, end, even");
}

TEST_CASE("a vec3 is one, or a list of three numbers", "[param]")
{
    CHECK(read<Vec3d>(Vec3d(1, 2, 3)) == Vec3d(1, 2, 3));
    CHECK(read<Vec3d>(list({1.0, 2.0, 3.0})) == Vec3d(1, 2, 3));
    CHECK(read<Vec3f>(list({1.0, 2.0, 3.0})) == Vec3f(1, 2, 3));
    CHECK(refusal<Vec3d>(Vec3d(1, -2, 3), param<Vec3d>(above(0))) == "x = -2 is out of range; it must be above 0");
}

TEST_CASE("a point parameter is a constant or each point's attribute", "[param]")
{
    CHECK(read<PerPoint<float>>(0.5).constant == 0.5f);
    CHECK(read<PerPoint<float>>(AttributeRef{"bounce"}).attribute == "bounce");
    CHECK(read<PerPoint<Vec3f>>(list({1.0, 2.0, 3.0})).constant == Vec3f(1, 2, 3));
    CHECK(read<PerPoint<Vec3f>>(AttributeRef{"wind"}).attribute == "wind");

    // A field that held an attribute holds a constant after a number is read.
    PerPoint<float> field = PerPoint<float>::of("bounce");
    read_value(param<PerPoint<float>>(), 2.0, field);
    CHECK((field.attribute.empty() && field.constant == 2));
}

TEST_CASE("an object is of the wanted type, or refused by its kind", "[param]")
{
    using ThingPtr = std::shared_ptr<const Thing>;
    const ObjectPtr thing = std::make_shared<Thing>(), other = std::make_shared<Other>();
    CHECK(read<ThingPtr>(thing) == thing);
    CHECK(read<ThingPtr>(Value()) == nullptr);
    CHECK(refusal<ThingPtr>(other) == "x = an other has the wrong type; it must be a thing");
    CHECK(read<ObjectPtr>(other) == other);
    CHECK(refusal<ObjectPtr>(1.0) == "x = 1 has the wrong type; it must be an object");
}

TEST_CASE("an optional parameter has a value only if it is given", "[param]")
{
    CHECK_FALSE(read<std::optional<double>>(Value()).has_value());
    CHECK(read<std::optional<double>>(0.0) == 0.0);
    CHECK(refusal<std::optional<double>>("x", param<std::optional<double>>()) ==
          "x = \"x\" has the wrong type; it must be a number");
}

TEST_CASE("attribute values take the type of their value, or that of a known name", "[param]")
{
    const auto values = read<std::map<std::string, AttributeValue>>(named({{"heat", 1.0},
                                                                           {"Cd", list({1.0, 0.5, 0.0})},
                                                                           {"w", Vec3d(1, 2, 3)},
                                                                           {"orient", list({0.0, 0.0, 0.0, 1.0})},
                                                                           {"hitnum", 4.0},
                                                                           {"life", inf}}));
    CHECK(std::get<float>(values.at("heat")) == 1);
    CHECK(std::get<Vec3f>(values.at("Cd")) == Vec3f(1, 0.5f, 0));
    CHECK(std::get<Vec3f>(values.at("w")) == Vec3f(1, 2, 3));
    CHECK(std::get<Quatf>(values.at("orient")).w() == 1);
    CHECK(std::get<std::int32_t>(values.at("hitnum")) == 4);
    CHECK(std::isinf(std::get<float>(values.at("life"))));
}

TEST_CASE("every known attribute takes its own fallback as a value", "[param]")
{
    for (const AttributeSpec& spec : known_attributes()) {
        CAPTURE(spec.name);
        const Value value = std::visit(
            [](const auto& v) -> Value {
                if constexpr (std::is_same_v<std::decay_t<decltype(v)>, Vec3f>)
                    return Vec3d(v.template cast<double>());
                else if constexpr (std::is_arithmetic_v<std::decay_t<decltype(v)>>)
                    return static_cast<double>(v);
                else
                    return {};
            },
            spec.fallback);
        const auto values = read<std::map<std::string, AttributeValue>>(named({{spec.name, value}}));
        CHECK(values.at(spec.name).index() == spec.fallback.index());
    }
}

TEST_CASE("attribute values are refused by the attribute's name", "[param]")
{
    using Values = std::map<std::string, AttributeValue>;
    CHECK(refusal<Values>(list({1.0})) == "x = {1} has the wrong type; it must be attributes");
    CHECK(refusal<Values>(named({{"heat", true}})) ==
          "heat = true has the wrong type; it must be a number, a vec3 or {x, y, z}, a quaternion {x, y, z, w} or a "
          "string");
    CHECK(refusal<Values>(named({{"mass", list({1.0, 2.0, 3.0})}})) ==
          "mass = {1, 2, 3} has the wrong type; it must be a number");
    CHECK(refusal<Values>(named({{"targetv", 1.0}})) ==
          "targetv = 1 has the wrong type; it must be a vec3 or {x, y, z}");
    CHECK(refusal<Values>(named({{"heat", inf}})) == "heat = inf is out of range; it must be finite");
    CHECK(refusal<Values>(named({{"v", 1.0}})) ==
          "\"v\" can't be an attribute, because Rapid uses this name; choose another one");
    CHECK(refusal<Values>(named({{"a b", 1.0}})) ==
          "attribute name \"a b\" can't be used; use letters, digits and _, and no digit at the beginning");
}

TEST_CASE("numbers by frame are a list from frame 1, or have their frames written", "[param]")
{
    using Numbers = std::map<std::int64_t, double>;
    const Value mixed = std::make_shared<const Table>(Table{{100.0, 50.0}, {{-3, 7.0}, {24, 8.0}}, {}});
    CHECK(read<Numbers>(mixed) == Numbers{{-3, 7}, {1, 100}, {2, 50}, {24, 8}});
    CHECK(refusal<Numbers>(list({1.0, "two"})) == "x[2] = \"two\" has the wrong type; it must be a number");
    CHECK(refusal<Numbers>(list({-1.0}), param<Numbers>(at_least(0))) ==
          "x[1] = -1 is out of range; it must be at least 0");
    CHECK(refusal<Numbers>(named({{"a", 1.0}})) == "x = {a = 1} has the wrong type; it must be numbers by frame");
}

TEST_CASE("names are a list, or one of them", "[param]")
{
    using Names = std::vector<std::string>;
    CHECK(read<Names>(list({"heat", "Cd"})) == Names{"heat", "Cd"});
    CHECK(read<Names>("heat") == Names{"heat"});
    CHECK(read<Names>(Value()).empty());
    CHECK(refusal<Names>(list({1.0})) == "x = {1} has the wrong type; it must be names");
}

TEST_CASE("degrees are kept as radians, and refused as degrees", "[param]")
{
    struct Fields {
        double angle = 0;
    };
    const Param p = param_of(&Fields::angle, "angle", Value(), between(0, 180), "deg", "");
    Fields fields;
    p.assign(p, &fields, 180.0);
    CHECK(fields.angle == Approx(EIGEN_PI));
    CHECK_THROWS_WITH(p.assign(p, &fields, 200.0), "angle = 200 is out of range; it must be from 0 to 180");
}

}  // namespace rapid
