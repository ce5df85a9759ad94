#include "runtime/graph/registry.h"

#include <algorithm>

#include "tests/test.h"

namespace rapid {
namespace {

struct Pass {
    double amount = 0;
    std::map<std::string, AttributeValue> values;

    static NodeType declare()
    {
        return node<Pass>("test_pass", "Does nothing.")
            .param(&Pass::amount, "amount", 2.0, at_least(0), "m", "how much of nothing")
            .rest(&Pass::values, "anything");
    }
    void edit(PointSet&, const Evaluation&) const {}
};
RAPID_NODE(Pass);

struct Grouped {
    std::string group;
    static NodeType declare() { return node<Grouped>("test_grouped", "Does nothing to a group."); }
    void edit(PointSet&, const Evaluation&) const {}
};
RAPID_NODE(Grouped);

}  // namespace

TEST_CASE("a node that registers itself is in every registry, with its one declaration", "[registry]")
{
    const Registry registry;
    const NodeType& type = registry.at("test_pass");
    CHECK(type.doc == "Does nothing.");
    REQUIRE(type.find("amount"));
    CHECK(type.find("amount")->unit == "m");
    CHECK(type.find("amount")->range.text() == "at least 0");
    CHECK(type.find("amont") == nullptr);
    CHECK(type.param_names() == std::vector<std::string>{"amount"});
    CHECK(type.rest.has_value());
}

TEST_CASE("types come in order of name, whatever the order of linking", "[registry]")
{
    std::vector<std::string> names;
    const Registry registry;
    for (const NodeType* type : registry.types()) names.push_back(type->name);
    CHECK(names.size() >= 2);
    CHECK(std::is_sorted(names.begin(), names.end()));
}

TEST_CASE("a node with a group has the parameter, and reads the group that it is given", "[registry]")
{
    const Registry registry;
    const NodeType& type = registry.at("test_grouped");
    REQUIRE(type.find("group"));
    const auto op = type.make();
    Uses uses;
    op->uses(uses);
    CHECK(uses.reads_groups.empty());
    type.find("group")->assign(*type.find("group"), op->fields(), "hot");
    op->uses(uses);
    CHECK(uses.reads_groups == std::vector<std::string>{"hot"});
}

TEST_CASE("a type that a file adds is found, and keeps its address while others are added", "[registry]")
{
    Registry registry;
    NodeType mine;
    mine.name = "mine";
    const NodeType& added = registry.add(mine);
    for (int i = 0; i < 100; ++i) {
        NodeType other;
        other.name = "other" + std::to_string(i);
        registry.add(other);
    }
    CHECK(registry.find("mine") == &added);
    CHECK(Registry().find("mine") == nullptr);
}

TEST_CASE("a name can't be taken twice", "[registry]")
{
    Registry registry;
    NodeType again;
    again.name = "test_pass";
    CHECK_THROWS_WITH(registry.add(again), "a node \"test_pass\" exists already; give the new one another name");
}

TEST_CASE("an unknown node is answered with the nearest name", "[registry]")
{
    CHECK_THROWS_WITH(Registry().at("test_pas"), "unknown node \"test_pas\"; did you mean \"test_pass\"?");
    CHECK_THROWS_WITH(Registry().at("zzzzzzz"), "unknown node \"zzzzzzz\"; `rapid nodes` lists all nodes");
}

}  // namespace rapid
