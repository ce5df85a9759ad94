// A program that embeds Rapid survives exhausted memory, while a Lua state is created or anywhere else. An error
// reports it, and the next scene opens.
#include <cstdlib>
#include <fstream>

#include "include/rapid/rapid.h"
#include "tests/amount.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr char tried_again[] = "opens a scene where memory runs out and another";

// Runs that test in a separate process, in which the nth allocation for a state fails. Returns true if it passed.
// counted: receives the number of these allocations.
bool passes(int n, const fs::path& counted)
{
    const fs::path program = fs::read_symlink("/proc/self/exe");
    const fs::path library = program.parent_path().parent_path() / "lib/librapid_fault.so";
    REQUIRE(fs::exists(library));
    const std::string command = "RAPID_FAULT=state:" + std::to_string(n) + ":12 RAPID_FAULT_COUNT='" +
                                counted.string() + "' LD_PRELOAD='" + library.string() + "' '" + program.string() +
                                "' '" + tried_again + "' > /dev/null";
    return std::system(command.c_str()) == 0;
}

// Runs the program that uses the whole interface (tests/faults/embedding.cpp) this many times, with these variables, in
// this folder. Its output goes to the file `said`.
bool runs(const fs::path& folder, const std::string& variables, int times)
{
    const fs::path build = fs::read_symlink("/proc/self/exe").parent_path().parent_path();
    const std::string command = "cd '" + folder.string() + "' && " + variables + " LD_PRELOAD='" +
                                (build / "lib/librapid_fault.so").string() + "' '" +
                                (build / "bin/rapid_embedding").string() + "' " + std::to_string(times) + " > said";
    return std::system(command.c_str()) == 0;
}

int open_scene(std::string& message)
{
    rapid_scene* scene = nullptr;
    rapid_error* error = nullptr;
    const int status = rapid_scene_open_text("scene.lua", "return require(\"rapid\").create {}:gravity {}:solve {}",
                                             nullptr, &scene, &error);
    if (error) message = rapid_error_message(error);
    rapid_error_release(error);
    if (scene) rapid_scene_release(scene, nullptr);
    return status;
}

}  // namespace

TEST_CASE(tried_again, "[.]")
{
    std::string message;
    CHECK(open_scene(message) == RAPID_OUT_OF_MEMORY);
    CHECK(message == "out of memory");
    CHECK(open_scene(message) == RAPID_OK);
}

TEST_CASE("memory that runs out while a state of Lua is made is an error of the scene, whichever request it is", "[c]")
{
    const test::TemporaryFolder folder;
    REQUIRE(passes(1, folder / "count"));
    int requests = 0;  // of the first, and all of the second
    std::ifstream(folder / "count") >> requests;
    REQUIRE(requests > 5);
    for (int n = 2; n < requests; ++n) {
        CAPTURE(n);
        CHECK(passes(n, folder / "count"));
    }
    CHECK_FALSE(passes(requests, folder / "count"));  // of no first state
}

TEST_CASE("memory that is refused in any call is an error of that call, and the next scene runs", "[c][random]")
{
    const test::TemporaryFolder folder;
    REQUIRE(runs(folder.path(), "RAPID_FAULT=alloc:0:12 RAPID_FAULT_COUNT=count", 1));
    long requests = 0;
    std::ifstream(folder / "count") >> requests;
    REQUIRE(requests > 10000);
    const long faults = amount("EMBEDDING_FAULTS", 100);
    std::string list;
    for (long k = 0; k < faults; ++k) list += "alloc:" + std::to_string(1 + k * requests / faults) + ":12\n";
    folder.write("list", list);
    REQUIRE(runs(folder.path(), "RAPID_FAULT_LIST=list", 3));
    std::ifstream statuses(folder / "said");
    long count = 0;
    for (int k = 0, status = 0; statuses >> k >> status; ++count) {
        CAPTURE(k, requests, test::file_text(folder / std::to_string(k) / "said"));
        CHECK(status == 0);
    }
    CHECK(count == faults);
}

}  // namespace rapid
