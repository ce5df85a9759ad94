// Checks that files, folders, names and sections that the documents mention exist.
#include "runtime/solver/figure_table.h"
#include "tests/docs/document.h"

namespace rapid {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::vector<std::string> documents = {
    "docs/architecture.md", "docs/numerics.md", "docs/extending.md", "docs/host.md", "docs/reliability.md",
    "docs/cli.md",          "docs/guide.md",    "docs/lua-api.md",   "SECURITY.md",  "CONTRIBUTING.md"};

// Returns the files that a document's examples create.
std::set<std::string> example_files(const std::string& text)
{
    std::set<std::string> files;
    for (const auto& match : matches(text, std::regex(R"re(\n```\w+ (\S+)\n)re"))) files.insert(match[1]);
    return files;
}

const std::regex path_in_code(R"re(`((?:runtime|bindings|lua|graphs|tests|cmake|setup|docs)/[\w./-]*)`)re");

std::vector<fs::path> sources()
{
    std::vector<fs::path> files;
    for (const char* folder : {"runtime", "bindings", "lua", "graphs", "tests"})
        for (const auto& entry : fs::recursive_directory_iterator(project / folder)) {
            const fs::path extension = entry.path().extension();
            if (extension == ".h" || extension == ".cpp" || extension == ".lua") files.push_back(entry.path());
        }
    return files;
}

// Returns the rows of tables whose last column is "its test".
std::vector<std::string> promises_of(const std::string& text)
{
    std::vector<std::string> rows;
    std::istringstream lines(text);
    bool is_of_promises = false;
    for (std::string line; std::getline(lines, line);) {
        if (line.ends_with("| its test |"))
            is_of_promises = true;
        else if (!line.starts_with("|"))
            is_of_promises = false;
        else if (is_of_promises && !line.starts_with("|--"))
            rows.push_back(line);
    }
    return rows;
}

}  // namespace

TEST_CASE("each file and folder that a document names exists", "[docs]")
{
    for (const std::string& document : documents) {
        const std::string text = read_text(project / document);
        const std::set<std::string> examples = example_files(text);
        for (const auto& match : matches(without_fenced_code(text), path_in_code)) {
            const std::string& path = match[1];
            CAPTURE(document, path);
            CHECK((examples.count(path) > 0 || fs::exists(project / path)));
        }
    }
}

TEST_CASE("each promise names its test", "[docs]")
{
    for (const char* document : {"SECURITY.md", "docs/cli.md", "docs/host.md"}) {
        const std::vector<std::string> promises = promises_of(read_text(project / document));
        CAPTURE(document);
        CHECK(promises.size() > 5);
        for (const std::string& row : promises) {
            CAPTURE(row);
            const std::string cell = row.substr(row.rfind('|', row.size() - 2));
            const auto tests = matches(cell, std::regex(R"re(`tests/[\w./-]+`)re"));
            CHECK_FALSE(tests.empty());
        }
    }
}

// Matches commands such as RAPID_MUTANTS=20000 build/test/bin/test_mutants "[mutants]".
TEST_CASE("variables, test programs and tags in the commands of a document are those of tests", "[docs]")
{
    std::string code;
    for (const auto& entry : fs::recursive_directory_iterator(project / "tests"))
        if (const fs::path name = entry.path().extension(); entry.is_regular_file() && name != ".png")
            code += read_text(entry.path());
    std::size_t commands = 0;
    for (const char* document : {"docs/reliability.md", "docs/numerics.md", "CONTRIBUTING.md", "SECURITY.md"})
        for (const auto& command :
             matches(read_text(project / document),
                     std::regex(R"re((?:^|\n|`) *((?:[A-Z_]+=\S+ )*)build/\w+/bin/(\S+)([^\n`]*))re"))) {
            CAPTURE(document, command[0]);
            ++commands;
            for (const auto& variable : matches(command[1], std::regex("([A-Z_]+)=")))
                CHECK((variable[1] == "LD_PRELOAD" || code.find('"' + variable[1] + '"') != std::string::npos));
            if (command[2].rfind("test_", 0) == 0) CHECK(fs::is_directory(project / "tests" / command[2].substr(5)));
            for (const auto& tag : matches(command[3], std::regex(R"re((\[\w+\]))re")))
                CHECK(code.find(tag[1]) != std::string::npos);
        }
    CHECK(commands > 20);
}

TEST_CASE("a name that a document gives with its file is in that file", "[docs]")
{
    const std::regex named(R"re(`([\w/]+\.\w+)` \((`[^)]*`)\))re"), name(R"re(`(\w+)`)re");
    for (const std::string& document : documents) {
        const std::string text = without_fenced_code(read_text(project / document));
        for (const auto& match : matches(text, named)) {
            const std::string &file = match[1], &names = match[2];
            const std::string source = read_text(project / file);
            for (const auto& each : matches(names, name)) {
                CAPTURE(document, file, each[1]);
                CHECK(std::regex_search(source, std::regex("\\b" + each[1] + "\\b")));
            }
        }
    }
}

