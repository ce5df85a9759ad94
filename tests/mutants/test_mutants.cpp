// Damaged and truncated files for every reader. Each file is read twice, with different bytes in uninitialised memory,
// and both readings must agree: in everything read, or in an error that names the file. No file crashes the process,
// takes more than ten seconds of processor time, or exceeds the memory limit. Files with large numbers stay within a
// budget (--memory).
//
//   RAPID_MUTANTS=20000 build/test/bin/test_mutants       the number for all readers together (200)
//   RAPID_MUTANT_READER=.vdb build/test/bin/test_mutants  only readers with this in their names
//   RAPID_MUTANT_FIRST=500 build/test/bin/test_mutants    the first mutant of each reader
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <functional>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/skipped_contents.h"
#include "tests/amount.h"
#include "tests/files/temporary_folder.h"
#include "tests/mutants/filled_memory.h"
#include "tests/mutants/mutate.h"
#include "tests/mutants/whole_files.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

using Path = std::filesystem::path;

std::size_t mutants_of_each_reader(std::size_t readers)
{
    return (static_cast<std::size_t>(amount("RAPID_MUTANTS", 200)) + readers - 1) / readers;
}

// The reading process reports its progress and the fault here.
struct Report {
    std::size_t mutant, read, refused;
    char wrong[1000];
};

// Grants ten seconds of processor time for the next file, and more wall time for a busy machine. The processes in which
// libraries read have their own, lower limit.
void limit_time()
{
    const itimerval processor{{0, 0}, {10, 0}};
    ::setitimer(ITIMER_PROF, &processor, nullptr);
    ::alarm(120);
}

void limit_memory()
{
    constexpr std::size_t most = std::size_t{2} << 30;
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t bytes = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + most;
    const rlimit value{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &value);
}

// The result of one reading.
struct Outcome {
    bool is_read = false;
    std::string content;  // or the error
    bool operator==(const Outcome&) const = default;
};

Outcome outcome_of(ContentOf content, const Path& path)
{
    try {
        return {true, content(path)};
    } catch (const Error& error) {
        return {false, error.what()};
    } catch (const std::exception& error) {
        return {false, std::string("no error of Rapid's: ") + error.what()};
    }
}

Outcome outcome_with_memory_of(unsigned char byte, ContentOf content, const Path& path)
{
    limit_time();
    fill_new_memory(byte);
    fill_stack(byte);
    return outcome_of(content, path);
}

// Describes a fault in how a file is read, or returns an empty string.
std::string fault_of(const Outcome& first, const Outcome& second, const Path& path)
{
    const auto shown = [](const Outcome& outcome) {
        return outcome.is_read ? std::to_string(outcome.content.size()) + " bytes" : outcome.content;
    };
    if (first != second) return "memory that nobody wrote decides: " + shown(first) + "; " + shown(second);
    if (!first.is_read && first.content.find(path.string()) == std::string::npos)
        return "the error names no file: " + first.content;
    return "";
}

using MutantOf = std::function<std::string(std::size_t k)>;
// Reads a mutant and describes the fault, or returns an empty string.
using FaultOfReading = std::function<std::string(const std::string& mutant, const Path& path, Report& report)>;

// Makes mutants and reads them in a copy of this process, up to the first fault. Returns the number of refused ones.
std::size_t check_in_copy(const WholeFile& whole, std::size_t count, const std::function<void()>& confine,
                          const MutantOf& mutant_of, const FaultOfReading& fault_of_reading)
{
    const TemporaryFolder folder;
    const Path path = folder / whole.name;
    auto* const report = static_cast<Report*>(
        ::mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    report->mutant = static_cast<std::size_t>(amount("RAPID_MUTANT_FIRST", 0));
    const pid_t child = ::fork();
    if (child == 0) {
        for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS, SIGALRM, SIGPROF}) ::signal(signal, SIG_DFL);
        confine();
        for (; report->mutant < count; ++report->mutant) {
            const std::string mutant = mutant_of(report->mutant);
            std::ofstream(path, std::ios::binary) << mutant;
            const std::string wrong = fault_of_reading(mutant, path, *report);
            if (wrong.empty()) continue;
            wrong.copy(report->wrong, sizeof report->wrong - 1);
            break;
        }
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    CAPTURE(report->mutant, report->read, report->refused, std::string(report->wrong));
    CHECK(status == 0);
    CHECK(report->wrong[0] == '\0');
    const std::size_t refused = report->refused;
    ::munmap(report, sizeof(Report));
    return refused;
}

