#include "runtime/files/output_file.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>

#include "tests/files/other_circumstances.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

using Unfinished = OutputFile::Unfinished;

void write(const std::filesystem::path& path, const std::string& text, Unfinished unfinished = Unfinished::Unnamed)
{
    OutputFile file(path, unfinished);
    file.append(text.data(), text.size());
    file.finish();
}

// Returns a text long enough to be torn.
std::string long_text(char letter) { return std::string(300000, letter); }
bool is_whole(const std::string& text) { return text == long_text(text.empty() ? ' ' : text[0]); }

// Runs f in a separate process, which acts as the next run for files that another has left. Its exit status is 0 unless
// f throws.
pid_t begin(const std::function<void()>& f)
{
    const pid_t child = ::fork();
    if (child != 0) return child;
    try {
        f();
        ::_exit(0);
    } catch (...) {
        ::_exit(1);
    }
}

int status_of(pid_t child)
{
    int status = -1;
    ::waitpid(child, &status, 0);
    return status;
}

int status_of_process(const std::function<void()>& f) { return status_of(begin(f)); }

// A pipe through which a process reports its progress.
class Progress {
public:
    Progress() { REQUIRE(::pipe(ends_) == 0); }
    ~Progress()
    {
        ::close(ends_[0]);
        ::close(ends_[1]);
    }
    void tell() const { CHECK(::write(ends_[1], "x", 1) == 1); }
    void wait() const
    {
        char byte;
        CHECK(::read(ends_[0], &byte, 1) == 1);
    }

private:
    int ends_[2];
};

std::size_t hidden_files(const std::filesystem::path& folder)
{
    const std::vector<std::string> names = file_names(folder);
    return static_cast<std::size_t>(
        std::count_if(names.begin(), names.end(), [](const std::string& name) { return name[0] == '.'; }));
}

}  // namespace

TEST_CASE("a file has its name only when it is complete, and replaces the old one at once", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const TemporaryFolder folder;
    std::ofstream(folder / "a.ply") << "old";
    {
        OutputFile file(folder / "a.ply", unfinished);
        file.append("half", 4);
        CHECK(file_text(folder / "a.ply") == "old");
        CHECK(hidden_files(folder.path()) <= (unfinished == Unfinished::Hidden));
    }
    CHECK(file_names(folder.path()) == std::vector<std::string>{"a.ply"});
    CHECK(file_text(folder / "a.ply") == "old");

    write(folder / "a.ply", "whole", unfinished);
    write(folder / "new/deep/b.ply", "another", unfinished);
    CHECK(file_text(folder / "a.ply") == "whole");
    CHECK(file_text(folder / "new/deep/b.ply") == "another");
    CHECK(file_names(folder.path()) == std::vector<std::string>{"a.ply", "new"});
}

TEST_CASE("a link with the file's name is replaced, and its target stays unchanged", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const TemporaryFolder folder;
    std::ofstream(folder / "target") << "precious";
    std::filesystem::create_symlink(folder / "target", folder / "a");
    std::filesystem::create_symlink(folder / "nowhere", folder / "b");

    for (const char* name : {"a", "b"}) write(folder / name, "new", unfinished);

    CHECK(file_text(folder / "target") == "precious");
    CHECK(file_text(folder / "a") == "new");
    CHECK(file_text(folder / "b") == "new");
    CHECK(file_names(folder.path()) == std::vector<std::string>{"a", "b", "target"});
}

TEST_CASE("a file that must not be replaced is left as it is", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const TemporaryFolder folder;
    const auto make = [&](const std::string& text) {
        OutputFile file(folder / "a", unfinished);
        file.append(text.data(), text.size());
        return file.finish_unless_taken();
    };
    CHECK(make("first"));
    CHECK_FALSE(make("second"));
    CHECK(file_text(folder / "a") == "first");
    CHECK(file_names(folder.path()) == std::vector<std::string>{"a"});
}

