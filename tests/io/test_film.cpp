#include "runtime/io/film.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "runtime/io/frame_writer.h"
#include "tests/files/temporary_folder.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

constexpr int width = 160, height = 90, pixels = width * height;

// Returns the pictures of a film, decoded by another run of ffmpeg.
std::vector<std::vector<std::uint8_t>> pictures_of(const std::filesystem::path& film)
{
    const std::string command =
        "ffmpeg -v error -i '" + film.string() + "' -vsync passthrough -f rawvideo -pix_fmt rgb24 -";
    const std::unique_ptr<std::FILE, decltype(&pclose)> pipe(popen(command.c_str(), "r"), &pclose);
    std::vector<std::vector<std::uint8_t>> pictures;
    std::vector<std::uint8_t> picture(3 * pixels);
    while (std::fread(picture.data(), 1, picture.size(), pipe.get()) == picture.size()) pictures.push_back(picture);
    return pictures;
}

// Grey, lighter from frame to frame.
Picture grey(int frame)
{
    return {width, height, std::vector<std::uint8_t>(3 * pixels, static_cast<std::uint8_t>(40 + 20 * frame))};
}

// Sets PATH during its lifetime.
class Path {
public:
    explicit Path(const std::string& path) : before_(std::getenv("PATH")) { setenv("PATH", path.c_str(), 1); }
    ~Path() { setenv("PATH", before_.c_str(), 1); }

private:
    std::string before_;
};

}  // namespace

TEST_CASE("ffmpeg ends with a run that a signal ends", "[io][film]")
{
    const TemporaryFolder folder;
    // Runs in a separate process, because the call is for a process that ends.
    const pid_t run = fork();
    if (run == 0) {
        alarm(20);  // otherwise it would wait without end
        OutputFile file(folder / "a.webm");
        Film film(file, ".webm", width, height, 25);
        film.add(grey(0));
        remove_unfinished_files();
        siginfo_t ended = {};
        const bool waited = waitid(P_ALL, 0, &ended, WEXITED | WNOWAIT) == 0;
        _exit(waited && ended.si_code == CLD_KILLED && ended.si_status == SIGKILL ? 0 : 1);
    }
    int status = 0;
    REQUIRE(waitpid(run, &status, 0) == run);
    CHECK(status == 0);
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("a film has the pictures that it was given, in their order", "[io][film]")
{
    const std::string extension = GENERATE(".mp4", ".webm", ".gif");
    CAPTURE(extension);
    const TemporaryFolder folder;
    {
        OutputFile file(folder / ("a" + extension));
        Film film(file, extension, width, height, 25);
        for (int frame = 0; frame < 8; ++frame) film.add(grey(frame));
        CHECK(file_names(folder.path()).empty());
        film.finish();
        file.finish();
    }
    const auto pictures = pictures_of(folder / ("a" + extension));
    REQUIRE(pictures.size() == 8);
    // The codec loses up to a step and a half of a byte's range of 219 levels, in either direction.
    for (int frame = 0; frame < 8; ++frame)
        for (const std::size_t byte : {std::size_t{0}, std::size_t{3 * pixels / 2}, std::size_t{3 * pixels - 1}})
            CHECK(std::abs(pictures[frame][byte] - grey(frame).rgb[byte]) <= 3);
}

TEST_CASE("a film that is not finished leaves nothing", "[io][film]")
{
    const TemporaryFolder folder;
    {
        OutputFile file(folder / "a.mp4");
        Film film(file, ".mp4", width, height, 24);
        film.add(grey(0));
    }
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("without ffmpeg a film is an error that names the package", "[io][film]")
{
    const TemporaryFolder folder;
    const Path path(folder.path().string());
    CHECK(error_of([] { require_ffmpeg(); }) ==
          "films need ffmpeg; install it (apt install ffmpeg), or write pictures (.png)");
    CHECK(error_of([&] { write_points(folder / "a.gif", PointSet()); }) ==
          (folder / "a.gif").string() +
              ": films need ffmpeg; install it (apt install ffmpeg), or write pictures (.png)");
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("what ffmpeg says is in the error", "[io][film]")
{
    const TemporaryFolder folder, programs;
    programs.write("ffmpeg", "#!/bin/sh\necho 'no such codec' >&2\nexit 1\n");
    std::filesystem::permissions(programs / "ffmpeg", std::filesystem::perms::owner_all);
    const Path path(programs.path().string() + ":" + std::getenv("PATH"));
    CHECK(error_of([&] { write_points(folder / "a.mp4", PointSet()); }) ==
          (folder / "a.mp4").string() + ": ffmpeg failed: no such codec");
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("a film with odd edges is refused where its colours are halved", "[io][film]")
{
    const TemporaryFolder folder;
    const auto odd = std::make_shared<PictureOptions>(PictureOptions{.width = 33, .height = 20});
    CHECK(error_of([&] { write_points(folder / "a.webm", PointSet(), {.picture = odd}); }) ==
          (folder / "a.webm").string() + ": a .webm film of 33 x 20 can't be made; both edges must be even");
    write_points(folder / "a.gif", PointSet(), {.picture = odd});
    CHECK(file_names(folder.path()).size() == 1);
}

TEST_CASE("a writer makes one film of all frames, and none of a part of them", "[io][film][writer]")
{
    const bool complete = GENERATE(true, false);
    const TemporaryFolder folder;
    const auto size = std::make_shared<PictureOptions>(PictureOptions{.width = width, .height = height});
    FrameWriter writer({{(folder / "{output}.mp4").string(), {}}});
    for (int frame = 1; frame <= 5; ++frame)
        writer.submit(frame < 3 ? PointSet() : random_points({.size = 50}), {.number = frame, .picture = size},
                      "stars");
    writer.finish(complete);
    CHECK(writer.first_unwritten() == std::nullopt);
    CHECK(file_names(folder.path()).size() == (complete ? 1 : 0));
    if (complete) CHECK(pictures_of(folder / "stars.mp4").size() == 5);
}
