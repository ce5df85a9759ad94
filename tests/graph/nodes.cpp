// Node types for the tests of plan and evaluation, one of each kind, because the real ones are above this layer.
#include <cmath>
#include <new>

#include "tests/graph/graph_under_test.h"

namespace rapid::test {
namespace {

// Creates one point at the origin, passed on as the simulation's state.
struct Source {
    double fps = 24;
    int start_frame = 1, seed = 0, subframes = 1;

    static NodeType declare()
    {
        return node<Source>("source", "One point.")
            .kind(NodeKind::Source)
            .param(&Source::fps, "fps", 24.0, above(0), "1/s", "frames a second")
            .constant()
            .param(&Source::start_frame, "start", 1.0, any_number(), "", "first frame")
            .constant()
            .param(&Source::seed, "seed", 0.0, at_least(0), "", "of random numbers")
            .constant()
            .param(&Source::subframes, "subframes", 1.0, at_least(1), "", "evaluations a frame")
            .constant();
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        ++evaluations[now.node];
        Flow flow = std::move(inputs[0]);
        Simulation& simulation = *flow.simulation;
        if (now.at_start) {
            flow.points = points({Vec3f::Zero()});
            simulation.next_id = 1;
        } else {
            flow.points = simulation.state;
        }
        for (const AttributeSpec& spec : simulation.columns) flow.points.set_fallback(spec);
        for (const std::string& name : simulation.groups) flow.points.group(name);
        return flow;
    }
};
RAPID_NODE(Source);

// Moves points, and counts its evaluations.
struct Shift {
    Vec3d by;
    std::string group;

    static NodeType declare()
    {
        return node<Shift>("shift", "Moves points.")
            .param(&Shift::by, "by", Vec3d(1, 0, 0), at_least(-100), "m", "how far")
            .writes("P");
    }

    void edit(PointSet& points, const Evaluation& now) const
    {
        ++evaluations[now.node];
        for (Vec3f& P : points.P().write()) P += by.cast<float>();
        now.warnings.push_back("shifted");
        now.figures.collisions += 1;
    }
};
RAPID_NODE(Shift);

// Like Shift, but counted as changing from frame to frame with any arguments.
struct Jitter {
    static NodeType declare() { return node<Jitter>("jitter", "Changes each frame.").varies(); }
    void edit(PointSet&, const Evaluation& now) const { ++evaluations[now.node]; }
};
RAPID_NODE(Jitter);

// Makes an attribute and a group.
struct Make {
    std::map<std::string, AttributeValue> values;
    std::string member;

    static NodeType declare()
    {
        return node<Make>("make", "Makes attributes.")
            .param(&Make::member, "member", Value(), any_number(), "", "a group")
            .rest(&Make::values, "the attribute's value");
    }
    void uses(Uses& uses) const
    {
        for (const auto& [name, value] : values) uses.makes.push_back({name, value});
        if (!member.empty()) uses.makes_groups.push_back(member);
    }
    void edit(PointSet& points, const Evaluation& now) const
    {
        ++evaluations[now.node];
        for (const auto& [name, value] : values)
            if (now.keeps(name)) points.add({name, value});
    }
};
RAPID_NODE(Make);

// Reads an attribute of each point.
struct Read {
    PerPoint<float> value{0.0f};

    static NodeType declare()
    {
        return node<Read>("read", "Reads an attribute.")
            .param(&Read::value, "value", 0.0, any_number(), "", "what is read");
    }
    void edit(PointSet&, const Evaluation& now) const { ++evaluations[now.node]; }
};
RAPID_NODE(Read);

// Uses an attribute that it does not declare: reads "heat" into P, writes it, or leaves it alone.
struct Undeclared {
    std::string what;