TEST_CASE("a signal handler's call removes unfinished files, and no file is begun after it", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const TemporaryFolder folder;
    // Runs in a separate process, because the call is for a process that ends.
    CHECK(status_of_process([&] {
              OutputFile file(folder / "a.ply", unfinished);
              file.append("half", 4);
              remove_unfinished_files();
              if (error_of([&] { OutputFile another(folder / "b.ply", unfinished); }).empty()) ::_exit(1);
              ::_exit(0);
          }) == 0);
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("a process that is killed leaves whole files, and the next one removes what else it left", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const TemporaryFolder folder;
    for (int round = 0; round < 20; ++round) {
        const Progress progress;
        const pid_t child = begin([&] {
            for (int i = 0;; ++i) {
                progress.tell();
                write(folder / std::to_string(i % 3), long_text(static_cast<char>('a' + i % 26)), unfinished);
            }
        });
        for (int i = 0; i <= round; ++i) progress.wait();
        ::kill(child, SIGKILL);
        CHECK(WIFSIGNALED(status_of(child)));
        CHECK(hidden_files(folder.path()) <= 1);
        for (const std::string& name : file_names(folder.path()))
            if (name[0] != '.') CHECK(is_whole(file_text(folder / name)));
        CHECK(status_of_process([&] { write(folder / "next", long_text('n'), unfinished); }) == 0);
        CHECK(hidden_files(folder.path()) == 0);
    }
}

TEST_CASE("the unfinished file of a process that lives is left to it", "[files]")
{
    const TemporaryFolder folder;
    const Progress begun, may_finish;
    const pid_t child = begin([&] {
        OutputFile file(folder / "slow", Unfinished::Hidden);
        file.append("half ", 5);
        begun.tell();
        may_finish.wait();
        file.append("whole", 5);
        file.finish();
    });
    begun.wait();
    CHECK(hidden_files(folder.path()) == 1);
    CHECK(status_of_process([&] { write(folder / "quick", "text", Unfinished::Hidden); }) == 0);
    CHECK(hidden_files(folder.path()) == 1);
    may_finish.tell();
    CHECK(status_of(child) == 0);
    CHECK(file_text(folder / "slow") == "half whole");
    CHECK(hidden_files(folder.path()) == 0);
}

TEST_CASE("processes that write the same names, or others into the same folder, do not meet", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const bool same_names = GENERATE(true, false);
    const TemporaryFolder folder;
    std::vector<pid_t> children;
    for (const char letter : {'a', 'b', 'c'})
        children.push_back(begin([&] {
            for (int i = 0; i < 40; ++i)
                write(folder / (std::to_string(i) + (same_names ? "" : std::string(1, letter))), long_text(letter),
                      unfinished);
        }));
    for (const pid_t child : children) CHECK(status_of(child) == 0);
    const std::vector<std::string> names = file_names(folder.path());
    CHECK(names.size() == (same_names ? 40 : 120));
    for (const std::string& name : names) CHECK(is_whole(file_text(folder / name)));
}

TEST_CASE("a full disk and a limit of a file's size are errors, and nothing stays", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const std::string much(2 << 20, 'x');
    const SmallDisk disk;
    if (disk.mounted()) {
        CHECK(error_of([&] { write(disk.folder() / "a", much, unfinished); }) ==
              "can't be written: No space left on device");
        CHECK(file_names(disk.folder().path()).empty());
    }
    const TemporaryFolder folder;
    CHECK(status_of_process([&] {
              ::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit{1 << 20, 1 << 20};
              ::setrlimit(RLIMIT_FSIZE, &limit);
              const std::string error = error_of([&] { write(folder / "a", much, unfinished); });
              ::_exit(error == "can't be written: File too large" ? 0 : 1);
          }) == 0);
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("an impossible path is an error: a folder, a device, a vanished folder", "[files]")
{
    const Unfinished unfinished = GENERATE(Unfinished::Unnamed, Unfinished::Hidden);
    const TemporaryFolder folder;
    for (const std::filesystem::path& path : {folder.path(), std::filesystem::path("/dev/full")})
        CHECK(error_of([&] { write(path, "x", unfinished); }) == "can't be written: it is not a regular file");

    OutputFile file(folder / "gone/a", unfinished);
    std::filesystem::remove_all(folder / "gone");
    CHECK(error_of([&] { file.finish(); }) == "can't be named when complete: No such file or directory");
}

// A process reads its own files without a sandbox (read_sandboxed.h).
TEST_CASE("a file that another program changed in place is detected, even with unchanged times", "[files]")
{
    const TemporaryFolder folder;
    const std::filesystem::path path = folder / "a.vdb";
    write(path, "own");
    REQUIRE(is_own_file(path));
    struct stat before = {}, after = {};
    REQUIRE(::stat(path.c_str(), &before) == 0);
    const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    do {  // the file system's clock ticks some hundred times per second
        CHECK(::pwrite(file, "bad", 3, 0) == 3);
        const timespec times[] = {before.st_atim, before.st_mtim};
        CHECK(::futimens(file, times) == 0);
        REQUIRE(::stat(path.c_str(), &after) == 0);
    } while (after.st_ctim.tv_sec == before.st_ctim.tv_sec && after.st_ctim.tv_nsec == before.st_ctim.tv_nsec);
    ::close(file);
    CHECK((after.st_size == before.st_size && after.st_mtim.tv_nsec == before.st_mtim.tv_nsec));
    CHECK_FALSE(is_own_file(path));
}

TEST_CASE("a durable file is written as any other", "[files]")
{
    const TemporaryFolder folder;
    CHECK(status_of_process([&] {
              make_files_durable();
              write(folder / "a", "first");
              write(folder / "a", "second");
          }) == 0);
    CHECK(file_text(folder / "a") == "second");
}
