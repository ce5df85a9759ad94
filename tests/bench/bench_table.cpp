// The table of how near Rapid is to its limits. Each figure stands next to one of the same run on the same machine, so
// the ratios hold anywhere. Runs the other benchmarks in this folder, and whole scenes with the command.
//
//   tests/bench/run [--json FILE] [--repeat N] [--only TEXT | --write]
//
// The table quotes ratios of medians. The programs that are compared run in turn, so other load on the machine affects
// both sides.
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/io/format.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Words = std::vector<std::string>;

struct Row {
    std::string name;
    double value, limit;
    std::string unit;       // "" for a ratio
    bool at_least = false;  // of the limit
    std::string detail;

    bool reached() const { return at_least ? value >= limit : value <= limit; }
};

// Reasons why rows miss their targets, by a part of the row's name; the first that matches.
constexpr std::pair<std::string_view, std::string_view> reasons[] = {
    {"a program by hand", "the program by hand estimates no error, keeps no audit and is not reproducible"},
    {"time of one thread alone", "births and the order of points are computed on one thread"},
    {"embers.lua: two threads", "births are computed on one thread"},
    {"magic.lua: two threads", "births are computed on one thread"},
    {"the same of three sizes",
     "neighbours of different sizes lie in several grids, and light grains carry heavy ones"},
    {"a grain", "the columns of a larger set do not fit into the cache"},
    {"all overlaps", "one iteration for each substep carries the weight of a deep column only a few layers"},
    {"99 % of overlaps", "one iteration for each substep carries the weight of a deep column only a few layers"},
    {"column of 10,000 grains, a frame", "ten substeps solve all contacts in sequence of their colours"},
    {"times faster than Blender", "a part of the time is the start of the process and its first frame"},
    {"lua: pruned / --keep-all", "nothing can be pruned in this scene, so the ratio is 1 within the noise"},
    {"a run with -o .vdb", "on two processors computing and writing share the memory's bandwidth"},
};

double median(std::vector<double> x)
{
    std::sort(x.begin(), x.end());
    return x.size() % 2 ? x[x.size() / 2] : 0.5 * (x[x.size() / 2 - 1] + x[x.size() / 2]);
}

struct Ended {
    double seconds;
    double processor;  // s, summed over all threads
    double bytes;      // peak resident memory
};

// Runs a program to its end. Throws std::runtime_error if it fails.
Ended run(const Words& words, const fs::path& output = "/dev/null")
{
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const auto began = std::chrono::steady_clock::now();
    pid_t child = 0;
    const int failed = posix_spawn(&child, arguments[0], &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (failed) throw std::runtime_error(fmt::format("can't run {}", words[0]));
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw std::runtime_error(fmt::format("failed: {}", fmt::join(words, " ")));
    const auto seconds_of = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return {seconds, seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime),
            1024.0 * static_cast<double>(usage.ru_maxrss)};
}

// The number of points and the moments of their positions, which two runs of a scene with different random numbers have
// in common.
struct Moments {
    double points;
    std::array<double, 3> mean, deviation;  // m, of P along each axis
};

Moments moments_of(const rapid::PointSet& points)
{
    const auto n = static_cast<double>(points.size());
    Moments m{n, {}, {}};
    const auto P = points.P().read();
    for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) m.mean[k] += P[i][k] / n;
    for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) m.deviation[k] += std::pow(P[i][k] - m.mean[k], 2) / n;
    for (double& d : m.deviation) d = std::sqrt(d);
    return m;
}

// Throws std::runtime_error if the two runs differ by more than chance: five standard errors of each moment, plus a
// thousandth of the points' extent for the difference between a table of distances and a level set.
void require_alike(const std::string& scene, const Moments& a, const Moments& b)
{
    const double n = std::min(a.points, b.points), shape = 1e-3;
    bool alike = std::abs(a.points - b.points) <= 5 * std::sqrt(2 * n);
    for (std::size_t k = 0; k < 3; ++k) {
        const double most = a.deviation[k] * (5 * std::sqrt(2 / n) + shape);
        alike = alike && std::abs(a.mean[k] - b.mean[k]) <= most && std::abs(a.deviation[k] - b.deviation[k]) <= most;
    }
    if (alike) return;
    const auto text = [](const Moments& m) {
        return fmt::format("{} points, mean {:.5f}, deviation {:.5f}", m.points, fmt::join(m.mean, " "),
                           fmt::join(m.deviation, " "));
    };
    throw std::runtime_error(fmt::format("{} and the program by hand differ:\n  {}\n  {}", scene, text(a), text(b)));
}

