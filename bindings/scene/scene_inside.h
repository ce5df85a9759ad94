// What Rapid's own programs, and the tests, ask of scenes besides include/rapid: nobody else is promised it.
//
// Errors, units and threads are those of rapid/scene.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "include/rapid/run.h"
#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"

namespace rapid {

// What a program needs that runs scenes of others, besides SceneOptions.
struct SceneHooks {
    // Told, with the error's text, of each script that takes longer than script_seconds, before it is stopped: for a
    // program that then rather ends, as a process that may not read /proc/self/maps can't stop compiled code. On a
    // thread of Rapid's; what it throws is dropped.
    std::function<void(const std::string& message)> late;
    // Told of each file before it is read, and of each place where a module or a node was looked for. On any thread;
    // what it throws is dropped.
    std::function<void(const std::string& path)> reads;
    // Told where memory was to end what is computed, and comes too late: the process has a sixteenth more than it may,
    // or did not stop within a second. With the error's text; for a program that then rather ends. On a thread of
    // Rapid's.
    std::function<void(const std::string& message)> beyond_memory;
    // Whether a frame ends with an error where the process takes more memory than its limit: not for a program that
    // keeps frames, as long as it has room for them.
    bool watch_memory = true;
    // Told of the parameters as soon as the scene's file has run, before its plan is made, which may fail: for a
    // program that lets its user change them then, too. On the thread of the call; what it throws is dropped.
    std::function<void(const std::vector<SceneParameter>& parameters)> parameters;
    // Ends what the scene does, opening too, and all that it is asked to do later, with the error Cancelled: as
    // Scene::cancel(), but once and for all. std::stop_source::request_stop() is for any thread at any time.
    std::stop_token stop;
    // Refuses what no snapshot can hold, such as a function of the frame that counts in a local variable: for programs
    // that go on in another process. Only then is there a fingerprint().
    bool keep_state = false;
    // The points behind a solve have the columns "error" (m, where it is estimated), "substeps" and "asleep".
    bool tell_points = false;
};

// What the scene gives, known before a frame is computed.
struct SceneOutput {
    std::string name;                  // "main" where the scene returns one node
    std::vector<std::string> creates;  // whose points it holds, by name; of several, ids are not those of the creates
};

// An attribute, or a group, that the points of a create may have.
struct SceneAttribute {
    std::string name;       // of a group with "group:" before it
    std::string create;     // the name of the node
    bool is_kept = false;   // whether the run keeps it; explain() says why
    std::size_t bytes = 0;  // that it takes for each point, where the points do not share one value
};

// A point as its create knows it.
struct PointOrigin {
    std::string create;   // the name of the node
    std::int64_t id = 0;  // under which it made the point
};

// What the frames of a scene follow from: scenes of equal fingerprints come to the same bits.
struct SceneFingerprint {
    // By name: the build of Rapid, plugins, parameters, seeds, nodes with their arguments and inputs, the code of all
    // functions, the contents of the files that opening has read, what points tell (SceneHooks::tell_points). Of what
    // the program offers the names alone.
    std::map<std::string, std::string> parts;
    std::string hash;  // of them, without the lines in which functions stand
};

// The documentation of a type of node.
struct NodeDocument {
    std::string name, doc;  // `:NAME { ... }`, and a sentence
    SceneReport page;       // parameters, and what it reads, writes and makes, as `rapid nodes NAME` prints it
};

// What scenes are made of.
struct NodeDocuments {
    std::vector<NodeDocument> types;    // native ones, Rapid's own in Lua, and those that are found; in order of name
    std::vector<std::string> warnings;  // of files that define a node with a mistake in it
    std::string annotations;            // all that scenes are written with, for the Lua language server
};

// Where Graphviz has put the nodes and edges of a graph, for those of the next run that has the same ones.
struct GraphLayout {
    std::string graph;   // in Graphviz's language, without what depends on values; empty: none is kept
    std::string places;  // of it, as `dot -Tjson` writes them
};

// What a text of FileOutputs::outputs asks for.
struct OutputFormat {
    std::string extension;  // ".vdb"
    bool is_film = false;   // one file of all frames, which ffmpeg writes
};
// What SceneInside::abandon() has to tell.
struct Abandoned {
    std::vector<std::string> warnings;   // that were only counted until now
    std::vector<std::string> unwritten;  // as RunOutcome
};

// Whether frames have the same bits in other orders of the points and in two states of Lua.
struct SceneRaces {
    std::optional<SceneError> found;  // the first difference, with its node
    bool compared = false;            // whether there was a point in these frames
};

// By what they ask.
struct SceneInside {
    using Impl = Scene::Impl;
    static Impl& of(Scene& scene) { return *scene.impl_; }
    static const Impl& of(const Scene& scene) { return *scene.impl_; }

    // ---- Scenes.

    static Result<Scene> open(const std::string& file, SceneOptions options, SceneHooks hooks);
    // From files and folders, a list separated by colons, as RAPID_PLUGIN_PATH.
    static Result<Done> load_plugins(const std::string& path);
    // In the whole process: memory of up to so many columns that are released, and of 64 MiB at most, is kept for those
    // that are made next; at first 4, never fewer than before. For a program that keeps the frames of a run until those
    // of the next one replace them: all columns of a frame are then released at once, and the system would clear each
    // page anew.
    static Result<Done> keep_spare_columns(std::size_t columns);
    // Without a scene, for those who write one: with the nodes of the Lua files in the current folder and on
    // RAPID_PATH.
    static Result<NodeDocuments> documents();
    // The types that every scene of the process may use: native ones, those of plugins, and Rapid's own in Lua; in
    // order of name.
    static Result<std::vector<SceneNodeType>> all_node_types();

    // In order of name.
    static const std::vector<SceneOutput>& outputs(const Scene& scene);
    // Those of all creates, in the order of the plan.
    static Result<std::vector<SceneAttribute>> attributes(Scene& scene);
    // The arguments of the nodes in a frame, as texts, by node and parameter.
    static Result<std::map<std::string, std::map<std::string, std::string>>> arguments(Scene& scene,
                                                                                       std::int64_t frame);
    // As GraphForm::Json. `kept` is used where it is of this graph, and else replaced. nullptr: no places, for a
    // program that lays graphs out itself, or may start no other one. Error: `dot` is needed, and not there.
    static Result<std::string> graph_json(Scene& scene, GraphLayout* kept);
    // The points as they leave each node that is evaluated in a frame, as ones with the only output of the node's name.
    // The scene stays where it is: the frames are computed beside it, from a snapshot of this scene before the frame,
    // or from the first one. Those of the last frame that was asked for are kept. Nodes whose result never changes are
    // not evaluated in each frame. Error: a frame before the first one; a snapshot of another graph, or behind the
    // frame; after a script had to be stopped, the scene is to be restarted.
    static Result<std::map<std::string, SceneFrame>> points_behind_all(Scene& scene, std::int64_t frame,
                                                                       const std::optional<SceneSnapshot>& from = {});
    // The create of a point of a frame's output, and its id there: where the points of several are merged, by the place
    // and the velocity, from points_behind_all(). Error: the frame has no such output or point; several points are at
    // its place; nodes behind its Solve have moved it.
    static Result<PointOrigin> origin(Scene& scene, const SceneFrame& frame, std::int64_t id,
                                      const std::optional<SceneSnapshot>& from = {});
    // These three with SceneHooks::keep_state alone.
    static Result<SceneFingerprint> fingerprint(Scene& scene);
    // Files that have been read since the last call, those of opening left out: a hash of the content of each, by name.
    static Result<std::map<std::string, std::string>> take_inputs(Scene& scene);
    // Whether the files of which another run of this scene has told by take_inputs() have the same contents still.
    static Result<bool> are_unchanged(Scene& scene, const std::map<std::string, std::string>& inputs);

    // ---- Frames, snapshots and shapes.

    // That the columns and groups of all outputs take; those that are shared with other frames count in each.
    static std::size_t bytes(const SceneFrame& frame);
    // The points alone, without statistics, profile and warnings, for a program that keeps many frames: errors may be
    // estimated of each point.
    static Result<SceneFrame> without_statistics(const SceneFrame& frame);
    // The camera of a picture, with all that `camera` leaves open. Error: as SceneFrame::picture().
    static Result<PictureCamera> camera(const SceneFrame& frame, const SceneShapes& shapes,
                                        const PictureCamera& camera = {}, PictureSize size = {});

