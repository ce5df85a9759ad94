// Writes frames while the next ones are computed.
//
// A separate thread writes one frame after another (a format uses all threads for one file). When a few frames are
// queued, submit() blocks to bound memory. A file gets its name only when it is complete, and files written before an
// error are kept. A queued frame shares its columns with later ones, and costs memory only for those that change.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "runtime/files/frame_pattern.h"
#include "runtime/io/film.h"
#include "runtime/io/format.h"
#include "runtime/picture/picture_fit.h"
#include "runtime/points/point_set.h"

namespace rapid {

class FrameWriter {
public:
    struct Written {
        int frame;
        std::string path;
        double seconds;
        std::uint64_t bytes;
        std::chrono::steady_clock::time_point end = {};
        bool film = false;  // part of a film, which is complete only with its last frame
        // For a picture: the state from which later frames continue. Null if the picture had to wait for points.
        std::shared_ptr<const PictureFit> fit = nullptr;
        std::uint64_t points = 0;  // 0 also for a picture that had to wait
    };

    using Write = std::function<void(const std::filesystem::path& file, const PointSet& points)>;
    // waiting: largest number of frames in the queue, in addition to the one being written. write: writes a file
    // instead of the format of its extension, unless empty. Throws Error if an extension is unknown.
    explicit FrameWriter(const std::vector<OutputTarget>& targets, std::size_t waiting = 2, Write write = {});
    // Completes the file that is being written and drops the queue; finish() would write it.
    ~FrameWriter();

    // Queues a frame of one output for all targets. Throws the first error of an earlier frame. before: picture state
    // from another run, to continue from instead of this run's own state.
    void submit(PointSet points, FrameInfo frame, std::string output = "main",
                std::shared_ptr<const PictureFit> before = nullptr);
    // Waits until all frames are written. Throws the first error. complete: whether the run has all its frames; an
    // incomplete film is dropped.
    void finish(bool complete = true);

    // Returns the files completed since the last call, in order. The writer does not keep them, because a run may have
    // many frames.
    std::vector<Written> take_written();
    // Returns the first submitted frame with a file that is not written yet.
    std::optional<int> first_unwritten() const;

private:
    struct Target {
        FramePattern pattern;
        std::optional<std::vector<std::string>> attributes;
        bool picture, film;
    };
    struct Job {
        PointSet points;
        FrameInfo frame;
        std::string output;
        std::shared_ptr<const PictureFit> before;
    };
    // Pictures of one output. Those before the first points wait, because the camera is fitted to points. They hold no
    // points, but the shapes of their frame, so at most a hundred wait. If no points come, they show only the shapes.
    struct Pictures {
        PictureFit fit;
        std::shared_ptr<Painter> painter;
        std::vector<std::pair<const Target*, Job>> waiting;
    };
    struct RunningFilm {
        OutputFile file;
        Film film;

        RunningFilm(const std::string& path, const Picture& first, double fps)
            : file(path), film(file, format_of(path).extension, first.width, first.height, fps)
        {
        }
    };
    void run();
    void write(const Job& job);
    void write_file(const Target& target, const Job& job, std::shared_ptr<const PictureView> view,
                    std::shared_ptr<const PictureFit> fit);
    void add_to_film(const std::string& path, const PointSet& points, const FrameInfo& frame);
    void write_without_points(Pictures& pictures);
    void write_waiting(Pictures& pictures, const std::shared_ptr<const PictureView>& view);

    std::vector<Target> targets_;
    const std::size_t waiting_;
    const Write write_;
    std::map<std::string, Pictures> pictures_;  // by output; used by the thread, and by finish() while that is idle

    std::map<std::string, std::unique_ptr<RunningFilm>> films_;  // by file; likewise

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Job> jobs_;
    bool busy_ = false, stopping_ = false;
    std::exception_ptr error_;
    std::vector<Written> written_;    // since the last take_written()
    std::map<int, std::size_t> due_;  // unwritten files per frame
    std::thread thread_;              // must be the last member, because it uses the others
};

// Returns the points with only P, v, id and the named attributes and groups. Throws Error if a name is unknown,
// suggesting the nearest.
PointSet select_attributes(const PointSet& points, const std::vector<std::string>& names);

}  // namespace rapid
