// A run resumed from a snapshot, in another session or process, is bit-identical to the uninterrupted run: frames,
// statistics, estimated errors and kept state, for nodes of all types.
#include <cstdlib>
#include <set>

#include "runtime/graph/stateful.h"
#include "runtime/io/state_file.h"
#include "runtime/report/statistics.h"
#include "tests/files/temporary_folder.h"
#include "tests/host/run.h"
#include "tests/host/scenes_with_state.h"
#include "tests/test.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using test::Run;

// A node that counts frames, and either declares this state or hides it.
template <bool says_so>
struct Counting {
    std::string group;

    static NodeType declare()
    {
        return node<Counting>(says_so ? "counting_openly" : "counting_secretly", "Counts its frames, for this test.")
            .varies()
            .writes("v");
    }
    static std::unique_ptr<Operator> make()
    {
        if constexpr (says_so) return stateful<Counting>();
        return std::make_unique<detail::OperatorOf<Counting>>();
    }
    void edit(PointSet& points, const Evaluation&)
    {
        ++frames_;
        for (Vec3f& v : points.v().write()) v.x() += static_cast<float>(frames_);
    }
    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(frames_);
    }

private:
    int frames_ = 0;
};
using CountingOpenly = Counting<true>;
using CountingSecretly = Counting<false>;
RAPID_NODE(CountingOpenly);
RAPID_NODE(CountingSecretly);

// A frame without times and the passes' work: statistics as text, every estimated error, and the points.
struct Seen {
    std::string statistics;
    std::vector<double> errors, frame_errors, energy_drift;
    std::map<std::string, SavedState> outputs;

    explicit Seen(const FrameResult& result)
        : errors(result.figures.error.values),
          frame_errors(result.figures.frame_error.values),
          energy_drift(result.figures.energy_drift.values)
    {
        FrameFigures figures = statistics_of(result);
        figures.seconds = {};
        figures.nodes.clear();
        for (BandFigures& band : figures.bands) band.seconds = 0;
        if (figures.contact_grids) figures.contact_grids->search_seconds = 0;
        statistics = json_line(figures, true);
        for (const auto& [name, points] : result.outputs) outputs[name] = state_of(points);
    }
    // Returns the first difference, or an empty string.
    std::string difference(const Seen& other) const
    {
        for (const auto& [name, points] : outputs)
            if (!(points == other.outputs.at(name))) return "the points of " + name;
        if (statistics != other.statistics) return statistics + "\n" + other.statistics;
        if (errors != other.errors || frame_errors != other.frame_errors) return "errors";
        return energy_drift != other.energy_drift ? "energy drift" : "";
    }
};

std::string difference(const Snapshot& a, const Snapshot& b)
{
    for (const auto& [parts, others] : {std::pair(&a.simulations, &b.simulations), std::pair(&a.nodes, &b.nodes)}) {
        if (parts->size() != others->size()) return "the nodes with state";
        for (const auto& [name, state] : *parts)
            if (!others->count(name) || !(others->at(name) == state)) return "what " + name + " keeps";
    }
    return "";
}

// Runs a scene, then again from snapshots at some of its frames. Returns the first difference and its frame, or an
// empty string.
std::string difference_after_snapshots(const fs::path& file, std::int64_t frames,
                                       std::set<std::string>* types = nullptr)
{
    std::map<std::int64_t, Snapshot> snapshots;
    std::map<std::int64_t, Seen> seen;
    Run whole(file);
    for (const PlannedNode& planned : whole.plan().nodes)
        if (types) types->insert(planned.node->type->name);
    const std::int64_t first = whole.plan().first_frame();
    const std::set<std::int64_t> cuts = {0, 1, 4, frames / 2};
    for (std::int64_t k = 0; k < frames; ++k) {
        seen.emplace(k, whole.evaluator().advance());
        if (cuts.count(k)) snapshots.emplace(k, whole.evaluator().save());
    }
    const Snapshot end = whole.evaluator().save();
    for (const auto& [cut, snapshot] : snapshots) {
        Run rest(file);
        rest.evaluator().load(snapshot);
        const std::string after = "from frame " + std::to_string(first + cut) + ": ";
        if (const std::string what = difference(rest.evaluator().save(), snapshot); !what.empty())
            return after + what + " as it is read back";
        for (std::int64_t k = cut + 1; k < frames; ++k)
            if (const std::string what = Seen(rest.evaluator().advance()).difference(seen.at(k)); !what.empty())
                return after + "frame " + std::to_string(first + k) + ": " + what;
        if (const std::string what = difference(rest.evaluator().save(), end); !what.empty())
            return after + what + " at the end";
    }
    return "";
}

// Points that fall, and a node without arguments.
std::string scene_of_defaults(const std::string& node)
{
    return "local rapid = require \"rapid\"\n"
           "return rapid.create { seed = 2, points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.5 } } :gravity "
           "{} :" +
           node + " {} :solve { substeps = 2 }";
}

}  // namespace

TEST_CASE("a run after a snapshot equals the uninterrupted run, for nodes of every type", "[snapshot]")
{
    std::set<std::string> types;
    for (const auto& [name, text] : test::scenes_with_state) {
        CAPTURE(name);
        const test::TemporaryFolder folder;
        CHECK(difference_after_snapshots(folder.write("scene.lua", "local rapid = require \"rapid\"\n" + text), 14,
                                         &types) == "");
    }
    for (const auto& entry : fs::directory_iterator(fs::path(RAPID_SOURCE_DIR) / "graphs/nodes")) {
        if (entry.path().extension() != ".lua") continue;
        CAPTURE(entry.path().string());
        CHECK(difference_after_snapshots(entry.path(), 6, &types) == "");
    }
    const Registry registry = Session::all_node_types();
    for (const NodeType* type : registry.types()) {
        const bool is_of_nodes = !type->defined_in.empty() && !type->find("kernel");
        if (is_of_nodes || types.count(type->name) == 1 || type->name.rfind("counting_", 0) == 0) continue;
        CAPTURE(type->name);  // on failure: the node requires arguments; add a scene of it to scenes_with_state.h
        const test::TemporaryFolder folder;
        CHECK(difference_after_snapshots(folder.write("scene.lua", scene_of_defaults(type->name)), 14, &types) == "");
        CHECK(types.count(type->name) == 1);
    }
}