class Table {
public:
    Table(fs::path bin, fs::path graphs, int repeat, std::string only)
        : bin_(std::move(bin)), graphs_(std::move(graphs)), repeat_(repeat), only_(std::move(only))
    {
        scratch_ = fs::temp_directory_path() / fmt::format("rapid-bench-{}", getpid());
        fs::create_directories(scratch_);
    }
    ~Table() { fs::remove_all(scratch_); }
    Table(const Table&) = delete;
    Table& operator=(const Table&) = delete;

    void fill()
    {
        fall();
        forces();
        colliders();
        grains();
        neighbours();
        formats();
        small_scenes();
        static_level_set();
        deforming_figure();
        still_points();
        first_frame();
        pictures();
        tolerance_check();
        scripts();
        main_job();
        output();
        examples();
        growth();
        by_hand();  // last: it reads points, and a forked process's peak memory includes its parent's
    }

    // All rows, with the reason if one misses its target.
    std::string as_markdown() const
    {
        std::string text = "| | measured | target | why the target is missed |\n|---|---|---|---|\n";
        for (const Row& row : rows_)
            text += fmt::format("{} {} |\n", beginning_of(row), row.reached() ? "" : reason(row.name));
        return text;
    }

    // The rows that matter when choosing a particle system.
    std::string chosen_as_markdown() const
    {
        std::string text = "| | measured | target |\n|---|---|---|\n";
        for (const char* name :
             {"first.lua: a run of its first frame", "first.lua, a million points: times faster than Blender's 10.7 s",
              "first.lua: two threads / one", "gravity, 10 million points, two threads / loop by hand",
              "memory of gravity on 10 million points, a point", "column of 10,000 grains, a frame"})
            for (const Row& row : rows_)
                if (row.name == name) text += beginning_of(row) + "\n";
        return text;
    }

    json as_json() const
    {
        json rows = json::array();
        for (const Row& row : rows_)
            rows.push_back({{"name", row.name},
                            {"value", row.value},
                            {"limit", row.limit},
                            {"unit", row.unit},
                            {"at_least", row.at_least},
                            {"reached", row.reached()},
                            {"detail", row.detail}});
        return {{"rows", rows}};
    }

private:
    static std::string beginning_of(const Row& row)
    {
        return fmt::format("| {} | {:.3g}{} | at {} {:.4g} |", row.name, row.value,
                           row.unit.empty() ? "" : " " + row.unit, row.at_least ? "least" : "most", row.limit);
    }

    static std::string_view reason(std::string_view name)
    {
        for (const auto& [part, text] : reasons)
            if (name.find(part) != name.npos) return text;
        return "not yet examined";
    }

    bool requested(const std::string& name) const { return name.find(only_) != std::string::npos; }

    void add(Row row)
    {
        fmt::print("{:<62} {:>9.3g} {:<5} {} {:<6.4g} {}   {}\n", row.name, row.value, row.unit,
                   row.at_least ? "at least" : "at most ", row.limit, row.reached() ? "  " : "NO", row.detail);
        std::fflush(stdout);
        rows_.push_back(std::move(row));
    }

    // Returns medians of several benchmarks of one program, run in turn: times in ms, and counters.
    std::map<std::string, json> measure(const std::string& program, const Words& names) const
    {
        const fs::path answer = scratch_ / "benchmarks.json";
        run({(bin_ / program).string(), fmt::format("--benchmark_filter=^({})$", fmt::join(names, "|")),
             fmt::format("--benchmark_repetitions={}", repeat_), "--benchmark_enable_random_interleaving=true",
             "--benchmark_min_time=0.2", "--benchmark_format=json"},
            answer);
        std::map<std::string, json> medians;
        std::ifstream file(answer);
        const json all = json::parse(file);
        for (const json& one : all.at("benchmarks"))
            if (one.value("aggregate_name", "") == "median") medians[one.at("run_name")] = one;
        for (const std::string& name : names)
            if (!medians.count(name)) throw std::runtime_error(fmt::format("{} has no benchmark {}", program, name));
        return medians;
    }

