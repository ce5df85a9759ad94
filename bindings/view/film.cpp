#include "bindings/view/film.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <fstream>
#include <utility>

namespace rapid {

ViewFilm::ViewFilm(Settings settings, std::function<ViewFramePtr(std::int64_t)> frame_of)
    : settings_(std::move(settings)), frame_of_(std::move(frame_of))
{
    if (settings_.extension != ".mp4" && settings_.extension != ".webm" && settings_.extension != ".gif")
        throw Error(fmt::format("a film can't be a \"{}\"; it must be .mp4, .webm or .gif", settings_.extension));
    if (settings_.last < settings_.first)
        throw Error(fmt::format("a film of the frames {} to {} would be empty", settings_.first, settings_.last));
    folder_.emplace("film");
    file_ = folder_->path() / ("film" + settings_.extension);
    drawn_ = SceneFilm::begin(file_, settings_.film).value();
    progress_.of = settings_.last - settings_.first + 1;
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
    tbb::task_arena arena(settings_.threads);
    arena.execute([&] {
        try {
            film = draw();
        } catch (const std::exception& caught) {
            error = caught.what();
        }
        drawn_.reset();
        folder_.reset();
    });
    const std::lock_guard lock(mutex_);
    film_ = std::move(film);
    progress_.error = std::move(error);
    progress_.has_ended = true;
}

std::string ViewFilm::draw()
{
    std::uint64_t run = 0;
    for (std::int64_t number = settings_.first; number <= settings_.last; ++number) {
        cancellation_.check();
        const ViewFramePtr frame = frame_of_(number);
        if (!frame) throw Error(fmt::format("frame {} is not computed", number));
        if (number == settings_.first) run = frame->run;
        if (frame->run != run) throw Error("the scene has started again; make the film when it is complete");
        const Result<SceneFrame> points = frame->points.output(settings_.output);
        if (!points) throw Error("the scene has no output of this name");
        drawn_->add(*points, frame->shapes).value();
        const std::lock_guard lock(mutex_);
        progress_.done = drawn_->done();
    }
    drawn_->finish().value();
    std::ifstream in(file_, std::ios::binary);
    std::string film(std::istreambuf_iterator<char>(in), {});
    if (!in || film.empty()) throw Error("the film can't be read");
    const std::lock_guard lock(mutex_);
    progress_.done = progress_.of;
    return film;
}

}  // namespace rapid