// Reads each mutant twice. `further` looks for other faults than fault_of().
void check_mutants(const WholeFile& whole, std::size_t count, const MutantOf& mutant_of,
                   const std::function<std::string(const std::string& mutant, const Outcome& outcome)>& further)
{
    const std::size_t refused = check_in_copy(
        whole, count, limit_memory, mutant_of, [&](const std::string& mutant, const Path& path, Report& report) {
            const Outcome first = outcome_with_memory_of(0x5a, whole.content, path);
            const Outcome second = outcome_with_memory_of(0xa5, whole.content, path);
            ++(first.is_read ? report.read : report.refused);
            const std::string wrong = fault_of(first, second, path);
            return wrong.empty() ? further(mutant, first) : wrong;
        });
    CHECK(refused > 0);
}

// Returns the peak memory, in bytes, of this process and of those that it has waited for.
std::size_t peak_memory()
{
    std::size_t peak = 0;
    for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage usage{};
        ::getrusage(who, &usage);
        peak = std::max(peak, static_cast<std::size_t>(usage.ru_maxrss) << 10);
    }
    return peak;
}

std::vector<WholeFile> chosen_files()
{
    std::vector<WholeFile> files = whole_files();
    if (const char* const which = std::getenv("RAPID_MUTANT_READER"))
        std::erase_if(files, [&](const WholeFile& file) { return file.reader.find(which) == std::string::npos; });
    return files;
}

}  // namespace

TEST_CASE("a damaged file is read, or is an error that names it: no signal, no hang, no flood of memory",
          "[mutants][random]")
{
    const std::vector<WholeFile> files = chosen_files();
    for (const WholeFile& whole : files) {
        CAPTURE(whole.reader);
        check_mutants(
            whole, mutants_of_each_reader(files.size()),
            [&](std::size_t k) {
                std::string mutant = Mutator(k)(whole.bytes);
                if (whole.seal) whole.seal(mutant);
                return mutant;
            },
            [](const std::string&, const Outcome&) { return ""; });
    }
}

TEST_CASE("a file that is cut anywhere is an error, unless it only lacks white space", "[mutants][random]")
{
    const std::vector<WholeFile> files = chosen_files();
    // Truncates short files at each byte, and all files at more of the last ones.
    constexpr std::size_t near_end = 40;
    const std::size_t expected = near_end + 5 * mutants_of_each_reader(files.size());
    for (const WholeFile& whole : files) {
        CAPTURE(whole.reader);
        const std::size_t size = whole.bytes.size(), cuts = std::min(size, expected);
        const auto cut = [&](std::size_t k) {
            if (cuts == size || k < near_end) return size - 1 - k;
            return (size - near_end) * (k - near_end) / (cuts - near_end);
        };
        const TemporaryFolder folder;
        const Outcome of_whole = outcome_of(whole.content, folder.write(whole.name, whole.bytes));
        REQUIRE(of_whole.is_read);
        check_mutants(
            whole, cuts, [&](std::size_t k) { return whole.bytes.substr(0, cut(k)); },
            [&](const std::string& mutant, const Outcome& outcome) -> std::string {
                // A warning says that the last number may be cut.
                if (!outcome.is_read || outcome.content.find(no_last_newline) != std::string::npos) return "";
                const bool ends_at_line =
                    whole.may_end_anywhere || (whole.may_end_at_any_line && mutant.ends_with('\n'));
                const bool lacks_space = whole.bytes.find_first_not_of(" \t\r\n", mutant.size()) == std::string::npos;
                if (ends_at_line || ((lacks_space || !whole.has_points) && outcome == of_whole)) return "";
                return "cut at byte " + std::to_string(mutant.size()) + " of " + std::to_string(size) +
                       " it is read as if it were whole";
            });
    }
}

TEST_CASE("a file takes no more memory than the budget and 128 MiB, whatever its numbers ask for", "[mutants][random]")
{
    constexpr std::size_t budget = std::size_t{256} << 20, let_pass = std::size_t{128} << 20;
    const auto limit = [] { set_memory_budget(budget); };
    const auto refused = [&](const WholeFile& whole, std::size_t count, const MutantOf& mutant_of) {
        CAPTURE(whole.reader);
        return check_in_copy(
            whole, count, limit, mutant_of, [&](const std::string&, const Path& path, Report& report) -> std::string {
                const Outcome outcome = outcome_with_memory_of(0x5a, whole.content, path);
                ++(outcome.is_read ? report.read : report.refused);
                const std::size_t peak = peak_memory();
                if (peak <= budget + let_pass) return "";
                return "takes " + std::to_string(peak >> 20) + " MiB; " + outcome.content.substr(0, 500);
            });
    };
    const std::vector<WholeFile> files = chosen_files();
    std::size_t all = 0;
    for (const WholeFile& whole : files)
        all += refused(whole, 2 * mutants_of_each_reader(files.size()), [&](std::size_t k) {
            std::string mutant = Mutator(k).with_large_numbers(whole.bytes);
            if (whole.seal) whole.seal(mutant);
            return mutant;
        });
    CHECK(all > 0);
    const WholeFile sparse = sparse_fog(1500);  // 0.5 GiB
    CHECK(refused(sparse, 1, [&](std::size_t) { return sparse.bytes; }) == 1);
}
