// Functions of scenes for Rapid's own programs and tests, in addition to include/rapid. They may change at any time.
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

// Hooks for a program that runs the scenes of others, in addition to SceneOptions.
struct SceneHooks {
    // Called with the error's text before a script that exceeds script_seconds is stopped, for a program that then
    // prefers to end: a process that may not read /proc/self/maps cannot stop compiled code. On a thread of Rapid's;
    // exceptions are dropped.
    std::function<void(const std::string& message)> on_script_timeout;
    // Called with each file before it is read, and with each path at which a module or a node was looked for. On any
    // thread; exceptions are dropped.
    std::function<void(const std::string& path)> on_file_read;
    // Called with the error's text if the memory limit cannot end a computation in time: the process exceeds it by a
    // sixteenth, or did not stop within a second. For a program that then prefers to end. On a thread of Rapid's.
    std::function<void(const std::string& message)> on_memory_exceeded;
    // True if a frame ends with an error when the process exceeds its memory limit. Not for a program that stores
    // frames for as long as it has room for them.
    bool watch_memory = true;
    // Called with the parameters as soon as the scene's file has run, before its plan is made, which may fail: for a
    // program whose user can then still change them. On the thread of the call; exceptions are dropped.
    std::function<void(const std::vector<SceneParameter>& parameters)> parameters;
    // Ends everything that the scene does, including opening and later calls, with the error Cancelled: like
    // Scene::cancel(), but permanently. std::stop_source::request_stop() may be called from any thread at any time.
    std::stop_token stop;
    // Refuses state that no snapshot can hold, such as a function of the frame that counts in a local variable: for
    // programs that continue in another process. fingerprint() requires it.
    bool keep_state = false;
    // The points after a solve have the columns "error" (m, if it is estimated), "substeps" and "asleep".
    bool per_point_diagnostics = false;
};

// An output of the scene, known before a frame is computed.
struct SceneOutput {
    std::string name;                  // "main" if the scene returns one node
    std::vector<std::string> creates;  // whose points it holds, by name; if there are several, ids are not theirs
};

// An attribute or a group that the points of a create node may have.
struct SceneAttribute {
    std::string name;       // a group has the prefix "group:"
    std::string create;     // the name of the node
    bool is_kept = false;   // true if the run keeps it; explain() has the reasons
    std::size_t bytes = 0;  // for each point, unless the points share one value
};

// A point as its create node identifies it.
struct PointOrigin {
    std::string create;   // the name of the node
    std::int64_t id = 0;  // under which it made the point
};

// The inputs that determine a scene's frames: scenes with equal fingerprints are bit-identical.
struct SceneFingerprint {
    // By name: the build of Rapid, plugins, parameters, seeds, nodes with their arguments and inputs, the code of all
    // functions, the contents of the files read on opening, the columns of SceneHooks::per_point_diagnostics. For
    // objects of the program only the names.
    std::map<std::string, std::string> parts;
    std::string hash;  // of the parts, without the line numbers of functions
};

// The documentation of a type of node.
struct NodeDocument {
    std::string name, doc;  // `:NAME { ... }`, and a sentence
    SceneReport page;       // parameters, and attributes read, written and made, as printed by `rapid nodes NAME`
};

// The documentation of the graph language.
struct NodeDocuments {
    std::vector<NodeDocument> types;    // native ones, Rapid's own in Lua, and those that are found; ordered by name
    std::vector<std::string> warnings;  // of files that define a node with a mistake in it
    std::string annotations;            // the graph language, for the Lua language server
};

// Graphviz's positions of a graph's nodes and edges, reused for the next run of the same graph.
struct GraphLayout {
    std::string graph;      // in Graphviz's language, without the parts that depend on values; empty: nothing is stored
    std::string positions;  // its layout, as written by `dot -Tjson`
};

// The format of a text of FileOutputs::outputs.
struct OutputFormat {
    std::string extension;  // ".vdb"
    bool is_film = false;   // one file of all frames, which ffmpeg writes
};
// The report of SceneInside::abandon().
struct Abandoned {
    std::vector<std::string> warnings;   // only counted until now
    std::vector<std::string> unwritten;  // as in RunOutcome
};

