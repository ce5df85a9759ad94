// Malicious snapshots: real ones with values that no run would store, and a valid checksum. A run resumed from one
// continues or ends with an error. None crashes the process, or takes more than ten seconds of processor time.
//
//   RAPID_CRAFTED=10000 build/test/bin/test_host "[crafted]"        the total number of snapshots (300)
//   RAPID_CRAFTED_FIRST=2000 build/test/bin/test_host "[crafted]"   the first of them (0); RAPID_CRAFTED is the end
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"
#include "tests/amount.h"
#include "tests/files/temporary_folder.h"
#include "tests/host/forger.h"
#include "tests/host/run.h"
#include "tests/host/scenes_with_state.h"
#include "tests/test.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

std::vector<std::pair<std::string, fs::path>> scenes(const fs::path& folder)
{
    std::vector<std::pair<std::string, fs::path>> files;
    for (const auto& [name, text] : test::scenes_with_state) {
        const fs::path file = folder / ("scene" + std::to_string(files.size()) + ".lua");
        std::ofstream(file) << "local rapid = require \"rapid\"\n" << text;
        files.emplace_back(name, file);
    }
    return files;
}

// The report of the process that resumes from the snapshots.
struct Report {
    int next, gone_on, refused;
};

void limit()
{
    constexpr std::size_t most = std::size_t{2} << 30;
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t bytes = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + most;
    const rlimit value{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &value);
}

void limit_time()
{
    const itimerval processor{{0, 0}, {10, 0}};
    ::setitimer(ITIMER_PROF, &processor, nullptr);
    ::alarm(120);
}

void continue_after(const SavedState& state, const fs::path& scene)
{
    Snapshot snapshot;
    restore(snapshot, state);
    test::Run run(scene);
    run.evaluator().load(snapshot);
    for (int k = 0; k < 2; ++k) run.evaluator().advance();
}

}  // namespace

// Runs in a separate process: see below. RAPID_TEST_SNAPSHOT: the folder.
TEST_CASE("continues after crafted snapshots", "[.]")
{
    const fs::path folder = std::getenv("RAPID_TEST_SNAPSHOT");
    const int file = ::open((folder / "report").c_str(), O_RDWR);
    auto* const report =
        static_cast<Report*>(::mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
    const SavedState whole = StateFile(folder / "whole").state();
    const int end = amount("RAPID_TEST_END", 0), step = amount("RAPID_TEST_STEP", 1);
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS, SIGALRM, SIGPROF}) ::signal(signal, SIG_DFL);
    limit();
    for (; report->next < end; report->next += step) {
        limit_time();
        try {
            continue_after(test::Forger(static_cast<std::uint64_t>(report->next))(whole),
                           std::getenv("RAPID_TEST_SCENE"));
            ++report->gone_on;
        } catch (const std::exception&) {
            ++report->refused;
        }
    }
    ::_exit(0);
}

TEST_CASE("a snapshot that is made to do harm is refused, or the run goes on", "[crafted][random]")
{
    const test::TemporaryFolder folder;
    const auto all = scenes(folder.path());
    const int step = static_cast<int>(all.size());
    int gone_on = 0, refused = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
        const auto& [name, scene] = all[k];
        {
            test::Run run(scene);
            for (int frame = 0; frame < 6; ++frame) run.evaluator().advance();
            write_state(folder / "whole", {{"frame", 6}}, state_of(run.evaluator().save()));
        }
        continue_after(StateFile(folder / "whole").state(), scene);

        Report report{amount("RAPID_CRAFTED_FIRST", 0) / step * step + static_cast<int>(k), 0, 0};
        std::ofstream(folder / "report", std::ios::binary).write(reinterpret_cast<char*>(&report), sizeof report);
        ::setenv("RAPID_TEST_SNAPSHOT", folder.path().c_str(), 1);
        ::setenv("RAPID_TEST_SCENE", scene.c_str(), 1);
        ::setenv("RAPID_TEST_END", std::to_string(amount("RAPID_CRAFTED", 100)).c_str(), 1);
        ::setenv("RAPID_TEST_STEP", std::to_string(step).c_str(), 1);
        const std::string program = fs::read_symlink("/proc/self/exe").string();
        const int status = std::system(("'" + program + "' 'continues after crafted snapshots' >/dev/null").c_str());
        std::ifstream(folder / "report", std::ios::binary).read(reinterpret_cast<char*>(&report), sizeof report);
        CAPTURE(name, report.next, report.gone_on, report.refused);
        CHECK(status == 0);
        gone_on += report.gone_on;
        refused += report.refused;
    }
    if (std::getenv("RAPID_CRAFTED")) std::printf("%d gone on, %d refused\n", gone_on, refused);
    CHECK(gone_on > 0);
    CHECK(refused > 0);
}

}  // namespace rapid