    // To the bit, to a file for the same build of Rapid, and back. key: of what they follow from, such as
    // fingerprint(). Of a frame the points of all outputs are kept, of shapes all but warnings. Error: the system's; of
    // load also a file that is of something else, damaged, of another build or another key.
    static Result<Done> save(const SceneFrame& frame, const std::string& path, const std::string& key);
    static Result<SceneFrame> load_frame(const std::string& path, const std::string& key);
    static Result<Done> save(const SceneShapes& shapes, const std::string& path);
    static Result<SceneShapes> load_shapes(const std::string& path);
    static Result<Done> save(const SceneSnapshot& snapshot, const std::string& path, const std::string& key);
    static Result<SceneSnapshot> load_snapshot(const std::string& path, const std::string& key);

    // Whether a file begins as one of a snapshot, of a scene or of `rapid run --cache`, does.
    static bool is_snapshot(const std::string& path);
    // What such a file says of itself, as `rapid info` prints it. Error: the system's; a file that is of something
    // else, or damaged.
    static Result<SceneReport> describe_snapshot(const std::string& path);

    // ---- Runs.

    // keep_state and tell_points of the hooks are chosen by the run.
    static Result<SceneRun> make(std::string file, SceneOptions scene, SceneHooks hooks, RunOptions options,
                                 RunListener listener);
    // For a prepared run in `parts` parts: of each output the pattern of the whole, and that of the parts, with {part}.
    // Error: points that are coupled; pictures and films, which can't be put together; a name with {part}.
    static Result<std::vector<std::pair<std::string, std::string>>> merges(SceneRun& run, int parts);
    // For a program that is about to end, from any thread at any moment, but not from a listener: writes statistics and
    // profile of the frames so far. A call of the run does not return afterwards. Nothing where the run's thread does
    // not let go within a second, as when a listener does not return.
    static std::optional<Abandoned> abandon(SceneRun& run);

    // ---- Files that are asked for, and what a plan makes of them. The scene stays where it is; where a script had to
    // be stopped it is at its start afterwards, or is to be restarted.

    // Error: an extension that no format has, with the known ones; no pattern; no attributes behind a colon.
    static Result<OutputFormat> output_format(const std::string& output);
    static std::vector<OutputFormat> output_formats();  // all there are, in order of extension
    // The folders that a run writes to, that of its first output first; they are made where they are missing. Error:
    // one can't be made.
    static Result<std::vector<std::string>> output_folders(const FileOutputs& files);
    static Result<std::vector<std::string>> output_folders(const RunOptions& options);
    // As Scene::explain(), for these files: what they ask for is kept. Error: of an output, as SceneRun::prepare().
    static Result<SceneReport> explain_outputs(Scene& scene, const FileOutputs& files);
    // What one of two scenes keeps and the other does not, as `rapid explain --against` prints it.
    static Result<SceneReport> explain_difference(Scene& scene, const FileOutputs& files, Scene& other);
    // Bytes that the points of each create, and each node, keep after a frame, as a snapshot holds them: computes the
    // frames up to this one beside the scene. Error: a frame before the first one.
    static Result<SceneReport> explain_state(Scene& scene, const FileOutputs& files, std::int64_t frame);
    // What can be found without running a frame: a line for each parameter, and how many nodes are reached from which
    // outputs. Error: of an output, as SceneRun::prepare().
    static Result<std::string> check_outputs(Scene& scene, const FileOutputs& files);
    // A line for each stiff node, and for each shape that is too coarse for its points: tries out the first frame with
    // a few points. Error: what a kernel does wrong with one of these points; other errors are left to the run.
    static Result<std::string> advice_on(Scene& scene, const FileOutputs& files);
    // On one thread. Error: FailedFrame, of a frame that fails.
    static Result<SceneRaces> find_races(Scene& scene, const FileOutputs& files, RunFrames frames);
};

}  // namespace rapid