    static NodeType declare()
    {
        return node<Undeclared>("undeclared", "Declares nothing.")
            .param(&Undeclared::what, "what", Value(), any_number(), "", "reads, writes or nothing");
    }
    void edit(PointSet& points, const Evaluation& now) const
    {
        ++evaluations[now.node];
        if (what == "reads") points.P().write()[0].x() += points.column<float>("heat")[0];
        if (what == "writes") points.column<float>("heat").write()[0] = 7;
    }
};
RAPID_NODE(Undeclared);

// Emits nothing, but declares lives and birth times, and puts points into a group one by one.
struct Bear {
    double life = 1;
    std::string joins;

    static NodeType declare()
    {
        return node<Bear>("bear", "Gives lives.")
            .param(&Bear::life, "life", 1.0, or_infinity(at_least(0)), "s", "infinite for points that never die")
            .param(&Bear::joins, "joins", Value(), any_number(), "", "a group");
    }
    void uses(Uses& uses) const
    {
        uses.gives.push_back("birthtime");
        if (std::isfinite(life) || uses.functions.count("life")) uses.gives.push_back("life");
        if (joins.empty()) return;
        uses.makes_groups.push_back(joins);
        uses.joins_groups.push_back(joins);
    }
    void edit(PointSet&, const Evaluation&) const {}
};
RAPID_NODE(Bear);

// Writes an attribute of each point, like a kernel, and reads a group.
struct Assign {
    std::string to, within;
    bool all = false;

    static NodeType declare()
    {
        return node<Assign>("assign", "Assigns an attribute.")
            .param(&Assign::to, "to", Value(), any_number(), "", "an attribute")
            .param(&Assign::within, "within", Value(), any_number(), "", "a group")
            .param(&Assign::all, "all", false, any_number(), "", "may read everything");
    }
    void uses(Uses& uses) const
    {
        if (!to.empty()) uses.writes.push_back(to);
        if (!within.empty()) uses.takes_groups.push_back(within);
        uses.reads_all = all;
    }
    void edit(PointSet&, const Evaluation&) const {}
};
RAPID_NODE(Assign);

struct Push {
    static NodeType declare() { return node<Push>("push", "A force."); }
    void contribute(const Chunk&, Forces&) const {}
};
RAPID_NODE(Push);

// Feeds the points back, and reports the number of dynamics that reached it.
struct Post {
    static NodeType declare() { return node<Post>("post", "Feeds back.").kind(NodeKind::Solve).takes("life"); }

    Flow start(std::span<Flow> inputs, const Evaluation& now)
    {
        ++starts[now.node];
        return post(inputs);
    }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        ++evaluations[now.node];
        now.figures.substeps = static_cast<int>(inputs[0].dynamics.size());
        return post(inputs);
    }
    static Flow post(std::span<Flow> inputs)
    {
        Flow flow = std::move(inputs[0]);
        flow.dynamics.clear();
        flow.simulation->state = flow.points;
        return flow;
    }
};
RAPID_NODE(Post);

// Returns the first input after the second has also been evaluated.
struct Both {
    static NodeType declare() { return node<Both>("both", "The first of two.").kind(NodeKind::Merge); }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        ++evaluations[now.node];
        return std::move(inputs[0]);
    }
};
RAPID_NODE(Both);

// Fails when it is evaluated.
struct Fail {
    bool out_of_memory = false;

    static NodeType declare()
    {
        return node<Fail>("fail", "Fails.")
            .param(&Fail::out_of_memory, "out_of_memory", false, any_number(), "", "in this way")
            .varies();
    }
    void edit(PointSet&, const Evaluation&) const
    {
        if (out_of_memory) throw std::bad_alloc();
        throw Error("it can't be done");
    }
};
RAPID_NODE(Fail);

// Looks like `:write` to the plan: a node whose only effect is elsewhere.
struct Write {
    static NodeType declare() { return node<Write>("write", "Writes."); }
    void edit(PointSet& points, const Evaluation& now) const
    {
        if (now.write) now.write("a.csv", points);
    }
};
RAPID_NODE(Write);

}  // namespace
}  // namespace rapid::test
