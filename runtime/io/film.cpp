#include "runtime/io/film.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/files/start_program.h"

namespace rapid {
namespace {

constexpr int input = STDIN_FILENO, output = 3;  // ffmpeg's descriptors

std::string path_of_ffmpeg()
{
    if (std::string file = program_path("ffmpeg"); !file.empty()) return file;
    throw Error("films need ffmpeg; install it (apt install ffmpeg), or write pictures (.png)");
}

// Returns encoder options: constant quality, close to that of the pictures, with the matrix and primaries of HD video,
// which players assume.
std::vector<std::string> encoder_for(std::string_view extension)
{
    const std::vector<std::string> hd = {"-vf",
                                         "scale=out_color_matrix=bt709:out_range=tv",
                                         "-pix_fmt",
                                         "yuv420p",
                                         "-colorspace",
                                         "bt709",
                                         "-color_primaries",
                                         "bt709",
                                         "-color_trc",
                                         "bt709"};
    std::vector<std::string> arguments;
    if (extension == ".mp4") {
        arguments = {"-c:v", "libx264", "-crf", "17", "-movflags", "+faststart", "-f", "mp4"};
        arguments.insert(arguments.begin(), hd.begin(), hd.end());
    } else if (extension == ".webm") {
        arguments = {"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-row-mt", "1", "-f", "webm"};
        arguments.insert(arguments.begin(), hd.begin(), hd.end());
    } else {
        // Uses a palette per picture, because a common one would have to wait for the last picture.
        arguments = {"-filter_complex", "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1", "-f",
                     "gif"};
    }
    return arguments;
}

}  // namespace

void require_ffmpeg() { path_of_ffmpeg(); }

bool needs_even_edges(std::string_view extension) { return extension == ".mp4" || extension == ".webm"; }

Film::Film(OutputFile& file, std::string_view extension, int width, int height, double fps)
{
    if (needs_even_edges(extension) && (width % 2 != 0 || height % 2 != 0))
        throw Error(
            fmt::format("a {} film of {} x {} can't be made; both edges must be even", extension, width, height));
    const std::string program = path_of_ffmpeg();
    std::vector<std::string> words = {"ffmpeg",
                                      "-nostdin",
                                      "-hide_banner",
                                      "-loglevel",
                                      "error",
                                      "-f",
                                      "rawvideo",
                                      "-pix_fmt",
                                      "rgb24",
                                      "-s",
                                      fmt::format("{}x{}", width, height),
                                      "-r",
                                      fmt::format("{}", fps),
                                      "-i",
                                      "pipe:0",
                                      "-an"};
    for (std::string& word : encoder_for(extension)) words.push_back(std::move(word));
    // Passes the descriptor, because the file has no name yet.
    for (const char* word : {"-y", "/proc/self/fd/3"}) words.emplace_back(word);

    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        throw Error(fmt::format("can't connect to ffmpeg: {}", std::strerror(errno)));
    frames_ = Descriptor(ends[0]);
    const Descriptor theirs(ends[1]);
    messages_ = Descriptor(memfd_create("ffmpeg", MFD_CLOEXEC));
    if (!messages_) throw Error(fmt::format("can't connect to ffmpeg: {}", std::strerror(errno)));

    ffmpeg_ = start_program(program, std::move(words),
                            {{messages_.number(), STDERR_FILENO},
                             {messages_.number(), STDOUT_FILENO},
                             {theirs.number(), input},
                             {file.descriptor(), output}});
    writing_.emplace(ffmpeg_);
}

Film::~Film()
{
    if (ffmpeg_ < 0) return;
    kill(ffmpeg_, SIGKILL);
    wait();
}

void Film::add(const Picture& picture)
{
    for (std::size_t sent = 0; sent < picture.rgb.size();) {
        const ssize_t count =
            send(frames_.number(), picture.rgb.data() + sent, picture.rgb.size() - sent, MSG_NOSIGNAL);
        if (count > 0)
            sent += static_cast<std::size_t>(count);
        else if (errno != EINTR)
            fail();
    }
}

void Film::finish()
{
    frames_ = Descriptor();  // ends its input
    const int status = wait();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail();
}

int Film::wait()
{
    siginfo_t ended = {};  // WNOWAIT: once reaped, its process id may belong to another program
    while (waitid(P_PID, static_cast<id_t>(ffmpeg_), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
    }
    writing_.reset();
    return wait_for_program(std::exchange(ffmpeg_, -1));
}

void Film::fail()
{
    if (ffmpeg_ >= 0) {
        frames_ = Descriptor();
        wait();
    }
    char text[1000];
    const ssize_t count = pread(messages_.number(), text, sizeof text, 0);
    std::string said(text, count > 0 ? static_cast<std::size_t>(count) : 0);
    while (!said.empty() && said.back() == '\n') said.pop_back();
    throw Error(fmt::format("ffmpeg failed: {}", said.empty() ? "without a message" : said));
}

}  // namespace rapid
