#include "runtime/graph/value.h"

#include "tests/test.h"

namespace rapid {
namespace {

struct KindOnly : Object {
    explicit KindOnly(std::string_view kind) : kind_(kind) {}
    std::string_view kind() const override { return kind_; }
    std::string_view kind_;
};

Value thing(std::string_view kind) { return ObjectPtr(std::make_shared<KindOnly>(kind)); }

struct Nothing : FrameFunction {
    Value call(const Frame&) const override { return {}; }
};

Value table(std::vector<Value> list, std::map<std::int64_t, Value> numbered, std::map<std::string, Value> named)
{
    return std::make_shared<const Table>(Table{std::move(list), std::move(numbered), std::move(named)});
}

}  // namespace

TEST_CASE("a message shows a value as it is written in a graph", "[value]")
{
    CHECK(describe(Value()) == "nil");
    CHECK(describe(true) == "true");
    CHECK(describe(1.4) == "1.4");
    CHECK(describe(24.0) == "24");
    CHECK(describe(0.1) == "0.1");
    CHECK(describe("up") == "\"up\"");
    CHECK(describe(Vec3d(0, 1, -0.5)) == "{0, 1, -0.5}");
    CHECK(describe(AttributeRef{"bounce"}) == "rapid.attr \"bounce\"");
    CHECK(describe(table({0.0, 1.0}, {}, {})) == "{0, 1}");
    CHECK(describe(table({}, {{24, 50.0}}, {{"heat", "hot"}})) == "{[24] = 50, heat = \"hot\"}");
    CHECK(describe(std::shared_ptr<const FrameFunction>(std::make_shared<Nothing>())) == "a function");
}

TEST_CASE("a message names an object by its kind", "[value]")
{
    CHECK(describe(thing("mesh")) == "a mesh");
    CHECK(describe(thing("image")) == "an image");
    CHECK(describe(thing("points")) == "points");
}

TEST_CASE("a long table is shown in part: a message is one line", "[value]")
{
    CHECK(describe(table(std::vector<Value>(1000, 1.0), {}, {})) == "{1, 1, 1, 1, 1, 1, ...}");
}

}  // namespace rapid