TEST_CASE("each link of a document has a target", "[docs]")
{
    const std::regex link(R"re(\]\(([^)#:]*)(?:#([^)]*))?\))re");
    for (const std::string& document : documents) {
        const fs::path here = project / document;
        for (const auto& match : matches(without_fenced_code(read_text(here)), link)) {
            const std::string &file = match[1], &anchor = match[2];
            CAPTURE(document, file, anchor);
            const fs::path there = file.empty() ? here : here.parent_path() / file;
            REQUIRE(fs::exists(there));
            if (anchor.empty()) continue;
            std::set<std::string> anchors;
            for (const Section& each : sections(read_text(there))) anchors.insert(anchor_of(each.title));
            CHECK(anchors.count(anchor) == 1);
        }
    }
}

TEST_CASE("architecture.md lists exactly the existing folders", "[docs]")
{
    std::set<std::string> described, found;
    const std::string layers = section(read_text(project / "docs/architecture.md"), "Layers");
    for (const auto& match : matches(layers, std::regex(R"re(\n\| `((?:runtime|bindings)/[\w/]*)`)re")))
        described.insert(match[1]);
    for (const char* top : {"runtime", "bindings"}) {
        for (const auto& entry : fs::recursive_directory_iterator(project / top))
            if (entry.is_directory() && entry.path().filename() != "__pycache__")
                found.insert(fs::relative(entry.path(), project).string() + '/');
    }
    CHECK(described == found);
}

TEST_CASE("the figures of a frame are documented as they are declared", "[docs]")
{
    const std::string rows = section(read_text(project / "docs/cli.md"), "Statistics");
    const auto check = [&](const std::string& name, const std::string& unit, const std::string& meaning) {
        CAPTURE(name);
        CHECK_THAT(rows,
                   Catch::Contains("\n| `" + name + "` | " + (unit.empty() ? "" : unit + ", ") + meaning + " |\n"));
    };
#define RAPID_FIGURE(type, name, together, later, reported, unit, meaning, ...) check(#name, unit, meaning);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
}

TEST_CASE("CONTRIBUTING.md lists exactly the existing presets", "[docs]")
{
    std::set<std::string> described, found;
    const std::string building = section(read_text(project / "CONTRIBUTING.md"), "Building");
    for (const auto& match : matches(building, std::regex(R"re(\n\| `(\w+)` \|)re"))) described.insert(match[1]);
    const std::regex shown(R"re("name": "(\w+)",\s*"displayName")re");
    for (const auto& match : matches(read_text(project / "CMakePresets.json"), shown)) found.insert(match[1]);
    CHECK(described == found);
}

TEST_CASE("each name of the glossary is in the file that the glossary gives", "[docs]")
{
    const std::string glossary = section(read_text(project / "docs/architecture.md"), "Glossary");
    const auto entries = matches(glossary, std::regex(R"re(\n\| `(\w+)` \|[^\n]*\| `([\w/.]+)` \|)re"));
    REQUIRE(entries.size() > 40);
    for (const auto& entry : entries) {
        const std::string &name = entry[1], &file = entry[2];
        CAPTURE(name, file);
        CHECK(std::regex_search(read_text(project / file),
                                std::regex("(class|struct|using|enum)( alignas\\(\\d+\\))? " + name + "\\b")));
    }
}

TEST_CASE("each section of numerics that a comment cites exists", "[docs]")
{
    std::set<std::string> titles;
    for (const Section& each : sections(read_text(project / "docs/numerics.md"))) titles.insert(each.title);
    const std::regex across_lines(R"re(\n\s*(//|--)\s*)re"), cited(R"re(numerics(?:\.md)?, ([A-Z][\w' -]*\w)[).;:])re");
    std::size_t citations = 0;
    for (const fs::path& file : sources()) {
        const std::string text = std::regex_replace(read_text(file), across_lines, " ");
        for (const auto& match : matches(text, cited)) {
            ++citations;
            CAPTURE(file, match[1]);
            CHECK(titles.count(match[1]) == 1);
        }
    }
    CHECK(citations >= 7);
}

TEST_CASE("each formula of numerics names the file that computes it", "[docs]")
{
    for (const Section& each : sections(read_text(project / "docs/numerics.md"))) {
        if (each.level < 3) continue;
        CAPTURE(each.title);
        CHECK(std::regex_search(each.text, std::regex(R"re(`(runtime|tests)/[\w/]+\.\w+`)re")));
    }
}

}  // namespace rapid
