// Writes frames while the next ones are computed.
//
// A thread of its own writes one frame after another (a format uses all threads for one file). When a few frames are
// queued, submit() blocks, so that memory stays bounded. A file gets its name only when it is complete, and files
// written before an error stay. A queued frame shares its columns with later ones, and costs only those that change.
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

namespace rapid {

class FrameWriter {
public:
    struct Written {
        int frame;
        std::string path;
        double seconds;
        std::uint64_t bytes;
        std::chrono::steady_clock::time_point end = {};
        bool film = false;  // a frame of a film, which is complete with its last one
        // Of a picture: what those of later frames go on from; null where it has waited for points.
        std::shared_ptr<const PictureFit> fit = nullptr;
    };

    using Write = std::function<void(const std::filesystem::path& file, const PointSet& points)>;
    // waiting: the most frames in the queue, besides the one that is being written. write: what writes a file in place
    // of the format of its extension, or empty. Error: an unknown extension.
    explicit FrameWriter(const std::vector<OutputTarget>& targets, std::size_t waiting = 2, Write write = {});
    // Completes the file that is being written, and drops the queue, which finish() would write.
    ~FrameWriter();

    // Queues a frame of one output for all targets. Throws the first error of an earlier frame.
    // before: what the picture of an earlier frame, of another run, has left, in place of those of this one.
    void submit(PointSet points, FrameInfo frame, std::string output = "main",
                std::shared_ptr<const PictureFit> before = nullptr);
    // Waits until all frames are written. Throws the first error. complete: whether they are all that there should be;
    // a film of some of them is dropped.
    void finish(bool complete = true);

    // The files that are complete since the last call, in order: a run of many frames keeps none of them.
    std::vector<Written> take_written();
    // The first of the submitted frames of which a file is still to come.
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
    // Pictures of one output. Those before the first points wait for them, because the camera is fitted to points. They
    // hold none, but the shapes of their frame: a hundred wait, and where no points come they show the shapes alone.
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
    std::vector<Written> written_;    // since they were last taken
    std::map<int, std::size_t> due_;  // by frame: files that are still to come
    std::thread thread_;              // the last member: it starts when the others are initialised
};

}  // namespace rapid