// Loads the state of a file, runs some frames, and writes the state to another. Runs in a separate process: see below.
TEST_CASE("continues after the snapshot that RAPID_TEST_SNAPSHOT names", "[.]")
{
    const fs::path folder = std::getenv("RAPID_TEST_SNAPSHOT");
    Snapshot snapshot;
    restore(snapshot, StateFile(folder / "before").state());
    Run run(folder / "scene.lua");
    run.evaluator().load(snapshot);
    for (int k = 0; k < 6; ++k) run.evaluator().advance();
    write_state(folder / "after", {{"frame", run.evaluator().next_frame() - 1}}, state_of(run.evaluator().save()));
}

TEST_CASE("a run after a snapshot in another process equals the uninterrupted run", "[snapshot]")
{
    for (const auto& [name, text] : test::scenes_with_state) {
        CAPTURE(name);
        const test::TemporaryFolder folder;
        Run whole(folder.write("scene.lua", "local rapid = require \"rapid\"\n" + text));
        for (int k = 0; k < 5; ++k) whole.evaluator().advance();
        write_state(folder / "before", {{"frame", 5}}, state_of(whole.evaluator().save()));
        for (int k = 0; k < 6; ++k) whole.evaluator().advance();

        const std::string program = fs::read_symlink("/proc/self/exe").string();
        const std::string command = "RAPID_TEST_SNAPSHOT='" + folder.path().string() + "' '" + program +
                                    "' 'continues after the snapshot that RAPID_TEST_SNAPSHOT names' >/dev/null";
        REQUIRE(std::system(command.c_str()) == 0);
        Snapshot after;
        restore(after, StateFile(folder / "after").state());
        CHECK(difference(after, whole.evaluator().save()) == "");
    }
}

TEST_CASE("a node that keeps something and does not say it is found", "[snapshot]")
{
    const auto scene = [](const std::string& node) {
        return "local rapid = require \"rapid\"\n"
               "return rapid.create { points = rapid.points.from { P = { {0, 0, 0} } } } :" +
               node + " {} :solve {}";
    };
    const test::TemporaryFolder folder;
    CHECK(difference_after_snapshots(folder.write("openly.lua", scene("counting_openly")), 8) == "");
    CHECK(difference_after_snapshots(folder.write("secretly.lua", scene("counting_secretly")), 8) ==
          "from frame 2: frame 3: the points of main");
}

TEST_CASE("a snapshot of another graph is refused", "[snapshot]")
{
    const test::TemporaryFolder folder;
    const auto scene = [&](const std::string& name, const std::string& chain) {
        return folder.write(name, "local rapid = require \"rapid\"\nreturn rapid.create {}" + chain + ":solve {}");
    };
    Run one(scene("one.lua", ":emit { source = rapid.mesh.sphere {}, rate = 100 }"));
    one.evaluator().advance();
    Run other(scene("other.lua", ":emit { source = rapid.mesh.sphere {}, rate = 100 } :contact {}"));
    CHECK_THROWS_AS(other.evaluator().load(one.evaluator().save()), Error);
}

TEST_CASE("a snapshot shares the columns that no frame has changed since", "[snapshot]")
{
    const test::TemporaryFolder folder;
    Run run(folder.write("scene.lua", R"(local rapid = require "rapid"
        return rapid.create {} :emit { source = rapid.mesh.sphere {}, impulse = { [1] = 1000 },
                                       attributes = { heat = {0, 1} } } :gravity {} :solve {})"));
    run.evaluator().advance();
    run.evaluator().advance();
    const auto heat_of = [](const FrameResult& frame) { return frame.outputs.at("main").column<float>("heat"); };
    const Column<float> heat = heat_of(run.evaluator().advance());
    const Snapshot snapshot = run.evaluator().save();
    const auto& columns = snapshot.simulations.at("create1").columns;
    CHECK(std::any_of(columns.begin(), columns.end(), [&](const SavedColumn& any) {
        const auto* column = std::get_if<Column<float>>(&any);
        return column && column->shares_values_with(heat);
    }));
    CHECK(heat_of(run.evaluator().advance()).shares_values_with(heat));
}

TEST_CASE("a run copies no column, but those that a snapshot of it holds", "[snapshot]")
{
    const test::TemporaryFolder folder;
    Run run(folder.write("scene.lua", R"(local rapid = require "rapid"
        return rapid.create {} :emit { source = rapid.mesh.sphere {}, impulse = { [1] = 1000 } }
          :points("push", function(p) p.v = p.v * (1 - p.dt) end) :gravity {} :solve {})"));
    const auto next = [&] {
        const FrameResult frame = run.evaluator().advance();
        const PointSet& points = frame.outputs.at("main");
        return std::pair(points.P().read().data, points.v().read().data);
    };
    next();
    const auto places = next();
    for (int frame = 3; frame < 10; ++frame) CHECK(next() == places);
    const Snapshot snapshot = run.evaluator().save();
    const auto copied = next();
    CHECK(copied.first != places.first);
    CHECK(copied.second != places.second);
}

}  // namespace rapid
