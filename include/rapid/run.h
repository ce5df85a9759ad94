// Runs that write files, as `rapid run` does: frames in any format, pictures and films, statistics, a cache from which
// a run continues, parts of the points for several machines.
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

// Every step-th frame from the first one to the last.
struct RunFrames {
    std::int64_t first = 1, last = 48, step = 1;  // numbers of frames, and a distance of them

    // Returns true if this frame is included.
    bool contains(std::int64_t frame) const { return frame >= first && frame <= last && (frame - first) % step == 0; }
    // Returns true if there is one frame only.
    bool single() const { return first + step > last; }
};

// Settings of pictures. Missing values are fitted to the points and shapes.
struct PictureSettings {
    PictureSize size{1280, 720};  // of each
    PictureCamera camera;         // of all
};

// The files of a run's frames.
struct FileOutputs {
    // PATTERN or PATTERN:ATTRIBUTE,ATTRIBUTE, where #### is the frame's number and {output} the name of an output of
    // the scene; the extension selects the format (docs/cli.md).
    std::vector<std::string> outputs;
    PictureSettings pictures;
};

// Snapshots and a journal of frames in a folder, from which a run continues an earlier one. Scenes that take objects or
// nodes of the program (SceneOptions::objects and nodes) are refused, since those may change unnoticed. The run that
// begins a cache decides whether errors are estimated (SceneOptions::estimate_errors); later ones follow it.
struct RunCacheOptions {
    std::string folder;       // empty: no cache
    std::int64_t every = 10;  // a snapshot after every n-th frame, and after the last; 0: none
    bool again = false;       // computes and writes all frames, regardless of the folder
    bool replace = false;     // replaces the cache of another run, which otherwise is an error
};

// One of `count` subsets of the points, chosen by id. Merging their files yields the whole.
struct RunPart {
    int number = 1, count = 1;  // from 1 to count
};

// Options of a run.
struct RunOptions {
    std::optional<std::string> text;  // text of the scene, whose file is then only a name for messages
    std::optional<RunFrames> frames;  // frames to write; earlier ones are computed. Nothing: 48 from the first
    FileOutputs files;                // of frames
    // Other files; empty: none.
    std::string statistics;  // JSON, as for --stats
    std::string profile;     // a trace in Chrome's format
    std::string events;      // births, contacts and deaths as points
    RunCacheOptions cache;
    // Selects some of the points. File names get that of the part, _part03of16 before the frame's number, or for
    // {part}.
    std::optional<RunPart> part;
    std::optional<double> sample;  // the fraction of the points, above 0 and at most 1
    // A folder in which runs with different settings claim the files of their nodes, so that no two of them, as in a
    // wedge, write the same file; empty: none.
    std::string claims;
};

// A completed frame.
struct RunFrame {
    std::int64_t number = 0;   // of the frame
    std::uint64_t points = 0;  // of all outputs
    double seconds = 0;        // since the run began, including the runs that it continues
    bool is_known = false;     // from a cache: it was not computed again
};

// Callbacks of prepare() and run(), on the thread of the call, one at a time. They must not throw.
struct RunListener {
    std::function<void(const RunFrame& frame)> frame;      // completed
    std::function<void(const std::string& text)> line;     // the files written, the contents of a cache
    std::function<void(const std::string& text)> warning;  // each once; with its number if it is of a frame
    // Called before frames are computed. keeps_snapshots: frames computed until end_after_frame() will not be lost.
    std::function<void(bool keeps_snapshots)> begins;
};

// How a run ended.
struct RunOutcome {
    // Kinds of endings.
    enum Ending {
        Complete,
        Ended,   // by end_after_frame(): no films and no file of events; a part is not complete
        Failed,  // in a frame, because a file could not be written, or by cancel()
    };
    Ending ending = Complete;            // of this run
    std::int64_t last_frame = 0;         // the last one computed or known
    std::optional<SceneError> error;     // for Failed
    std::vector<std::string> unwritten;  // statistics or a profile that could not be written, and why
    std::string summary;  // for Complete: the summary that `rapid run` prints, several lines, as printed by `rapid run`
};

// A run. Like a Scene it is used by one thread at a time, except cancel() and end_after_frame().
class SceneRun {
public:
    // Makes a run, and starts its clock. Nothing is opened or written yet, but the folders of statistics and profile
    // are made. Fails with WrongCall if an option is not possible.
    static Result<SceneRun> make(std::string file, SceneOptions scene = {}, RunOptions options = {},
                                 RunListener listener = {});

    // A moved-from run may only be assigned to or destroyed.
    SceneRun(SceneRun&&) noexcept;
    SceneRun& operator=(SceneRun&&) noexcept;
    ~SceneRun();  // not while a call of another thread is running

    // Opens and plans the scene, and checks the names of files; once. Errors are those of Scene::open(), and an output
    // that the scene does not have, an attribute that nothing makes, two writers of one file, frames before the scene's
    // first, or a subset of points that are coupled.
    Result<Done> prepare();

    // Valid after prepare().
    std::int64_t first_frame() const;  // of the scene
    RunFrames frames() const;          // to write

    // Computes and writes the frames; once. Errors are those found before the first frame: a cache folder that another
    // run uses or has made, or a file of events that cannot be written. Later errors are in the outcome.
    Result<RunOutcome> run();

    // Ends the run after the current frame, with a snapshot if it has a cache. Callable from any thread.
    void end_after_frame();
    // Ends it at once, like Scene::cancel(). Callable from any thread.
    void cancel();

private:
    friend struct SceneInside;  // of Rapid itself
    struct Impl;
    explicit SceneRun(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid
