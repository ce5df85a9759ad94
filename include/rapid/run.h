// Runs that write files, as `rapid run` does: frames in any format, pictures and films, statistics, a cache from which
// a run goes on, parts of the points for several machines.
//
//   rapid::RunOptions options;
//   options.files.outputs = {"first.####.vdb", "first.####.png"};
//   auto run = rapid::SceneRun::make("first.lua", {}, options);
//   if (!run) return fail(run.error().text());
//   if (auto ready = run->prepare(); !ready) return fail(ready.error().text());
//   auto outcome = run->run();
//   if (!outcome || outcome->error) return fail(outcome ? outcome->error->text() : outcome.error().text());
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene.h"

namespace rapid {

// Frames from the first one to the last, each step-th.
struct RunFrames {
    std::int64_t first = 1, last = 48, step = 1;  // numbers of frames, and a distance of them

    bool contains(std::int64_t frame) const { return frame >= first && frame <= last && (frame - first) % step == 0; }
    bool single() const { return first + step > last; }
};

// How pictures are drawn. What is not given is fitted to the points and shapes.
struct PictureSettings {
    PictureSize size{1280, 720};  // of each
    PictureCamera camera;         // of all
};

// The files of a run's frames.
struct FileOutputs {
    // PATTERN or PATTERN:ATTRIBUTE,ATTRIBUTE: #### is the frame's number, {output} the name of an output of the scene,
    // the extension chooses the format (docs/cli.md).
    std::vector<std::string> outputs;
    PictureSettings pictures;
};

// Snapshots and a journal of frames in a folder, from which a run goes on where an earlier one ended. Of scenes that
// take nothing of the program's own (SceneOptions::objects and nodes), as that may change unseen. The run that begins a
// cache decides whether errors are estimated (SceneOptions::estimate_errors); later ones do likewise.
struct RunCacheOptions {
    std::string folder;       // empty: there is none
    std::int64_t every = 10;  // a snapshot after each n-th frame, and after the last; 0: none
    bool again = false;       // computes and writes all frames, whatever the folder holds
    bool replace = false;     // the cache of another run is replaced, and no error
};

// One of `count` subsets of the points, chosen by ids, which are put together by merging their files.
struct RunPart {
    int number = 1, count = 1;  // from 1 to count
};

// What a run writes, and how.
struct RunOptions {
    std::optional<std::string> text;  // of the scene, whose file is then a name for messages
    std::optional<RunFrames> frames;  // that are written; all before them are computed. Nothing: 48 from the first
    FileOutputs files;                // of frames
    // Files besides; empty: none.
    std::string statistics;  // JSON, as of --stats
    std::string profile;     // a trace in Chrome's format
    std::string events;      // births, contacts and deaths as points
    RunCacheOptions cache;
    // Some of the points: file names get the part's, _part03of16 before the frame's number, or in place of {part}.
    std::optional<RunPart> part;
    std::optional<double> sample;  // the fraction of the points, above 0 and at most 1
    // A folder in which runs of different statistics note the files of their nodes, so that two of them, as of a wedge,
    // do not write one; empty: none.
    std::string claims;
};

// A frame that is done.
struct RunFrame {
    std::int64_t number = 0;   // of the frame
    std::uint64_t points = 0;  // of all outputs
    double seconds = 0;        // since the run began, those of the runs that it goes on behind included
    bool is_known = false;     // of a cache: it was not computed again
};

// Told by prepare() and run(), on the thread of the call, one at a time. They do not throw.
struct RunListener {
    std::function<void(const RunFrame& frame)> frame;      // that is done
    std::function<void(const std::string& text)> line;     // which files are written, what a cache has
    std::function<void(const std::string& text)> warning;  // each once; of a frame with its number
    // Frames are computed from now on. keeps_snapshots: what is computed until end_after_frame() will not be lost.
    std::function<void(bool keeps_snapshots)> begins;
};

// How a run ended.
struct RunOutcome {
    // By what it ended.
    enum Ending {
        Complete,
        Ended,   // by end_after_frame(): there are no films, no file of events, and a part is not complete
        Failed,  // in a frame, because a file could not be written, or by cancel()
    };
    Ending ending = Complete;            // of this run
    std::int64_t last_frame = 0;         // that was computed or known
    std::optional<SceneError> error;     // of Failed
    std::vector<std::string> unwritten;  // statistics or a profile that could not be written, and why
    std::string summary;                 // of Complete: points, seconds, errors, as `rapid run` prints it
};

// One run. Like a Scene it is used by one thread at a time, but for cancel() and end_after_frame().
class SceneRun {
public:
    // Its time begins here. Nothing is opened yet, and nothing written, but the folders of statistics and profile are
    // made. Error: WrongCall, an option that can't be.
    static Result<SceneRun> make(std::string file, SceneOptions scene = {}, RunOptions options = {},
                                 RunListener listener = {});

    // What is moved from may only be assigned to, or end.
    SceneRun(SceneRun&&) noexcept;
    SceneRun& operator=(SceneRun&&) noexcept;
    ~SceneRun();  // not while a call of another thread is running

    // Opens and plans the scene, and finds what is wrong with the names of files; once. Errors: as Scene::open(); an
    // output that the scene does not have, an attribute that nothing makes, two writers of one file, frames before the
    // scene's first, a subset of points that are coupled.
    Result<Done> prepare();

    // The rest behind prepare().
    std::int64_t first_frame() const;  // of the scene
    RunFrames frames() const;          // that are written

    // Computes and writes the frames; once. Error: found before the first frame: a folder of a cache that another run
    // has or that is of another run, a file of events that can't be written. What happens later is in the outcome.
    Result<RunOutcome> run();

    // Ends the run behind the frame that is being computed, with a snapshot where it has a cache. From any thread.
    void end_after_frame();
    // Ends it at once, as Scene::cancel(). From any thread.
    void cancel();

private:
    friend struct SceneInside;  // of Rapid itself
    struct Impl;
    explicit SceneRun(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid
