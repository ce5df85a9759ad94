// Dependencies point downward: compares the includes of all sources with a table of allowed edges.
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/test.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// The folders that a folder's files may include, besides their own. runtime/base (errors, memory, threads) and
// runtime/math (vectors, random numbers) are at the bottom.
const std::map<std::string, std::set<std::string>> below = {
    {"runtime/base", {}},
    {"runtime/math", {}},
    {"runtime/files", {"runtime/base", "runtime/math"}},
    {"runtime/points", {"runtime/base", "runtime/math"}},
    {"runtime/lanes", {"runtime/base", "runtime/math"}},
    {"runtime/shapes", {"runtime/base", "runtime/math", "runtime/points"}},
    {"runtime/shapes/mesh", {"runtime/base", "runtime/math", "runtime/files", "runtime/shapes"}},
    {"runtime/shapes/scatter", {"runtime/base", "runtime/math", "runtime/shapes", "runtime/shapes/mesh"}},
    {"runtime/shapes/analytic",
     {"runtime/base", "runtime/math", "runtime/shapes", "runtime/shapes/mesh", "runtime/shapes/scatter"}},
    {"runtime/shapes/level_set",
     {"runtime/base", "runtime/math", "runtime/files", "runtime/shapes", "runtime/shapes/mesh",
      "runtime/shapes/scatter"}},
    {"runtime/shapes/motion",
     {"runtime/base", "runtime/math", "runtime/shapes", "runtime/shapes/mesh", "runtime/shapes/scatter",
      "runtime/shapes/level_set"}},
    {"runtime/solver/motion", {"runtime/base", "runtime/math", "runtime/points", "runtime/solver"}},
    {"runtime/solver/collision",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes", "runtime/shapes/motion", "runtime/solver",
      "runtime/solver/motion"}},
    {"runtime/solver/constraints",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/solver", "runtime/solver/motion",
      "runtime/solver/collision"}},
    {"runtime/solver",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes", "runtime/shapes/motion",
      "runtime/solver/motion", "runtime/solver/collision", "runtime/solver/constraints"}},
    {"runtime/solver/estimate",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes", "runtime/solver", "runtime/solver/collision",
      "runtime/solver/constraints"}},
    {"runtime/processor_levels",
     {"runtime/base", "runtime/math", "runtime/lanes", "runtime/solver/motion", "runtime/solver/constraints"}},
    {"runtime/graph",
     {"runtime/base", "runtime/math", "runtime/files", "runtime/points", "runtime/shapes", "runtime/shapes/level_set",
      "runtime/shapes/motion", "runtime/solver", "runtime/solver/collision", "runtime/solver/constraints",
      "runtime/solver/estimate"}},
    {"runtime/operators/births", {"runtime/base", "runtime/math", "runtime/points", "runtime/graph"}},
    {"runtime/operators/emit",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes/mesh", "runtime/shapes/scatter",
      "runtime/shapes/level_set", "runtime/shapes/motion", "runtime/graph", "runtime/operators/births"}},
    {"runtime/operators/spawn",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/graph", "runtime/operators/births"}},
    {"runtime/operators/goal",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes/mesh", "runtime/shapes/motion",
      "runtime/shapes/scatter", "runtime/graph"}},
    {"runtime/operators/solve",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes", "runtime/shapes/level_set",
      "runtime/shapes/motion", "runtime/solver", "runtime/solver/collision", "runtime/solver/constraints",
      "runtime/solver/estimate", "runtime/graph"}},
    {"runtime/operators",
     {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes/mesh", "runtime/shapes/level_set",
      "runtime/shapes/motion", "runtime/solver", "runtime/solver/collision", "runtime/solver/constraints",
      "runtime/solver/estimate", "runtime/graph", "runtime/operators/births", "runtime/operators/emit",
      "runtime/operators/spawn", "runtime/operators/goal", "runtime/operators/solve"}},
    {"runtime/picture", {"runtime/base", "runtime/math", "runtime/points", "runtime/shapes/mesh"}},
    {"runtime/io",
     {"runtime/base", "runtime/math", "runtime/files", "runtime/points", "runtime/shapes/level_set",
      "runtime/picture"}},
    {"runtime/report",
     {"runtime/base", "runtime/math", "runtime/files", "runtime/points", "runtime/solver", "runtime/solver/estimate",
      "runtime/graph"}},
};