// The result of find_races(): whether frames are bit-identical in other orders of the points and in two Lua states.
struct SceneRaces {
    std::optional<SceneError> found;  // the first difference, with its node
    bool compared = false;            // true if there was a point in these frames
};

// Static functions, grouped by subject.
struct SceneInside {
    using Impl = Scene::Impl;
    static Impl& of(Scene& scene) { return *scene.impl_; }
    static const Impl& of(const Scene& scene) { return *scene.impl_; }

    // ---- Scenes.

    static Result<Scene> open(const std::string& file, SceneOptions options, SceneHooks hooks);
    // Loads from files and folders, a list separated by colons, like RAPID_PLUGIN_PATH.
    static Result<Done> load_plugins(const std::string& path);
    // Reuses the memory of up to this many released columns, and of 64 MiB at most, in the whole process; initially 4,
    // never reduced. For a program that stores the frames of a run until those of the next one replace them: all
    // columns of a frame are then released at once, and the system would have to clear each page again.
    static Result<Done> keep_spare_columns(std::size_t columns);
    // Returns documentation without a scene, for programs that help to write one: includes the nodes of Lua files in
    // the current folder and on RAPID_PATH.
    static Result<NodeDocuments> documents();
    // Returns the types that every scene of the process may use: native ones, those of plugins, and Rapid's own in Lua;
    // ordered by name.
    static Result<std::vector<SceneNodeType>> all_node_types();

    // Ordered by name.
    static const std::vector<SceneOutput>& outputs(const Scene& scene);
    // Returns those of all create nodes, in the order of the plan.
    static Result<std::vector<SceneAttribute>> attributes(Scene& scene);
    // Returns the arguments of the nodes in a frame, as strings, by node and parameter.
    static Result<std::map<std::string, std::map<std::string, std::string>>> arguments(Scene& scene,
                                                                                       std::int64_t frame);
    // Returns the graph like GraphForm::Json. `kept` is used if it belongs to this graph, and replaced otherwise.
    // nullptr: without positions, for a program that lays graphs out itself, or may not start another one. Fails if
    // `dot` is needed but missing.
    static Result<std::string> graph_json(Scene& scene, GraphLayout* kept);
    // Returns the points after each node that is evaluated in a frame, as frames with a single output of the node's
    // name. The scene stays where it is: the frames are computed separately, from a snapshot of this scene before the
    // frame, or from the first one. Those of the last requested frame are cached. Nodes whose result never changes are
    // not evaluated in each frame. Fails if the frame is before the first one, or if the snapshot belongs to another
    // graph or a later frame. If a script had to be stopped, the scene must be restarted.
    static Result<std::map<std::string, SceneFrame>> points_after_nodes(Scene& scene, std::int64_t frame,
                                                                        const std::optional<SceneSnapshot>& from = {});
    // Returns the create node of a point of a frame's output, and its id there. If the points of several are merged,
    // they are identified by position and velocity, from points_after_nodes(). Fails if the frame has no such output or
    // point, if several points share its position, or if nodes after its Solve have moved it.
    static Result<PointOrigin> origin(Scene& scene, const SceneFrame& frame, std::int64_t id,
                                      const std::optional<SceneSnapshot>& from = {});
    // The next three need SceneHooks::keep_state.
    static Result<SceneFingerprint> fingerprint(Scene& scene);
    // Returns a hash of the content of each file read since the last call, by name, without those read on opening.
    static Result<std::map<std::string, std::string>> take_inputs(Scene& scene);
    // Returns true if the files that another run of this scene returned from take_inputs() still have the same
    // contents.
    static Result<bool> are_unchanged(Scene& scene, const std::map<std::string, std::string>& inputs);

    // ---- Frames, snapshots and shapes.

    // Returns the bytes of the columns and groups of all outputs; those shared with other frames count in each.
    static std::size_t bytes(const SceneFrame& frame);
    // Returns only the points, without statistics, profile and warnings, for a program that stores many frames: errors
    // may be estimated for each point.
    static Result<SceneFrame> without_statistics(const SceneFrame& frame);
    // Returns the camera of a picture, with the values that `camera` leaves open. Fails like SceneFrame::picture().
    static Result<PictureCamera> camera(const SceneFrame& frame, const SceneShapes& shapes,
                                        const PictureCamera& camera = {}, PictureSize size = {});

