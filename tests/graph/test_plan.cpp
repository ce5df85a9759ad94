#include "runtime/graph/plan.h"

#include <algorithm>

#include "tests/graph/graph_under_test.h"

namespace rapid {
namespace {

using test::error_of;
using test::GraphUnderTest;
using test::of_frame;

std::vector<std::string> names_of(const Plan& plan)
{
    std::vector<std::string> names;
    for (const PlannedNode& planned : plan.nodes) names.push_back(planned.node->name);
    return names;
}

const PlannedNode& planned(const Plan& plan, const std::string& name)
{
    const auto found = std::find_if(plan.nodes.begin(), plan.nodes.end(),
                                    [&](const PlannedNode& node) { return node.node->name == name; });
    REQUIRE(found != plan.nodes.end());
    return *found;
}

// Returns the names of nodes, in order.
std::vector<std::string> names_of(const Plan& plan, const std::vector<std::size_t>& indices)
{
    std::vector<std::string> names;
    for (const std::size_t place : indices) names.push_back(plan.nodes[place].node->name);
    return names;
}

const PlannedAttribute& attribute(const Plan& plan, const std::string& name, std::size_t simulation = 0)
{
    const PlannedAttribute* found = plan.simulations[simulation].find(name);
    REQUIRE(found);
    return *found;
}

std::set<std::string> kept(const Plan& plan, std::size_t simulation = 0)
{
    std::set<std::string> names;
    for (const PlannedAttribute& a : plan.simulations[simulation].attributes)
        if (a.kept) names.insert(a.name);
    return names;
}

// Returns options with which outputs request only these names.
PlanOptions requesting(std::vector<std::string> names)
{
    PlanOptions options;
    options.attributes = std::move(names);
    options.all_made = false;
    return options;
}

using Names = std::vector<std::string>;
using NameSet = std::set<std::string>;

std::string error_of_plan(const Graph& graph)
{
    return error_of([&] { Plan(graph, {}); });
}

}  // namespace

TEST_CASE("nodes that lead to no output are pruned", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr kept = scene.node("shift", {source}, {}, "kept");
    scene.node("shift", {kept}, {}, "beside");
    const NodePtr post = scene.node("post", {kept});
    scene.node("shift", {post}, {}, "behind");
    scene.node("source", {}, {}, "another");

    const Plan plan(scene.returning(post), {});

    CHECK(names_of(plan) == std::vector<std::string>{"source1", "kept", "post1"});
    CHECK(plan.simulations.size() == 1);
    REQUIRE(plan.warnings.size() == 2);
    CHECK_THAT(plan.warnings[0], Catch::Contains("node \"beside\": leads to no output"));
    CHECK_THAT(plan.warnings[1], Catch::Contains("node \"behind\": leads to no output"));
}

TEST_CASE("wrong arguments of a pruned node are no error", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    scene.node("shift", {source}, {{"byy", Value(1.0)}});
    CHECK_NOTHROW(Plan(scene.returning(source), {}));
}

TEST_CASE("a pruned write causes a warning", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    scene.node("write", {source});
    const Plan plan(scene.returning(source), {});
    CHECK(plan.warnings == std::vector<std::string>{"scene.lua:2: node \"write1\": writes nothing, because it leads to "
                                                    "no output; return it, or continue the chain from it"});
}

TEST_CASE("each node comes once, after its inputs, and knows how many take its result", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr left = scene.node("shift", {source}, {}, "left"), right = scene.node("shift", {source}, {}, "right");
    const NodePtr both = scene.node("both", {right, left});

    const Plan plan(scene.returning({{"main", both}, {"early", left}}), {});

    CHECK(names_of(plan) == std::vector<std::string>{"source1", "left", "right", "both1"});
    CHECK(planned(plan, "source1").consumers == 2);
    CHECK(planned(plan, "left").consumers == 2);  // both1 and the output
    CHECK(planned(plan, "right").consumers == 1);
    CHECK(planned(plan, "both1").consumers == 1);
    CHECK(planned(plan, "both1").inputs == std::vector<std::size_t>{2, 1});
    CHECK(plan.outputs == std::map<std::string, std::size_t>{{"early", 1}, {"main", 3}});
}

TEST_CASE("nodes that change from frame to frame, and nodes after them, are evaluated in each frame", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr still = scene.node("source", {}, {}, "still");
    const NodePtr shifted = scene.node("shift", {still}, {{"by", Value(Vec3d(2, 0, 0))}}, "shifted");
    const NodePtr jitter = scene.node("jitter", {shifted}, {}, "varies");
    const NodePtr behind = scene.node("shift", {jitter}, {}, "behind");
    const NodePtr moving =
        scene.node("shift", {still}, {{"by", of_frame([](const Frame&) { return Value(Vec3d(1, 0, 0)); })}}, "moving");
    const NodePtr both = scene.node("both", {shifted, moving});
    const NodePtr source = scene.node("source", {}, {}, "fed back");
    const NodePtr inside = scene.node("shift", {source}, {}, "in the loop");
    const NodePtr post = scene.node("post", {inside});
    const NodePtr after = scene.node("shift", {post}, {}, "after the loop");

    const Plan plan(scene.returning({{"a", behind}, {"b", both}, {"c", after}}), {});

    std::map<std::string, bool> once, in_loop;
    for (const PlannedNode& node : plan.nodes) {
        once[node.node->name] = node.once;
        in_loop[node.node->name] = node.in_loop;
    }
    CHECK(once == std::map<std::string, bool>{{"still", true},
                                              {"shifted", true},
                                              {"varies", false},
                                              {"behind", false},
                                              {"moving", false},
                                              {"both1", false},
                                              {"fed back", false},
                                              {"in the loop", false},
                                              {"post1", false},
                                              {"after the loop", false}});
    for (const auto& [name, inside_loop] : in_loop)
        CHECK(inside_loop == (name == "fed back" || name == "in the loop" || name == "post1"));
}

TEST_CASE("a simulation has its source's rate, first frame and seed, unless the run's seed replaces it", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr first = scene.node("source", {}, {{"fps", Value(30.0)}, {"start", Value(5.0)}, {"seed", Value(7.0)}});
    const NodePtr second = scene.node("source", {}, {{"start", Value(-3.0)}});
    const Graph& graph = scene.returning({{"a", first}, {"b", second}});

    const Plan plan(graph, {});
    REQUIRE(plan.simulations.size() == 2);
    CHECK(plan.simulations[0].fps == 30);
    CHECK(plan.simulations[0].start == 5);
    CHECK(plan.simulations[0].seed == 7);
    CHECK(plan.simulations[1].fps == 24);
    CHECK(plan.simulations[1].solve == nullptr);
    CHECK(plan.first_frame() == -3);

    const Plan seeded(graph, {.seed = 9, .attributes = {}});
    CHECK(seeded.simulations[0].seed == 9);
    CHECK(seeded.simulations[1].seed == 9);
}

TEST_CASE("a second solve after one create is an error that names both", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr first = scene.node("post", {source});
    const bool in_a_row = GENERATE(true, false);
    const NodePtr second = scene.node("post", {in_a_row ? first : source}, {}, "again");
    CHECK(error_of_plan(scene.returning({{"a", first}, {"b", second}})) ==
          "scene.lua:3: node \"again\": a second solve after \"source1\": \"post1\" at line 2 is already its solve; a "
          "create can have only one");
}

TEST_CASE("each of two simulations has a solve, and a solve after both is an error", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr one = scene.node("post", {scene.node("source")});
    const NodePtr other = scene.node("post", {scene.node("source")});
    const NodePtr both = scene.node("both", {one, other});
    CHECK(Plan(scene.returning(both), {}).simulations[1].solve->name == "post2");
    const NodePtr again = scene.node("post", {both});
    CHECK_THAT(error_of_plan(scene.returning(again)),
               Catch::StartsWith("scene.lua:6: node \"post3\": a second solve after \"source1\": \"post1\" at line 2"));
}

TEST_CASE("columns that a node of the loop makes exist from the first frame on, with its value", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr made = scene.node("make", {source}, {{"heat", Value(2.0)}, {"member", Value("hot")}});
    const NodePtr post = scene.node("post", {scene.node("read", {made}, {{"value", Value(AttributeRef{"mass"})}})});
    const NodePtr after = scene.node("make", {post}, {{"later", Value(1.0)}});

    const Plan plan(scene.returning(after), {.seed = {}, .attributes = {"pscale"}});

    std::map<std::string, AttributeValue> columns;
    for (const AttributeSpec& spec : plan.columns_of(0)) columns[spec.name] = spec.fallback;
    CHECK(columns == std::map<std::string, AttributeValue>{{"heat", 2.0f}, {"mass", 1.0f}, {"pscale", 0.0f}});
    CHECK(plan.groups_of(0) == std::vector<std::string>{"hot"});
}

TEST_CASE("an error of planning names the node and its line", "[plan]")
{
    struct Case {
        std::string type;
        std::map<std::string, Value> arguments;
        std::string message;
    };
    const auto c = GENERATE(values<Case>({
        {"shift", {{"bye", Value(Vec3d(0, 0, 0))}}, "unknown parameter \"bye\"; did you mean \"by\"?"},
        {"shift", {{"by", Value("far")}}, "by = \"far\" has the wrong type; it must be a vec3 or {x, y, z}"},
        {"shift", {{"by", Value(Vec3d(0, -101, 0))}}, "by = -101 is out of range; it must be at least -100"},
        {"shift", {{"group", Value("hott")}}, "no node makes a group \"hott\"; did you mean \"hot\"?"},
        {"read",
         {{"value", Value(AttributeRef{"haet"})}},
         "no attribute \"haet\"; did you mean \"heat\"? (or add :attribute{ haet = 0 } before it)"},
        {"read", {{"value", Value(AttributeRef{"zzz"})}}, "no attribute \"zzz\"; add :attribute{ zzz = 0 } before it"},
        {"make",
         {{"heat", Value(Vec3d(0, 0, 0))}},
         "makes attribute \"heat\" as vec3, but node \"make1\" at line 2 makes it as float"},
        {"shift",
         {{"by", of_frame([](const Frame&) { return Value(); })}},
         "by is nil; it must be a vec3 or {x, y, z} (frame 1)"},
        {"source",
         {{"fps", of_frame([](const Frame&) { return Value(24.0); })}},
         "fps can't be a function of the frame; it must be a constant"},
    }));
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr made = scene.node("make", {source}, {{"heat", Value(0.0)}, {"member", Value("hot")}});
    const NodePtr wrong =
        scene.node(c.type, c.type == "source" ? std::vector<NodePtr>() : std::vector{made}, c.arguments, "wrong");
    CHECK(error_of_plan(scene.returning({{"a", made}, {"b", wrong}})) == "scene.lua:3: node \"wrong\": " + c.message);
}

TEST_CASE("two nodes of one name are an error at the second", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr one = scene.node("shift", {source}, {}, "twin");
    const NodePtr two = scene.node("shift", {one}, {}, "twin");
    CHECK(error_of_plan(scene.returning(two)) ==
          "scene.lua:3: node \"twin\": the node at line 2 has the same name; give each node a different name");
}

TEST_CASE("a graph without an output is an error of its file", "[plan]")
{
    GraphUnderTest scene;
    CHECK(error_of_plan(scene.returning(std::map<std::string, NodePtr>())) ==
          "scene.lua: the graph returns no output; end the file with `return` and a node");
}

TEST_CASE("a scene that needs nothing has P, v and id", "[plan]")
{
    GraphUnderTest scene;
    const Plan plan(scene.returning(scene.node("post", {scene.node("source")})), {});
    CHECK(kept(plan) == NameSet{"P", "id", "v"});
    CHECK(plan.columns_of(0).empty());
}

TEST_CASE("an attribute that nothing reads is kept exactly if an output requests it", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"heat", Value(2.0)}});
    const Graph& graph = scene.returning(scene.node("post", {made}));

    CHECK(kept(Plan(graph, {})) == NameSet{"P", "heat", "id", "v"});
    CHECK(attribute(Plan(graph, {}), "heat").requested_as_made);
    CHECK(kept(Plan(graph, requesting({"heat"}))) == NameSet{"P", "heat", "id", "v"});
    CHECK(attribute(Plan(graph, requesting({"heat"})), "heat").requested_by_name);

    const Plan without(graph, requesting({"mass"}));
    CHECK(kept(without) == NameSet{"P", "id", "mass", "v"});
    CHECK(without.simulations[0].pruned.count("heat") == 1);
    for (const AttributeSpec& spec : without.columns_of(0)) CHECK(spec.name == "mass");
}