// Runtime headers that the command's files may include besides the promised ones: small tools that do not depend on
// points or scenes. All of runtime/files is of this kind.
const std::set<std::string> small_tools = {
    "runtime/base/cancellation.h",  "runtime/base/error.h",         "runtime/base/first_error.h",
    "runtime/base/json.h",          "runtime/base/memory_budget.h", "runtime/base/memory_watch.h",
    "runtime/base/path_list.h",     "runtime/base/printable.h",     "runtime/base/setting_names.h",
    "runtime/base/stopwatch.h",     "runtime/base/threads.h",       "runtime/picture/tone.h",
    "runtime/report/number_text.h", "runtime/report/progress.h",    "runtime/solver/figure_table.h"};

// Internal headers of the library that only the command's files may include; other programs do not need them.
const std::set<std::string> for_our_programs = {"bindings/host/graph_parameter.h", "bindings/run/study_scene.h",
                                                "bindings/scene/installation.h",   "bindings/scene/scene_film.h",
                                                "bindings/scene/scene_inside.h",   "bindings/scene/scene_tests.h"};

// Returns true for the folder of the command, or of a program that `rapid` executes.
bool is_program(const std::string& folder)
{
    return folder == "bindings/command" || fs::exists(fs::path(RAPID_SOURCE_DIR) / folder / "program.txt");
}

const std::string shared_by_programs = "bindings/command_line";

// Returns the folders of programs, and of the code that they share.
std::vector<std::string> folders_of_programs()
{
    std::vector<std::string> folders = {shared_by_programs};
    for (const auto& entry : fs::directory_iterator(fs::path(RAPID_SOURCE_DIR) / "bindings"))
        if (const std::string folder = "bindings/" + entry.path().filename().string(); is_program(folder))
            folders.push_back(folder);
    return folders;
}

bool is_inside_of_rapid(const std::string& header)
{
    const std::string folder = fs::path(header).parent_path().string();
    if (folder == shared_by_programs || folder == "include/rapid" || is_program(folder)) return false;
    return folder != "runtime/files" && small_tools.count(header) == 0 && for_our_programs.count(header) == 0;
}

struct Include {
    std::string file, folder;  // relative to the checkout
    std::string included;      // as written, without quotes or angle brackets
    bool ours;                 // in quotes
};

// Returns the includes of all sources below a folder, and of the examples in docs/extending.md for that folder.
std::vector<Include> includes_below(const std::string& folder)
{
    const fs::path root = RAPID_SOURCE_DIR;
    const std::regex directive(R"re(^\s*#\s*include\s*(["<])([^">]+)[">].*)re");
    std::vector<Include> result;
    const auto add = [&](const fs::path& file, const std::string& line) {
        if (std::smatch match; std::regex_match(line, match, directive))
            result.push_back({file.string(), file.parent_path().string(), match[2], match[1] == "\""});
    };
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
        if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
        std::ifstream text(entry.path());
        for (std::string line; std::getline(text, line);) add(fs::relative(entry.path(), root), line);
    }
    const std::string fence = "```cpp ";
    std::ifstream page(root / "docs/extending.md");
    std::string example;
    for (std::string line; std::getline(page, line);)
        if (line.starts_with("```"))
            example = line.starts_with(fence) ? line.substr(fence.size()) : "";
        else if (example.starts_with(folder + "/"))
            add(example, line);
    return result;
}

}  // namespace

TEST_CASE("a file of the runtime includes only its own folder and those below", "[layers]")
{
    const auto includes = includes_below("runtime");
    REQUIRE(includes.size() > 100);  // fails if no sources were found

    for (const Include& include : includes) {
        if (!include.ours) continue;
        CAPTURE(include.file, include.included);
        REQUIRE(below.count(include.folder) == 1);
        const std::string into = fs::path(include.included).parent_path().string();
        CHECK((into == include.folder || below.at(include.folder).count(into) == 1));
    }
}

TEST_CASE("what embeds Lua does not know the command", "[layers]")
{
    const auto includes = includes_below("bindings/host");
    REQUIRE(includes.size() > 100);

    for (const Include& include : includes) {
        CAPTURE(include.file, include.included);
        CHECK(include.included.rfind("bindings/command", 0) != 0);
    }
}