    // Save bitwise to a file for the same build of Rapid, and load again. key: of the inputs, such as fingerprint(). A
    // frame's file has the points of all outputs; that of shapes everything but warnings. They fail with the system's
    // error; load also fails if the file is of another kind, damaged, or of another build or key.
    static Result<Done> save(const SceneFrame& frame, const std::string& path, const std::string& key);
    static Result<SceneFrame> load_frame(const std::string& path, const std::string& key);
    static Result<Done> save(const SceneShapes& shapes, const std::string& path);
    static Result<SceneShapes> load_shapes(const std::string& path);
    static Result<Done> save(const SceneSnapshot& snapshot, const std::string& path, const std::string& key);
    static Result<SceneSnapshot> load_snapshot(const std::string& path, const std::string& key);

    // Returns true if a file begins like one of a snapshot, of a scene or of `rapid run --cache`.
    static bool is_snapshot(const std::string& path);
    // Describes such a file, as printed by `rapid info`. Fails with the system's error, or if the file is of another
    // kind or damaged.
    static Result<SceneReport> describe_snapshot(const std::string& path);

    // ---- Runs.

    // The run sets keep_state and per_point_diagnostics of the hooks.
    static Result<SceneRun> make(std::string file, SceneOptions scene, SceneHooks hooks, RunOptions options,
                                 RunListener listener);
    // Returns, for a prepared run in `parts` parts, for each output the pattern of the whole and that of the parts,
    // with {part}. Fails if points are coupled, if an output is a picture or film, which cannot be merged, or if a name
    // contains {part}.
    static Result<std::vector<std::pair<std::string, std::string>>> merges(SceneRun& run, int parts);
    // For a program that is about to end. Callable from any thread at any time, but not from a listener: writes
    // statistics and profile of the frames so far. A call of the run does not return afterwards. Returns nothing if the
    // run's thread does not release its lock within a second, for example because a listener does not return.
    static std::optional<Abandoned> abandon(SceneRun& run);

    // ---- Requested files, and the parts of a plan that they need. The scene stays where it is; if a script had to be
    // stopped, it is at its start afterwards, or must be restarted.

    // Fails if the extension is unknown (the message lists the known ones), if the name is not a pattern, or if no
    // attributes follow a colon.
    static Result<OutputFormat> output_format(const std::string& output);
    static std::vector<OutputFormat> output_formats();  // all, ordered by extension
    // Returns the folders that a run writes to, that of its first output first; missing ones are made. Fails if one
    // cannot be made.
    static Result<std::vector<std::string>> output_folders(const FileOutputs& files);
    static Result<std::vector<std::string>> output_folders(const RunOptions& options);
    // Explains the plan like Scene::explain(), for these files: the attributes that they need are kept. Fails for wrong
    // outputs, like SceneRun::prepare().
    static Result<SceneReport> explain_outputs(Scene& scene, const FileOutputs& files);
    // Returns what one of two scenes keeps and the other does not, as printed by `rapid explain --against`.
    static Result<SceneReport> explain_difference(Scene& scene, const FileOutputs& files, Scene& other);
    // Returns the bytes that the points of each create node, and each node, hold after a frame, as in a snapshot:
    // computes the frames up to this one separately. Fails if the frame is before the first one.
    static Result<SceneReport> explain_state(Scene& scene, const FileOutputs& files, std::int64_t frame);
    // Checks everything that needs no frame: returns a line for each parameter, and the number of nodes that each
    // output reaches. Fails for wrong outputs, like SceneRun::prepare().
    static Result<std::string> check_outputs(Scene& scene, const FileOutputs& files);
    // Returns a line for each stiff node, and for each shape that is too coarse for its points, by trying the first
    // frame with a few points. Fails if a kernel fails for one of them; other errors are left to the run.
    static Result<std::string> advice_on(Scene& scene, const FileOutputs& files);
    // Runs on one thread. Fails with FailedFrame if a frame fails.
    static Result<SceneRaces> find_races(Scene& scene, const FileOutputs& files, RunFrames frames);
};

}  // namespace rapid
