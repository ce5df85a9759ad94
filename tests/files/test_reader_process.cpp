#include "runtime/files/read_sandboxed.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <vector>

#include "runtime/base/memory_budget.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

using Number = std::int64_t;

void send(const Number& number, MessageWriter& message) { message.put(number); }
Number receive(MessageReader& message) { return message.take<Number>(); }

Number read(const std::filesystem::path&, const std::string& what)
{
    if (what == "parent") return ::getppid();
    if (what == "crash") ::raise(SIGSEGV);
    if (what == "much") return std::vector<Number>((96 << 20) / sizeof(Number)).back();
    throw Error("there is no " + what);
}

const SandboxedReader<Number> reader("test: a number", read, send, receive);

// Runs a test in a separate process, because a reader process can't be stopped again.
void in_process(const std::function<void(const std::filesystem::path& file)>& test)
{
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "bytes";
    const pid_t child = ::fork();
    if (child == 0) {
        test(folder / "file");
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    CHECK(status == 0);
}

void expect(bool holds, int number)
{
    if (!holds) ::_exit(number);
}

}  // namespace

TEST_CASE("a reader process forks the copies that read, and outlives them", "[files]")
{
    in_process([](const std::filesystem::path& file) {
        const pid_t here = ::getpid();
        expect(reader(file, "parent") == here, 1);
        start_reader_process([] {});
        const Number process = reader(file, "parent");
        expect(process != here && process > 0, 2);
        expect(error_of([&] { reader(file, "crash"); }) ==
                   "can't be read: it crashed the reader with signal 11 (Segmentation fault), so it must be damaged",
               3);
        expect(error_of([&] { reader(file, "name"); }) == "there is no name", 4);
        expect(error_of([&] { reader(file / "none", "parent"); }).starts_with("can't be read: "), 5);
        expect(reader(file, "parent") == process, 6);
    });
}

TEST_CASE("a reader process obeys the memory budget of its parent process", "[files]")
{
    in_process([](const std::filesystem::path& file) {
        start_reader_process([] {});
        expect(reader(file, "much") == 0, 1);
        set_memory_budget(1);
        expect(error_of([&] { reader(file, "much"); }) ==
                   "can't be read: the reader needs more than the available 64 MiB; read a smaller file, or set memory",
               2);
        expect(reader(file, "parent") > 0, 3);
    });
}

TEST_CASE("the end of a reader process is an error of the next read", "[files]")
{
    in_process([](const std::filesystem::path& file) {
        std::signal(SIGPIPE, SIG_IGN);
        start_reader_process([] {});
        ::kill(static_cast<pid_t>(reader(file, "parent")), SIGKILL);
        const std::string ended = "can't be read: the reader process has ended";
        expect(error_of([&] { reader(file, "parent"); }) == ended, 1);
        expect(error_of([&] { reader(file, "parent"); }) == ended, 2);
    });
}

TEST_CASE("a reader process that can't be confined does not serve", "[files]")
{
    in_process([](const std::filesystem::path&) {
        expect(error_of([] { start_reader_process([] { throw Error("no sandbox"); }); }) == "no sandbox", 1);
        expect(error_of([] { start_reader_process([] { ::_exit(3); }); }) == "the reader process ended", 2);
    });
}
