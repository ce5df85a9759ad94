// A film of frames that a viewer has, by the renderer of `rapid run -o film.mp4`, drawn on a thread of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "bindings/scene/scene_film.h"
#include "bindings/view/frame_store.h"
#include "runtime/base/cancellation.h"
#include "runtime/files/temporary_folder.h"

namespace rapid {

class ViewFilm {
public:
    struct Wish {
        std::string extension;  // .mp4, .webm or .gif
        std::int64_t first = 1, last = 1;
        std::string output;  // of the graph
        FilmOptions film;
        int threads = 1;
    };
    // frame_of: from any thread; null where there is no such frame, which is an error. Error: no ffmpeg; a format or
    // a size that can't be.
    ViewFilm(Wish wish, std::function<ViewFramePtr(std::int64_t)> frame_of);
    // Ends it where it is.
    ~ViewFilm();

    struct Progress {
        std::int64_t done = 0, of = 0;  // frames
        bool has_ended = false;
        std::string error;  // why there is no film; empty where there is none
    };
    Progress progress() const;
    // The film, once it has ended without an error.
    std::string take();

private:
    void run();
    std::string draw();

    const Wish wish_;
    const std::function<ViewFramePtr(std::int64_t)> frame_of_;
    std::optional<TemporaryFolder> folder_;  // until the film has been read
    std::string file_;
    std::optional<SceneFilm> drawn_;
    Cancellation cancellation_;
    mutable std::mutex mutex_;
    Progress progress_;
    std::string film_;
    std::thread thread_;  // the last member: it starts when the others are initialised
};

}  // namespace rapid
