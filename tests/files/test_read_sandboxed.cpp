#include "runtime/files/read_sandboxed.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <ctime>

#include "runtime/base/memory_budget.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

using Numbers = std::vector<std::int32_t>;

void send(const Numbers& numbers, MessageWriter& message)
{
    message.put(numbers.size());
    message.put_array(std::span<const std::int32_t>(numbers));
}

Numbers receive(MessageReader& message) { return message.take_vector<std::int32_t>(message.take<std::size_t>()); }

Numbers read(const std::filesystem::path& path, const std::function<Numbers()>& reader)
{
    Numbers numbers;
    read_in_copy(
        path, [&](MessageWriter& message) { send(reader(), message); },
        [&](MessageReader& message) { numbers = receive(message); });
    return numbers;
}

const SandboxedReader<Numbers> process_number(
    "test: number of the process", [](const std::filesystem::path&, const std::string&) { return Numbers{::getpid()}; },
    send, receive);

std::string error_in(const std::function<Numbers()>& reader)
{
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "bytes";
    return error_of([&] { read(folder / "file", reader); });
}

}  // namespace

TEST_CASE("only the contents that another process has read are returned", "[files]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "bytes";
    const Numbers many(1000000, 7);
    bool touched = false;
    const Numbers back = read(folder / "file", [&] {
        touched = true;
        return many;
    });
    CHECK((back == many));
    CHECK_FALSE(touched);
}

TEST_CASE("a file that this process wrote is read in it, until another changes it", "[files]")
{
    const TemporaryFolder folder;
    OutputFile file(folder / "file");
    file.append("bytes", 5);
    file.finish();
    const pid_t here = ::getpid();
    const auto reads_here = [&] { return process_number(folder / "file")[0] == here; };
    CHECK(reads_here());
    std::ofstream(folder / "file") << "other bytes";
    CHECK_FALSE(reads_here());
}

TEST_CASE("the end of a reader is an error of its file", "[files]")
{
    CHECK(error_in([]() -> Numbers { throw Error("it is no file of mine"); }) == "it is no file of mine");
    CHECK(error_in([]() -> Numbers {
              ::raise(SIGSEGV);
              return {};
          }) == "can't be read: it crashed the reader with signal 11 (Segmentation fault), so it must be damaged");
    CHECK_THAT(error_in([]() -> Numbers { std::abort(); }), Catch::Contains("signal 6 (Aborted)"));
    CHECK(error_in([]() -> Numbers { ::_exit(0); }) == "can't be read: it crashed the reader, so it must be damaged");
    CHECK(error_in([]() -> Numbers { return Numbers(std::size_t{1} << 30); }) ==
          "can't be read: it needs more than 1024 MB of memory, so it must be damaged");
}

TEST_CASE("a reader takes at most half of the remaining budget, but may always take 64 MiB", "[files]")
{
    constexpr std::size_t mebibyte = std::size_t{1} << 20;
    const auto refusal_of = [](std::size_t bytes) {
        return error_in([=]() -> Numbers { return Numbers{Numbers(bytes / sizeof(Numbers::value_type)).front()}; });
    };
    {
        const MemoryBudget used_up(1);
        CHECK(refusal_of(32 * mebibyte).empty());
        CHECK(refusal_of(96 * mebibyte) ==
              "can't be read: the reader needs more than the available 64 MiB; read a smaller file, or set "
              "memory");
    }
    const std::uint64_t used = memory_budget() - free_memory();
    const MemoryBudget budget(used + 512 * mebibyte);
    CHECK(refusal_of(128 * mebibyte).empty());
    CHECK_THAT(refusal_of(384 * mebibyte),
               Catch::StartsWith("can't be read: the reader needs more than the available 2"));
}

TEST_CASE("a reader that takes too long is distinguished from others that end by a signal", "[files]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "bytes";
    const Numbers seconds = read(folder / "file", [] {
        rlimit limit{};
        ::getrlimit(RLIMIT_CPU, &limit);
        return Numbers{static_cast<std::int32_t>(limit.rlim_cur), static_cast<std::int32_t>(limit.rlim_max)};
    });
    // The hard limit would send SIGKILL, which might also come from elsewhere.
    CHECK(seconds == Numbers{5, 6});
    CHECK(error_in([]() -> Numbers {
              ::raise(SIGXCPU);
              return {};
          }) == "can't be read: it takes longer than 5 s to read, so it must be damaged");
}

TEST_CASE("a reader that waits ends, one that was stopped or works slowly does not", "[files]")
{
    // The two alarms of the reader come immediately, with no work in between.
    CHECK(error_in([]() -> Numbers {
              for (int k = 0; k < 2; ++k) ::raise(SIGALRM);
              return {};
          }) == "can't be read: the reader waited for 30 s");

    const auto work = [] {
        const std::clock_t end = std::clock() + CLOCKS_PER_SEC / 20;  // processor time
        while (std::clock() < end) {
        }
    };
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "bytes";
    const Numbers read_in_the_end = read(folder / "file", [&] {
        for (int k = 0; k < 3; ++k) {
            ::raise(SIGALRM);  // ignored, because it also fires while the process is stopped
            work();
            ::raise(SIGALRM);
        }
        return Numbers{7};
    });
    CHECK(read_in_the_end == Numbers{7});
}

TEST_CASE("a message that promises more than it holds is an error", "[files]")
{
    const std::size_t promised = GENERATE(as<std::size_t>{}, 1, 1000, std::size_t{1} << 62, ~std::size_t{0});
    std::vector<unsigned char> memory(sizeof promised);
    std::memcpy(memory.data(), &promised, sizeof promised);
    MessageReader numbers(memory), text(memory);
    CHECK_FALSE(error_of([&] { receive(numbers); }).empty());
    CHECK_FALSE(error_of([&] { text.take_text(); }).empty());
}

TEST_CASE("a reader may use parallel loops while the other threads of this process are in theirs", "[files]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "bytes";
    std::atomic<int> right = 0;
    tbb::parallel_for(0, 64, [&](int i) {
        const Numbers sum = read(folder / "file", [i] {
            std::atomic<int> total = 0;
            tbb::parallel_for(0, 1000, [&](int k) { total += k * i; });
            return Numbers{total};
        });
        right += sum[0] == 499500 * i;
    });
    CHECK(right == 64);
}