TEST_CASE("an attribute that a node reads is kept, and the plan knows who makes and who reads it", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"heat", Value(2.0)}});
    const NodePtr one = scene.node("read", {made}, {{"value", Value(AttributeRef{"heat"})}}, "one");
    const NodePtr other = scene.node("read", {one}, {{"value", Value(AttributeRef{"heat"})}}, "other");
    const Plan plan(scene.returning(scene.node("post", {other})), requesting({}));
    const PlannedAttribute& heat = attribute(plan, "heat");
    CHECK(heat.kept);
    CHECK(names_of(plan, heat.made_by) == Names{"make1"});
    CHECK(names_of(plan, heat.read_by) == Names{"one", "other"});
    CHECK(heat.bytes_per_point() == 4);
}

TEST_CASE("a reader that no output comes from keeps nothing alive", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"heat", Value(2.0)}});
    scene.node("read", {made}, {{"value", Value(AttributeRef{"heat"})}});
    CHECK(kept(Plan(scene.returning(made), requesting({}))) == NameSet{"P", "id", "v"});
}

TEST_CASE("an attribute that is assigned point by point is kept", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"heat", Value(2.0)}});
    const NodePtr assigned = scene.node("assign", {made}, {{"to", Value("heat")}});
    const Plan plan(scene.returning(scene.node("post", {assigned})), requesting({}));
    CHECK(kept(plan) == NameSet{"P", "heat", "id", "v"});
    CHECK(names_of(plan, attribute(plan, "heat").written_by) == Names{"assign1"});
}

