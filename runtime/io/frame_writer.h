// Writes frames while the next ones are computed.
//
// Frames are written one after another by a thread of the writer's own (a format spreads one file's work over all
// threads). At most a few wait: then submit() does, so that memory stays bounded. A file has its name only when it is
// complete, and what was written before an error stays. A waiting frame costs what changes after it: point sets share
// columns until one side writes.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "runtime/io/format.h"
#include "runtime/io/frame_pattern.h"
#include "runtime/picture/picture_fit.h"

namespace rapid {

class FrameWriter {
public:
    struct Written {
        int frame;
        std::string path;
        double seconds;
        std::uint64_t bytes;
    };

    // Error: an unknown extension. `waiting` frames at most are queued besides the one that is being written.
    explicit FrameWriter(const std::vector<OutputTarget>& targets, std::size_t waiting = 2);
    // Completes the file that is being written and drops the frames that wait; finish() writes them.
    ~FrameWriter();

    // Queues a frame of one output for all targets. Throws the first error of an earlier one.
    void submit(PointSet points, FrameInfo frame, std::string output = "main");
    // Waits until all is written. Throws the first error.
    void finish();

    // Wall time spent writing the frame so far, over all its files.
    double seconds(int frame) const;
    // The files so far, in order.
    std::vector<Written> written() const;

private:
    struct Target {
        FramePattern pattern;
        std::optional<std::vector<std::string>> attributes;
        bool picture;
    };
    struct Job {
        PointSet points;
        FrameInfo frame;
        std::string output;
    };
    // Pictures of one output. Those before the first points wait for these, so that the camera knows where to stand:
    // they hold no points, and cost nothing.
    struct Pictures {
        PictureFit fit;
        std::vector<std::pair<const Target*, Job>> waiting;
    };
    void run();
    void write(const Job& job);
    void write_file(const Target& target, const Job& job, std::shared_ptr<const PictureView> view);
    void write_waiting(Pictures& pictures, const std::shared_ptr<const PictureView>& view);

    std::vector<Target> targets_;
    const std::size_t waiting_;
    std::map<std::string, Pictures> pictures_;  // by output; the writer's thread, and finish() while that is idle

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Job> jobs_;
    bool busy_ = false, stopping_ = false;
    std::exception_ptr error_;
    std::vector<Written> written_;
    std::thread thread_;  // the last member: it starts when the others are there
};

}  // namespace rapid