    void compare(const std::string& name, const std::string& program, const std::string& ours,
                 const std::string& theirs, double limit)
    {
        if (!requested(name)) return;
        const auto medians = measure(program, {ours, theirs});
        const double a = medians.at(ours).at("real_time"), b = medians.at(theirs).at("real_time");
        add({name, a / b, limit, "", false, fmt::format("{:.4g} ms, {:.4g} ms", a, b)});
    }

    fs::path scene(const std::string& name, const std::string& text) const
    {
        const fs::path file = scratch_ / (name + ".lua");
        std::ofstream(file) << "local rapid = require \"rapid\"\n" << text;
        return file;
    }

    Words command(const fs::path& graph, const Words& options) const
    {
        Words words = {(bin_ / "rapid").string(), "run", graph.string(), "--quiet"};
        words.insert(words.end(), options.begin(), options.end());
        return words;
    }

    // Returns the frames of a run from its --stats file.
    json frames_of(const fs::path& graph, Words options) const
    {
        const fs::path stats = scratch_ / "stats.json";
        options.insert(options.end(), {"--stats", stats.string()});
        run(command(graph, options));
        std::ifstream file(stats);
        return json::parse(file).at("frames");
    }

    // Returns the time to build the bands of the frame's level sets, s.
    static double band_seconds(const json& frame)
    {
        double seconds = 0;
        for (const json& band : frame.value("bands", json::array())) seconds += double(band.at("seconds"));
        return seconds;
    }

    // Returns medians of whole runs, executed in turn.
    std::vector<Ended> in_turn(const std::vector<Words>& commands) const
    {
        std::vector<std::vector<double>> seconds(commands.size()), processor(commands.size()), bytes(commands.size());
        for (int k = 0; k < repeat_; ++k)
            for (std::size_t c = 0; c < commands.size(); ++c) {
                const Ended ended = run(commands[c]);
                seconds[c].push_back(ended.seconds);
                processor[c].push_back(ended.processor);
                bytes[c].push_back(ended.bytes);
            }
        std::vector<Ended> all;
        for (std::size_t c = 0; c < commands.size(); ++c)
            all.push_back({median(seconds[c]), median(processor[c]), median(bytes[c])});
        return all;
    }

    void compare_runs(const std::string& name, const Words& ours, const Words& theirs, double limit)
    {
        if (!requested(name)) return;
        const std::vector<Ended> ended = in_turn({ours, theirs});
        add({name, ended[0].seconds / ended[1].seconds, limit, "", false,
             fmt::format("{:.3f} s, {:.3f} s", ended[0].seconds, ended[1].seconds)});
    }

    void fall()
    {
        compare("gravity, 10 million points, two threads / loop by hand", "bench_solver",
                "free_fall_rapid/threads:2/real_time", "free_fall_by_hand/threads:2/real_time", 1.3);
        compare("the same with 16 sub-steps / with one", "bench_solver",
                "free_fall_rapid_16_substeps/threads:2/real_time", "free_fall_rapid/threads:2/real_time", 3);
    }

    void forces()
    {
        compare("gravity, drag and wind / gravity alone", "bench_forces", "air_alike/substeps:1",
                "gravity_alone/substeps:1", 1.5);
        compare("the same with 16 sub-steps / with one", "bench_forces", "air_alike/substeps:16",
                "air_alike/substeps:1", 4);
    }

    void colliders()
    {
        compare("a collider that no point is near / without it", "bench_solver",
                "far_from_level_set/threads:2/real_time", "nothing_to_hit/threads:2/real_time", 1.2);
    }

    // By the time on one thread; overlaps at the end, in units of the smaller radius.
    void grains()
    {
        const std::string name = "column of 10,000 grains, a frame";
        if (!requested(name)) return;
        const auto column = [](const char* points, int sizes, int substeps, int frames) {
            return fmt::format("column/points:{}/threads:1/sizes:{}/substeps:{}/frames:{}/iterations:1", points, sizes,
                               substeps, frames);
        };
        const std::string one = column("10000", 1, 10, 48), deeper = column("30000", 1, 10, 48);
        const std::string sizes = column("10000", 3, 14, 48), deep = column("100000", 1, 10, 48);
        const std::string few = column("10000", 1, 10, 6), million = column("1000000", 1, 10, 6);
        const auto medians = measure("bench_contacts", {one, deeper, sizes, deep, few, million});
        const auto ms = [&](const std::string& of) { return medians.at(of).at("cpu_time").get<double>(); };
        const auto overlaps = [&](const std::string& what, const std::string& of) {
            add({what + ": 99 % of overlaps", medians.at(of).at("p99"), 0.05, "r", false, ""});
            add({what + ": all overlaps", medians.at(of).at("worst"), 0.15, "r", false, ""});
        };
        add({name, ms(one) / 48, 25, "ms", false, ""});
        overlaps("the same", one);
        add({"the same of 30,000 / of 10,000", ms(deeper) / ms(one), 3.5, "", false, ""});
        overlaps("the same of 30,000", deeper);
        add({"the same of three sizes / of one", ms(sizes) / ms(one), 1.5, "", false, ""});
        overlaps("the same of three sizes", sizes);
        add({"the same of 100,000 / of 10,000, a grain", ms(deep) / ms(one) / 10, 1.1, "", false, ""});
        overlaps("the same of 100,000", deep);
        add({"the same of a million / of 10,000, a grain, six frames", ms(million) / ms(few) / 100, 1.1, "", false,
             ""});
    }

    // About six neighbours for each of a million points, on one thread.
    void neighbours()
    {
        const std::string name = "a million neighbour queries / the search for contacts";
        if (!requested(name)) return;
        const auto medians = measure("bench_points", {"find_neighbours/100", "find_contacts/100"});
        const double ours = medians.at("find_neighbours/100").at("cpu_time"),
                     theirs = medians.at("find_contacts/100").at("cpu_time");
        add({name, ours / theirs, 1, "", false,
             fmt::format("{:.3g} and {:.3g} million a second", 1000 / ours, 1000 / theirs)});
    }

    void formats()
    {
        const auto write = [](const char* format) {
            return fmt::format("write_format/{}/process_time/real_time", format);
        };
        compare("writing .vdb / bare OpenVDB", "bench_io", write("vdb"), "bare_openvdb/process_time/real_time", 1.25);
        compare("writing .bgeo / raw interleaved write", "bench_io", write("bgeo"),
                "raw_interleaved/process_time/real_time", 1.3);
        compare("writing .ply / raw interleaved write", "bench_io", write("ply"),
                "raw_interleaved/process_time/real_time", 1.3);
    }

    void small_scenes()
    {
        const fs::path empty = scene("empty", "return rapid.create {} :solve {}\n");
        const std::string name = "run of an empty scene", memory = "memory of an empty scene";
        const std::string points = "memory of gravity on 10 million points, a point";
        if (requested(name))
            add({name, 1000 * in_turn({command(empty, {"-f", "1-1"})})[0].seconds, 60, "ms", false, ""});
        if (requested(memory))
            add({memory, in_turn({command(empty, {"-f", "1-2"})})[0].bytes / 1e6, 60, "MB", false, ""});
        if (!requested(points)) return;
        const fs::path crowd = scene("crowd",
                                     "return rapid.create {}\n"
                                     "  :emit { source = rapid.shape.box { size = {10, 10, 10} }, from = \"volume\",\n"
                                     "          impulse = { [1] = 1e7 } }\n"
                                     "  :gravity {} :solve {}\n");
        const std::vector<Ended> ended = in_turn({command(empty, {"-f", "1-2"}), command(crowd, {"-f", "1-4"})});
        add({points, (ended[1].bytes - ended[0].bytes) / 1e7, 72, "bytes", false, ""});
    }