TEST_CASE("what may read every name keeps all that is made", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"heat", Value(2.0)}, {"member", Value("hot")}});
    const bool all = GENERATE(true, false);
    const NodePtr assigned = scene.node("assign", {made}, {{"all", Value(all)}});
    const NameSet names = kept(Plan(scene.returning(scene.node("post", {assigned})), requesting({})));
    CHECK(names == (all ? NameSet{"P", "group:hot", "heat", "id", "v"} : NameSet{"P", "id", "v"}));
}

TEST_CASE("life and age are there exactly where a life may end, and birth times where something reads them", "[plan]")
{
    const auto planned_with = [&](Value life, bool solved, std::vector<std::string> requested = {}) {
        GraphUnderTest graph;
        const NodePtr born = graph.node("bear", {graph.node("source")}, {{"life", std::move(life)}});
        return kept(
            Plan(graph.returning(solved ? graph.node("post", {born}) : born), requesting(std::move(requested))));
    };
    const double forever = std::numeric_limits<double>::infinity();
    const Value later = of_frame([=](const Frame& f) { return Value(f.number < 9 ? forever : 1.0); });

    CHECK(planned_with(2.0, true) == NameSet{"P", "age", "id", "life", "v"});
    CHECK(planned_with(forever, true) == NameSet{"P", "id", "v"});
    CHECK(planned_with(later, true) == NameSet{"P", "age", "id", "life", "v"});
    CHECK(planned_with(2.0, false) == NameSet{"P", "id", "v"});
    CHECK(planned_with(forever, true, {"age"}) == NameSet{"P", "age", "id", "v"});
    CHECK(planned_with(forever, true, {"birthtime"}) == NameSet{"P", "birthtime", "id", "v"});
}

