// Malicious caches: those of `--cache` with values that no run would store, and valid checksums. A run that resumes
// from one succeeds or ends with an error. It does not crash, or take more than ten seconds of processor time.
//
//   RAPID_CRAFTED=10000 build/test/bin/test_command "[crafted]"        the total number of caches (40)
//   RAPID_CRAFTED_FIRST=2000 build/test/bin/test_command "[crafted]"   the first of them (0); RAPID_CRAFTED is the end
#include <sys/wait.h>

#include <cstdlib>
#include <cstring>
#include <regex>

#include "runtime/files/content_hash.h"
#include "runtime/io/state_file.h"
#include "tests/amount.h"
#include "tests/files/temporary_folder.h"
#include "tests/host/forger.h"
#include "tests/test.h"

using namespace rapid;

namespace {

namespace fs = std::filesystem;

constexpr const char* scene = R"(local rapid = require "rapid"
    return rapid.create { seed = 3 }
      :emit { source = rapid.mesh.sphere { radius = 0.3 }, rate = 200, life = 0.3 }
      :attribute { pscale = 0.05 } :gravity {} :contact { friction = 0.3 }
      :collide { shape = rapid.shape.plane {} } :solve {})";

// Returns a shell's status: above 128 if a signal ended the command.
int run(const fs::path& folder)
{
    const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "rapid";
#ifdef RAPID_ADDRESS_SANITIZER  // it maps terabytes
    const std::string max_memory = "unlimited";
#else
    const std::string max_memory = "4194304";
#endif
    const std::string line = "cd '" + folder.string() + "' && ulimit -t 10 && ulimit -v " + max_memory + " && '" +
                             program.string() +
                             "' run scene.lua -f 1-6 --cache cache --cache-every 2 --stats stats.json --events e.csv "
                             "-o a.####.png --size 32x32 --threads 1 >said 2>&1";
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Changes one entry of the journal after the first, which identifies the run.
std::string forged_journal(const std::string& whole, std::uint64_t seed)
{
    std::string text = whole.substr(0, 8);
    std::vector<std::string> entries;
    for (std::size_t at = 8; at + 16 <= whole.size();) {
        std::uint64_t size = 0;
        std::memcpy(&size, whole.data() + at, sizeof size);
        entries.push_back(whole.substr(at + 16, size));
        at += 16 + size;
    }
    std::string& entry = entries.at(1 + seed % (entries.size() - 1));
    SavedState state;
    state.bytes.assign(entry.begin(), entry.end());
    state = test::Forger(seed)(std::move(state));
    entry.assign(state.bytes.begin(), state.bytes.end());
    for (const std::string& each : entries) {
        const std::uint64_t ends[] = {each.size(), content_hash(each)};
        text.append(reinterpret_cast<const char*>(ends), sizeof ends).append(each);
    }
    return text;
}

// Returns an empty snapshot with this header.
std::string snapshot_with(const std::string& header)
{
    const std::uint64_t length = header.size();
    std::string text = "\x89RAPID\r\n";
    text.append(reinterpret_cast<const char*>(&length), sizeof length).append(header);
    const std::uint64_t digest = content_hash(text);
    return text.append(reinterpret_cast<const char*>(&digest), sizeof digest);
}

}  // namespace

TEST_CASE("a snapshot with any header is described, or is an error that names it", "[crafted]")
{
    const test::TemporaryFolder folder;
    const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "rapid";
    const std::string nested = std::string(200000, '[') + std::string(200000, ']');
    int reported = 0;
    for (const std::string body :
         {R"({"format": FORMAT})", R"({"format": FORMAT, "graph": "a", "frame": 1})", "{}", "[]", "1", "null", "", "{",
          R"({"format": "FORMAT"})", R"({"format": FORMAT, "graph": "a"})",
          R"({"format": FORMAT, "nodes": 1, "fingerprint": [1]})",
          R"({"format": FORMAT, "graph": "\u001b[2J", "frame": {"a": 1}})",
          R"({"format": FORMAT, "file": 1, "bytes": "x"})"})
        for (const std::string& header : {body, R"({"format": FORMAT, "x": )" + nested + "}"}) {
            const std::string text = std::regex_replace(header, std::regex("FORMAT"), std::to_string(state_format));
            folder.write("a.csv", snapshot_with(text));
            for (const char* json : {"", " --json"}) {
                const std::string line = "cd '" + folder.path().string() + "' && '" + program.string() +
                                         "' info a.csv" + json + " >out 2>&1";
                const int status = std::system(line.c_str());
                const std::string said = test::file_text(folder / "out");
                CAPTURE(text.substr(0, 80), said);
                REQUIRE(WIFEXITED(status));
                CHECK(WEXITSTATUS(status) <= 2);
                CHECK((WEXITSTATUS(status) == 0 || said.find("a.csv") == 0));
                CHECK(said.find('\x1b') == std::string::npos);
                reported += status == 0;
            }
        }
    CHECK(reported > 0);
}

TEST_CASE("a cache that is made to do harm is refused, or the run goes on", "[crafted][random]")
{
    const test::TemporaryFolder folder;
    folder.write("scene.lua", scene);
    REQUIRE(run(folder.path()) == 0);
    const fs::path cache = folder / "cache", journal = cache / "journal", snapshot = cache / "snapshot.0004.rapid";
    fs::copy(cache, folder / "kept", fs::copy_options::recursive);
    const std::string whole_journal = test::file_text(journal);
    const StateFile whole((folder / "kept") / "snapshot.0004.rapid");
    int refused = 0;
    const int end = amount("RAPID_CRAFTED", 10);
    for (int k = amount("RAPID_CRAFTED_FIRST", 0); k < end; ++k) {
        fs::remove_all(cache);
        fs::copy(folder / "kept", cache, fs::copy_options::recursive);
        fs::remove(cache / "snapshot.0006.rapid");
        fs::remove(folder / "a.0006.png");
        const auto seed = static_cast<std::uint64_t>(k);
        if (k % 2 == 0) {
            std::ofstream(journal, std::ios::binary) << forged_journal(whole_journal, seed);
        } else {
            write_state(snapshot, whole.header(), test::Forger(seed)(whole.state()));
        }
        const int status = run(folder.path());
        CAPTURE(k, test::file_text(folder / "said"));
        CHECK(status <= 2);
        refused += status != 0;
    }
    if (std::getenv("RAPID_CRAFTED")) std::printf("%d refused\n", refused);
}