    // The time outside of scripts and Solve, and the time for the level set's band, after the first two frames.
    void static_level_set()
    {
        const std::string name = "a static level set, frames after the first: time in the graph";
        if (!requested(name)) return;
        const fs::path still = scene("still",
                                     "local body = rapid.mesh.torus { radius = 0.6, tube = 0.22, divisions = 64 }\n"
                                     "return rapid.create {\n"
                                     "    points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.02 } }\n"
                                     "  :gravity {}\n"
                                     "  :collide { shape = rapid.levelset.from_mesh(body, { voxel = 0.02 }) }\n"
                                     "  :solve {}\n");
        std::vector<double> ms, of_first;
        for (int k = 0; k < repeat_; ++k)
            for (const json& frame : frames_of(still, {"-f", "1-24"})) {
                const double seconds = double(frame.at("seconds").at("graph")) + band_seconds(frame);
                (frame.at("frame") <= 2 ? of_first : ms).push_back(1000 * seconds);
            }
        add({name, median(ms), 0.1, "ms", false, fmt::format("the first two: {:.3g} ms", 2 * median(of_first))});
    }

    // A ring that leans from frame to frame, 96 by 32 vertices.
    void write_figure(int frames) const
    {
        constexpr int around = 96, across = 32;
        constexpr double turn = 6.283185307179586;
        for (int frame = 1; frame <= frames; ++frame) {
            std::ofstream file(scratch_ / fmt::format("figure.{:04}.obj", frame));
            for (int i = 0; i < around; ++i)
                for (int j = 0; j < across; ++j) {
                    const double a = turn * i / around, b = turn * j / across, r = 0.6 + 0.22 * std::cos(b);
                    const double y = r * std::sin(a);
                    file << fmt::format("v {} {} {}\n", r * std::cos(a) + 0.02 * frame * y, y, 0.22 * std::sin(b));
                }
            const auto vertex = [](int i, int j) { return 1 + i % around * across + j % across; };
            for (int i = 0; i < around; ++i)
                for (int j = 0; j < across; ++j)
                    file << fmt::format("f {} {} {} {}\n", vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1),
                                        vertex(i, j + 1));
        }
    }

    // The time to build its bands, from --stats.
    void deforming_figure()
    {
        const std::string name = "three :collide on a deforming level set / one, time to build it";
        if (!requested(name)) return;
        write_figure(12);
        const auto build_seconds = [&](int colliders) {
            std::string text =
                "local figure = rapid.levelset.from_mesh(rapid.mesh.read \"figure.####.obj\", { voxel = 0.01 })\n"
                "return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2 } } :gravity {}\n";
            for (int k = 0; k < colliders; ++k) text += "  :collide { shape = figure }\n";
            double seconds = 0;
            for (const json& frame : frames_of(scene("figure", text + "  :solve {}\n"), {"-f", "1-12"}))
                seconds += band_seconds(frame);
            return seconds;
        };
        std::vector<double> three, one;
        for (int k = 0; k < repeat_; ++k) three.push_back(build_seconds(3)), one.push_back(build_seconds(1));
        add({name, median(three) / median(one), 1.1, "", false,
             fmt::format("{:.3f} s, {:.3f} s", median(three), median(one))});
    }

    // The frames after the first two, from --stats.
    void still_points()
    {
        const std::string name = "a million points at rest, a frame";
        if (!requested(name)) return;
        const fs::path still = scene("at_rest",
                                     "return rapid.create {\n"
                                     "    points = rapid.points.grid { size = {2, 2, 2}, spacing = 0.02 } }\n"
                                     "  :solve {}\n");
        std::vector<double> ms;
        for (int k = 0; k < repeat_; ++k)
            for (const json& frame : frames_of(still, {"-f", "1-24"}))
                if (frame.at("frame") > 2) ms.push_back(1000 * double(frame.at("seconds").at("total")));
        add({name, median(ms), 1, "ms", false, ""});
    }

    void first_frame()
    {
        const std::string name = "first.lua: a run of its first frame";
        if (!requested(name)) return;
        const Ended ended = in_turn({command(graphs_ / "first.lua", {"-f", "1-1"})})[0];
        add({name, 1000 * ended.seconds, 50, "ms", false, fmt::format("{:.3f} s of processor", ended.processor)});
    }

    // The frames of first.lua with 60,000 points, minus the same without pictures and with as many attributes, minus
    // the first two frames.
    void pictures()
    {
        const std::string name = "a .png of 1280 x 720, 60,000 points, processor time";
        if (!requested(name)) return;
        const fs::path graph = graphs_ / "first.lua";
        const std::string files = (scratch_ / "picture.####.png").string();
        const std::vector<Ended> ended = in_turn({command(graph, {"-f", "71-120", "--keep-all", "-o", files}),
                                                  command(graph, {"-f", "71-120", "--keep-all"}),
                                                  command(graph, {"-f", "71-72", "--keep-all", "-o", files}),
                                                  command(graph, {"-f", "71-72", "--keep-all"})});
        const double seconds = (ended[0].processor - ended[1].processor) - (ended[2].processor - ended[3].processor);
        add({name, 1000 * seconds / 48, 40, "ms", false, ""});
    }

    // Among the README's scenes only mill has a tolerance. It is checked in each of the first four steps, which have
    // few points, and then in every fourth: the extra time of a frame with the check over the frames before and after
    // it.
    void tolerance_check()
    {
        const std::string name = "mill.lua: checking its tolerance, of the time of the run";
        if (!requested(name)) return;
        constexpr int first = 6, every = 4, last = 71;
        std::vector<double> parts;
        for (int k = 0; k < repeat_; ++k) {
            std::vector<double> seconds(1);
            for (const json& frame :
                 frames_of(graphs_ / "mill.lua", {"-f", fmt::format("1-{}", last), "--threads", "1"}))
                seconds.push_back(frame.at("seconds").at("total"));
            double checks = 0, total = 0;
            for (const double s : seconds) total += s;
            for (int f = first; f < last; f += every)
                checks += seconds.at(f) - 0.5 * (seconds.at(f - 1) + seconds.at(f + 1));
            parts.push_back(checks / (total - checks));
        }
        add({name, median(parts), 0.02, "", false, ""});
    }

    void scripts()
    {
        const std::string emit =
            "local cloud = rapid.create {}\n"
            "  :emit { source = rapid.shape.box {}, from = \"volume\", rate = 4e6 }\n"
            "local function slow(p) p.v = p.v * 0.99 end\n"
            "local function drawn(p, frame) p.v = p.v - p.P * frame.dt end\n"
            "local function held(p) if p.P.y < 0 then p.v = p.v + vec3(0, 0.1, 0) end end\n";
        const fs::path three = scene("three", emit +
                                                  "return cloud :points(\"a\", slow) :points(\"b\", drawn)\n"
                                                  "  :points(\"c\", held) :solve {}\n");
        const fs::path one = scene("one", emit +
                                              "return cloud :points(\"a\", function(p, frame)\n"
                                              "  p.v = p.v * 0.99\n"
                                              "  p.v = p.v - p.P * frame.dt\n"
                                              "  if p.P.y < 0 then p.v = p.v + vec3(0, 0.1, 0) end\n"
                                              "end) :solve {}\n");
        compare_runs("three Lua nodes / one with the three bodies", command(three, {"-f", "1-48"}),
                     command(one, {"-f", "1-48"}), 1.15);
    }

    void main_job()
    {
        const std::string name = "first.lua, a million points: times faster than Blender's 10.7 s";
        if (!requested(name)) return;
        const double seconds =
            in_turn({command(graphs_ / "first.lua", {"--set", "rate=500000", "-f", "1-48"})})[0].seconds;
        add({name, 10.7 / seconds, 25, "", true, fmt::format("{:.3f} s", seconds)});
    }

    // Compares with programs written for one scene each (by_hand/by_hand.h), by the time of all threads.
    void by_hand()
    {
        struct Scene {
            const char *name, *points, *rate;
            double limit;
        };
        for (const Scene& each :
             {Scene{"first", "a million", "500000", 1}, Scene{"sparks", "800,000", "800000", 1.2},
              Scene{"spray", "a million", "975000", 1.2}, Scene{"embers", "a million", "500000", 1.2},
              Scene{"magic", "a million", "300000", 1.2}, Scene{"mill", "40,000", "20000", 1.2}}) {
            const std::string name =
                fmt::format("{}.lua, {} points / a program by hand, processor time", each.name, each.points);
            if (!requested(name)) continue;
            const Words program = {(bin_ / fmt::format("by_hand_{}", each.name)).string(), each.rate, "48"};
            const fs::path graph = graphs_ / fmt::format("{}.lua", each.name);
            const std::string rate = fmt::format("rate={}", each.rate);
            const fs::path last = scratch_ / fmt::format("{}.npz", each.name), answer = scratch_ / "moments.json";
            run(command(graph, {"--set", rate, "-f", "48", "-o", last.string()}));
            run(program, answer);
            std::ifstream file(answer);
            const json reported = json::parse(file);
            require_alike(graph.filename().string(), moments_of(rapid::read_points(last)),
                          {reported.at("points"), reported.at("mean"), reported.at("deviation")});
            fs::remove(last);
            const std::vector<Ended> ended = in_turn({command(graph, {"--set", rate, "-f", "1-48"}), program});
            add({name, ended[0].processor / ended[1].processor, each.limit, "", false,
                 fmt::format("{:.3f} s, {:.3f} s", ended[0].processor, ended[1].processor)});
        }
    }

    // The number of points is constant, so the files of one frame are written during the computation of the next. The
    // writing alone repeats the last frame's points equally often.
    void output()
    {
        const std::string name = "a run with -o .vdb / the longer of computing and writing";
        if (!requested(name)) return;
        const fs::path moving = scene("moving",
                                      "return rapid.create {\n"
                                      "    points = rapid.points.grid { size = {2, 2, 2}, spacing = 0.02 } }\n"
                                      "  :points(\"swirl\", function(p)\n"
                                      "    p.v = p.v + vec3(0, 1, 0):cross(p.P) * p.dt end)\n"
                                      "  :gravity {} :turbulence {}\n"
                                      "  :collide { shape = rapid.shape.plane { offset = -1.5 } } :solve {}\n");
        run(command(moving, {"-f", "12", "-o", (scratch_ / "last.vdb").string()}));
        const fs::path still = scene("unmoved", "return rapid.create { points = rapid.points.read(\"last.vdb\") }\n");
        const Words frames = {"-f", "1-12"};
        Words files = frames;
        files.insert(files.end(), {"-o", (scratch_ / "out.####.vdb").string()});
        const std::vector<Ended> ended =
            in_turn({command(moving, files), command(moving, frames), command(still, files), command(still, frames)});
        const double both = ended[0].seconds, computing = ended[1].seconds,
                     writing = ended[2].seconds - ended[3].seconds;
        add({name, both / std::max(computing, writing), 1.1, "", false,
             fmt::format("{:.3f} s, {:.3f} s, {:.3f} s", both, computing, writing)});
    }

    // Half a million points or more, so that the start does not count.
    void examples()
    {
        const std::vector<std::pair<std::string, std::string>> scenes = {
            {"first", "500000"}, {"sparks", "800000"}, {"spray", "500000"}, {"embers", "500000"}, {"magic", "300000"}};
        for (const auto& [scene, rate] : scenes) {
            const auto with = [&, &file = scene, &births = rate](Words more) {
                more.insert(more.end(), {"-f", "1-48", "--set", "rate=" + births});
                return command(graphs_ / (file + ".lua"), more);
            };
            compare_runs(scene + ".lua: two threads / one", with({"--threads", "2"}), with({"--threads", "1"}), 0.56);
            // Other load makes wall time too noisy for a difference of a few percent.
            const std::string time = scene + ".lua: pruned / --keep-all, processor time";
            const std::string memory = scene + ".lua: pruned / --keep-all, memory";
            if (!requested(time) && !requested(memory)) continue;
            const std::vector<Ended> ended = in_turn({with({}), with({"--keep-all"})});
            add({time, ended[0].processor / ended[1].processor, 1.0, "", false,
                 fmt::format("{:.3f} s, {:.3f} s", ended[0].processor, ended[1].processor)});
            add({memory, ended[0].bytes / ended[1].bytes, 1.0, "", false,
                 fmt::format("{:.0f} MB, {:.0f} MB", ended[0].bytes / 1e6, ended[1].bytes / 1e6)});
        }
    }

    // The exponent of processor time in the number of points, over two decades, and the fraction of a run in which one
    // of two threads waits for the other. The first frame is subtracted from each run, because it includes the start.
    void growth()
    {
        const std::vector<std::pair<std::string, double>> scenes = {
            {"first", 500000}, {"sparks", 1000000}, {"spray", 975000}, {"embers", 500000}, {"magic", 300000}};
        for (const auto& [scene, rate] : scenes) {
            const std::string small = scene + ".lua: 100,000 points / 10,000, exponent of the processor time";
            const std::string large = scene + ".lua: a million points / 100,000, exponent of the processor time";
            const std::string alone = scene + ".lua: time of one thread alone, of the processor time";
            if (!requested(small) && !requested(large) && !requested(alone)) continue;
            const auto with = [&, &file = scene, births = rate](double part, const char* frames) {
                return command(graphs_ / (file + ".lua"),
                               {"--threads", "2", "-f", frames, "--set", fmt::format("rate={}", part * births)});
            };
            const std::vector<Ended> ended = in_turn({with(0.01, "1-1"), with(0.01, "1-48"), with(0.1, "1-1"),
                                                      with(0.1, "1-48"), with(1, "1-1"), with(1, "1-48")});
            const auto taken = [&](int size) { return ended[2 * size + 1].processor - ended[2 * size].processor; };
            add({small, std::log10(taken(1) / taken(0)), 1.05, "", false, ""});
            add({large, std::log10(taken(2) / taken(1)), 1.05, "", false, ""});
            const double processor = taken(2), wall = ended[5].seconds - ended[4].seconds;
            add({alone, (2 * wall - processor) / processor, 0.01, "", false,
                 fmt::format("{:.3f} s, {:.3f} s of processor", wall, processor)});
        }
    }

    const fs::path bin_, graphs_;
    const int repeat_;
    const std::string only_;
    fs::path scratch_;
    std::vector<Row> rows_;
};

