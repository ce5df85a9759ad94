#include "bindings/view/film.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <filesystem>
#include <fstream>
#include <utility>

#include "runtime/files/temporary_folder.h"
#include "runtime/io/film.h"
#include "runtime/io/frame_writer.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

}  // namespace

ViewFilm::ViewFilm(Wish wish, std::function<ViewFramePtr(std::int64_t)> frame_of)
    : wish_(std::move(wish)), frame_of_(std::move(frame_of))
{
    if (wish_.extension != ".mp4" && wish_.extension != ".webm" && wish_.extension != ".gif")
        throw Error(fmt::format("a film can't be a \"{}\"; it must be .mp4, .webm or .gif", wish_.extension));
    if (wish_.last < wish_.first)
        throw Error(fmt::format("a film of the frames {} to {} has none", wish_.first, wish_.last));
    const PictureOptions& picture = *wish_.picture;
    if (needs_even_edges(wish_.extension) && (picture.width % 2 != 0 || picture.height % 2 != 0))
        throw Error(fmt::format("a {} film of {} x {} can't be made; both edges must be even", wish_.extension,
                                picture.width, picture.height));
    require_ffmpeg();
    progress_.of = wish_.last - wish_.first + 1;
    thread_ = std::thread([this] { run(); });
}

ViewFilm::~ViewFilm()
{
    cancellation_.request();
    thread_.join();
}

ViewFilm::Progress ViewFilm::progress() const
{
    const std::lock_guard lock(mutex_);
    return progress_;
}

std::string ViewFilm::take()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(film_, {});
}

void ViewFilm::run()
{
    std::string film, error;
    tbb::task_arena arena(wish_.threads);
    arena.execute([&] {
        try {
            film = draw();
        } catch (const std::exception& caught) {
            error = caught.what();
        }
    });
    const std::lock_guard lock(mutex_);
    film_ = std::move(film);
    progress_.error = std::move(error);
    progress_.has_ended = true;
}

std::string ViewFilm::draw()
{
    const TemporaryFolder folder("film");  // until the film has been read
    const fs::path file = folder.path() / ("film" + wish_.extension);
    {
        FrameWriter writer({{file.string(), {}}}, 1);
        std::uint64_t run = 0;
        for (std::int64_t number = wish_.first; number <= wish_.last; ++number) {
            cancellation_.check();
            const ViewFramePtr frame = frame_of_(number);
            if (!frame) throw Error(fmt::format("frame {} is not computed", number));
            if (number == wish_.first) run = frame->run;
            if (frame->run != run) throw Error("the scene has begun again; make the film when it is computed");
            const auto points = frame->outputs.find(wish_.output);
            if (points == frame->outputs.end()) throw Error("the scene has no such output");
            FrameInfo info;
            info.number = static_cast<int>(number);
            info.time = static_cast<double>(number - wish_.first) / wish_.fps;
            info.fps = wish_.fps;
            info.picture = wish_.picture;
            info.scene = frame->scene;
            writer.submit(points->second, std::move(info));
            const std::size_t written = writer.take_written().size();
            const std::lock_guard lock(mutex_);
            progress_.done += static_cast<std::int64_t>(written);
        }
        writer.finish();
    }
    std::ifstream in(file, std::ios::binary);
    std::string film(std::istreambuf_iterator<char>(in), {});
    if (!in || film.empty()) throw Error("the film can't be read");
    const std::lock_guard lock(mutex_);
    progress_.done = progress_.of;
    return film;
}

}  // namespace rapid