TEST_CASE("a group that nothing reads is pruned, unless points join it one by one", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"member", Value("hot")}});
    const NodePtr joined = scene.node("bear", {made}, {{"joins", Value("old")}});
    const NodePtr asks = scene.node("assign", {joined}, {{"within", Value("hot")}});
    const NodePtr limited = scene.node("shift", {joined}, {{"group", Value("hot")}});

    const Plan without(scene.returning(joined), requesting({}));
    CHECK(kept(without) == NameSet{"P", "group:old", "id", "v"});
    CHECK(without.groups_of(0).empty());  // nothing feeds back here
    for (const NodePtr& reader : {asks, limited}) {
        const Plan plan(scene.returning(scene.node("post", {reader}, {}, "post")), requesting({}));
        CHECK(names_of(plan, attribute(plan, "group:hot").read_by) == Names{reader->name});
        CHECK(plan.groups_of(0) == Names{"hot", "old"});
    }
    CHECK(kept(Plan(scene.returning(joined), requesting({"hot"}))).count("group:hot") == 1);
    CHECK(attribute(without, "group:old").bytes_per_point() == 1);
}

TEST_CASE("a reader after a merge keeps the attribute in both simulations, and in no others", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr here = scene.node("source", {}, {}, "here"), there = scene.node("source", {}, {}, "there");
    const NodePtr hot = scene.node("make", {there}, {{"heat", Value(1.0)}});
    const NodePtr both = scene.node("both", {here, hot});
    const Value heat(AttributeRef{"heat"});
    const NodePtr reader = scene.node("read", {both}, {{"value", heat}});
    const NodePtr beside = scene.node("read", {scene.node("make", {here}, {{"heat", Value(1.0)}})}, {{"value", heat}});

    const Plan joined(scene.returning(reader), requesting({}));
    CHECK(attribute(joined, "heat", 0).kept);
    CHECK(attribute(joined, "heat", 1).kept);
    const Plan apart(scene.returning({{"a", beside}, {"b", hot}}), requesting({}));
    CHECK(attribute(apart, "heat", 0).kept);
    CHECK_FALSE(attribute(apart, "heat", 1).kept);
}