// Replaces the text between the document's two lines that name the benchmark. Throws std::runtime_error if the document
// lacks these lines.
void write_table(const fs::path& path, const std::string& table)
{
    const std::string begin = "<!-- table of tests/bench/run -->\n", end = "<!-- end of the table -->\n";
    std::ifstream file(path);
    std::string text(std::istreambuf_iterator<char>(file), {});
    const std::size_t from = text.find(begin), to = text.find(end);
    if (from == text.npos || to == text.npos || to < from)
        throw std::runtime_error(fmt::format("{} has no place for the table", path.string()));
    std::ofstream(path) << text.substr(0, from) << begin << table << text.substr(to);
}

}  // namespace

int main(int count, char** words)
{
    CLI::App app("how near Rapid is to its limits");
    std::string out, only;
    int repeat = 5;
    app.add_option("--json", out, "writes the table as JSON too")->type_name("FILE");
    app.add_option("--repeat", repeat, "runs of each figure, of which the median is taken")->check(CLI::PositiveNumber);
    CLI::Option* some = app.add_option("--only", only, "rows whose name has this text")->type_name("TEXT");
    bool write = false;
    app.add_flag("--write", write, "writes the tables of docs/performance.md and README.md")->excludes(some);
    CLI11_PARSE(app, count, words);
    try {
        const fs::path bin = fs::read_symlink("/proc/self/exe").parent_path();
        Table table(bin, fs::path(RAPID_SOURCE_DIR) / "graphs", repeat, only);
        table.fill();
        if (!out.empty()) std::ofstream(out) << table.as_json().dump(2) << '\n';
        if (write) {
            const fs::path project = RAPID_SOURCE_DIR;
            write_table(project / "docs/performance.md", table.as_markdown());
            write_table(project / "README.md", table.chosen_as_markdown());
        }
    } catch (const std::exception& error) {
        fmt::print(stderr, "bench: {}\n", error.what());
        return 1;
    }
    return 0;
}