TEST_CASE("a program's face knows the scripts below it, and not the command", "[layers]")
{
    for (const auto& [folder, above] : std::map<std::string, std::set<std::string>>{
             {"bindings/host", {"bindings/scene/", "bindings/c/", "bindings/run/", "include/"}},
             {"bindings/run", {"bindings/scene/", "bindings/c/", "bindings/command", "bindings/view/"}},
             {"bindings/scene", {"bindings/command", "bindings/c/", "bindings/view/"}},
             {"bindings/c", {"bindings/command", "bindings/host/", "bindings/run/", "runtime/"}}}) {
        const auto includes = includes_below(folder);
        REQUIRE(includes.size() > 10);
        for (const Include& include : includes)
            for (const std::string& other : above) {
                CAPTURE(include.file, include.included);
                CHECK((include.included.rfind(other, 0) != 0 || include.included == "runtime/base/json.h"));
            }
    }
}

TEST_CASE("a run knows of a program's face what a program asks of a run", "[layers]")
{
    for (const Include& include : includes_below("bindings/run")) {
        CAPTURE(include.file, include.included);
        CHECK((include.included.rfind("include/", 0) != 0 || include.included == "include/rapid/run.h"));
    }
}

TEST_CASE("what programs include is what is installed", "[layers]")
{
    const auto includes = includes_below("include/rapid");
    REQUIRE(includes.size() > 10);
    for (const Include& include : includes) {
        CAPTURE(include.file, include.included);
        CHECK((!include.ours || fs::exists(fs::path(RAPID_SOURCE_DIR) / "include/rapid" / include.included)));
    }
}

TEST_CASE("neither the command nor a program knows another one, and what they share knows none", "[layers]")
{
    for (const std::string& folder : folders_of_programs())
        for (const Include& include : includes_below(folder)) {
            const std::string into = fs::path(include.included).parent_path().string();
            CAPTURE(include.file, include.included);
            CHECK((into == folder || !include.ours || !is_program(into)));
        }
}

TEST_CASE("a command is a program like others", "[layers]")
{
    // The quoted includes of each file.
    std::map<std::string, std::set<std::string>> includes;
    const std::vector<std::string> folders = folders_of_programs();
    REQUIRE(folders.size() >= 3);
    for (const std::string& folder : folders)
        for (const Include& include : includes_below(folder))
            if (include.ours) includes[include.file].insert(include.included);
    REQUIRE(includes.size() > 50);

    // Follows the command's own headers, and the headers that these include.
    const auto knows_inside = [&](const std::string& file) {
        std::set<std::string> seen = {file};
        for (std::vector<std::string> open = {file}; !open.empty();) {
            const std::string one = open.back();
            open.pop_back();
            for (const std::string& included : includes[one]) {
                if (is_inside_of_rapid(included)) return true;
                if (seen.insert(included).second) open.push_back(included);
            }
        }
        return false;
    };
    for (const auto& [file, all] : std::map(includes)) {
        INFO(file << " includes more of Rapid than include/rapid, small tools and what is there for our programs");
        CHECK_FALSE((fs::path(file).extension() == ".cpp" && knows_inside(file)));
    }
}

TEST_CASE("the library does not speak of the command's options", "[layers]")
{
    // Names of cache entries, and of arguments of ffmpeg.
    const std::set<std::string> others = {"bindings/run/part_record.h", "runtime/io/film.cpp"};
    const std::regex text(R"re("((?:[^"\\]|\\.)*)")re"), option(R"re((^|[^-\w])(--[a-z]{2,}|-[ofj](?=[ :]|$)))re");
    const fs::path root = RAPID_SOURCE_DIR;
    for (const char* folder : {"runtime", "bindings/host", "bindings/run", "bindings/scene", "bindings/c"})
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string file = fs::relative(entry.path(), root).string();
            if (!entry.is_regular_file() || others.count(file) == 1) continue;
            std::ifstream in(entry.path());
            for (std::string line; std::getline(in, line);) {
                if (line.find_first_not_of(' ') == line.find("//")) continue;
                for (std::sregex_iterator found(line.begin(), line.end(), text), end; found != end; ++found) {
                    CAPTURE(file, line);
                    CHECK_FALSE(std::regex_search((*found)[1].first, (*found)[1].second, option));
                }
            }
        }
}

TEST_CASE("only shapes and formats know OpenVDB", "[layers]")
{
    for (const Include& include : includes_below("runtime")) {
        const std::string grids = "runtime/base/openvdb_grids.h";  // shared by both
        if (include.file == grids || (include.included.rfind("openvdb/", 0) != 0 && include.included != grids))
            continue;
        CAPTURE(include.file, include.included);
        CHECK((include.folder.rfind("runtime/shapes/", 0) == 0 || include.folder == "runtime/io"));
    }
}

}  // namespace rapid
