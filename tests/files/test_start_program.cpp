#include "runtime/files/start_program.h"

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>

#include "runtime/files/file_error.h"
#include "tests/test.h"

namespace rapid {
namespace {

int status_of(const std::string& script, const std::vector<std::pair<int, int>>& descriptors = {})
{
    return wait_for_program(start_program("/bin/sh", {"sh", "-c", script}, descriptors));
}

}  // namespace

TEST_CASE("a started program has the given descriptors, and its status is returned", "[files]")
{
    const Descriptor file(memfd_create("told", MFD_CLOEXEC));
    REQUIRE(file);
    const int status = status_of("echo words; exit 3", {{file.number(), STDOUT_FILENO}});
    REQUIRE(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 3);
    std::array<char, 6> text{};
    REQUIRE(pread(file.number(), text.data(), text.size(), 0) == 6);
    CHECK(std::string(text.data(), text.size()) == "words\n");
}

TEST_CASE("a program that is started has signals as it expects them", "[files]")
{
    // One signal that this process ignores, and one that this thread has blocked.
    const auto before = std::signal(SIGPIPE, SIG_IGN);
    sigset_t blocked, old;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &blocked, &old);
    const int of_ignored = status_of("kill -PIPE $$"), of_blocked = status_of("kill -TERM $$");
    pthread_sigmask(SIG_SETMASK, &old, nullptr);
    std::signal(SIGPIPE, before);
    CHECK((WIFSIGNALED(of_ignored) && WTERMSIG(of_ignored) == SIGPIPE));
    CHECK((WIFSIGNALED(of_blocked) && WTERMSIG(of_blocked) == SIGTERM));
}

TEST_CASE("a program that is not there is an error with its path", "[files]")
{
    CHECK_THROWS_WITH(start_program("/nowhere/dot", {"dot"}, {}),
                      "/nowhere/dot can't be started: No such file or directory");
}

}  // namespace rapid