TEST_CASE("what the result of a merge has, all points that come into it keep", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr here = scene.node("source", {}, {}, "here"), there = scene.node("source", {}, {}, "there");
    const Value mass(AttributeRef{"mass"}), heat(AttributeRef{"heat"});
    const NodePtr hot = scene.node("make", {here}, {{"heat", Value(1.0)}});
    const NodePtr heavy = scene.node("read", {scene.node("read", {hot}, {{"value", heat}})}, {{"value", mass}});
    const NodePtr other = scene.node("make", {there}, {{"heat", Value(2.0)}});
    const Graph graph = scene.returning({{"both", scene.node("both", {heavy, other})}, {"other", other}});
    const Plan plan(graph, requesting({}));
    for (const char* name : {"mass", "heat"}) {
        CAPTURE(name);
        CHECK(attribute(plan, name, 0).kept);
        CHECK(attribute(plan, name, 1).kept);
        CHECK(attribute(plan, name, 1).kept_for_merge);
    }
    // The points of the other output have no mass in their files.
    CHECK(plan.unrequested_columns(plan.outputs.at("both")).empty());
    CHECK(plan.unrequested_columns(plan.outputs.at("other")) == NameSet{"mass"});
    // An attribute is dropped if it is merged into points without it.
    const Plan back(scene.returning(scene.node("both", {other, heavy})), requesting({}));
    CHECK_FALSE(attribute(back, "mass", back.nodes[back.outputs.at("main")].simulation).kept_for_merge);
}

TEST_CASE("with keep_all nothing is pruned, and nothing is evaluated once", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr made = scene.node("make", {scene.node("source")}, {{"heat", Value(2.0)}, {"member", Value("hot")}});
    PlanOptions options = requesting({});
    options.keep_all = true;
    const Plan plan(scene.returning(made), options);
    CHECK(plan.simulations[0].pruned.empty());
    for (const AttributeSpec& known : known_attributes()) CHECK(kept(plan).count(known.name) == 1);
    CHECK(kept(plan).count("heat") == 1);
    CHECK(kept(plan).count("group:hot") == 1);
    for (const PlannedNode& node : plan.nodes) CHECK_FALSE(node.once);
    // An output that names nothing still gets the attributes of the scene, and no others.
    CHECK(plan.names_of_scene() == NameSet{"P", "heat", "hot", "id", "v"});
}

TEST_CASE("a node that changes says why, and one that does not has no reason to", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr still = scene.node("source", {}, {}, "still");
    const NodePtr moving =
        scene.node("shift", {still}, {{"by", of_frame([](const Frame&) { return Value(Vec3d(1, 0, 0)); })}}, "moving");
    const NodePtr behind = scene.node("shift", {moving}, {}, "behind");
    const NodePtr inside = scene.node("shift", {scene.node("source")}, {}, "inside");
    const Plan plan(scene.returning({{"a", behind}, {"b", scene.node("post", {inside})}}), {});
    CHECK(planned(plan, "still").changes.empty());
    CHECK(planned(plan, "moving").changes == "its by changes with the frame");
    CHECK(planned(plan, "behind").changes == "\"moving\" before it is evaluated again");
    CHECK(planned(plan, "inside").changes == "its points continue from frame to frame");
    CHECK(planned(plan, "moving").reached_from == NameSet{"a"});
    CHECK(planned(plan, "inside").reached_from == NameSet{"b"});
}

TEST_CASE("solve takes the dynamics upstream of it along in its pass, and each other node has its own", "[plan]")
{
    GraphUnderTest scene;
    const NodePtr first = scene.node("push", {scene.node("source")}, {}, "first");
    const NodePtr shifted = scene.node("shift", {first});
    const NodePtr second = scene.node("push", {shifted}, {}, "second");
    const NodePtr after = scene.node("shift", {scene.node("post", {second})}, {}, "after");
    const Plan plan(scene.returning(after), {});
    std::vector<Names> passes;
    for (const std::vector<std::size_t>& pass : plan.passes()) passes.push_back(names_of(plan, pass));
    CHECK(passes == std::vector<Names>{{"shift1"}, {"first", "second", "post1"}, {"after"}});
}

}  // namespace rapid
