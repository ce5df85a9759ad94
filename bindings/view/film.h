// A film of a viewer's frames, drawn by the renderer of `rapid run -o film.mp4` on a thread of its own.
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
    struct Settings {
        std::string extension;  // .mp4, .webm or .gif
        std::int64_t first = 1, last = 1;
        std::string output;  // name of the output in the graph
        FilmOptions film;
        int threads = 1;
    };
    // frame_of: callable from any thread; null means that the frame does not exist, which is an error. Throws Error if
    // there is no ffmpeg, or if the format or size is not possible.
    ViewFilm(Settings settings, std::function<ViewFramePtr(std::int64_t)> frame_of);
    // Stops the film.
    ~ViewFilm();

    struct Progress {
        std::int64_t done = 0, of = 0;  // frames
        bool has_ended = false;
        std::string error;  // the reason if there is no film; otherwise empty
    };
    Progress progress() const;
    // Returns the film after it has ended without an error.
    std::string take();

private:
    void run();
    std::string draw();

    const Settings settings_;
    const std::function<ViewFramePtr(std::int64_t)> frame_of_;
    std::optional<TemporaryFolder> folder_;  // exists until the film has been read
    std::string file_;
    std::optional<SceneFilm> drawn_;
    Cancellation cancellation_;
    mutable std::mutex mutex_;
    Progress progress_;
    std::string film_;
    std::thread thread_;  // the last member: it starts when the others are initialised
};

}  // namespace rapid
