// Rapid inside a program: a scene in Lua is opened, given parameters, advanced frame by frame, and its points are read
// without a copy. `docs/host.md` is the guide; rapid/rapid.h is the same for C and other languages.
//
//   auto scene = rapid::Scene::open("first.lua");
//   if (!scene) return fail(scene.error().text());
//   auto frame = scene->advance_to(48);
//   if (!frame) return fail(frame.error().text());
//   auto P = frame->column("P");
//
// Errors are values: no function of this header throws, except Result::value() on request. Lengths are in metres, times
// in seconds, angles in degrees, as in scenes.
//
// Threads. A Scene is used by one thread at a time, which may be another one at each call; a second call meanwhile,
// from another thread or from a callback, is an error and changes nothing. cancel() may be called from any thread at
// any time. Different scenes run concurrently on different threads. Frames and snapshots are read, copied and released
// from any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "offers.h"

namespace rapid {

std::string_view version();  // "1.0.0", of the library

// An error. The numbers are the statuses of rapid.h.
struct SceneError {
    // Kinds of errors, by the action that they require.
    enum Kind {
        WrongCall = 1,    // an argument, or a call at the wrong time; nothing has changed
        WrongScene = 2,   // found before the first frame: Lua, a node's argument, a missing file
        FailedFrame = 3,  // found while a frame was computed
        Cancelled = 4,    // by cancel(), or by the progress callback
        TooLong = 5,      // a script took longer than SceneOptions::script_seconds
        OutOfMemory = 6,  // the system has no more, or a limit was reached
        Busy = 7,         // the scene is in another call
        Unexpected = 8,   // from a library or a callback; the text is all that is known
    };
    Kind kind = Unexpected;  // of the fault
    std::string message;     // the fault and the remedy
    std::string file;        // of the scene or module, as it was named; empty if there is none
    int line = 0;            // from 1; 0 if there is none
    std::string node;        // of the scene; empty if there is none
    // The call stack of the script that raised it, one line per call, innermost first; empty if no script did.
    std::string script_stack;

    // Returns FILE:LINE: node "NAME": MESSAGE, as far as known.
    std::string text() const;
};

// The exception of Result::value().
class SceneException : public std::runtime_error {
public:
    // Takes the text of the error as what().
    explicit SceneException(SceneError error) : std::runtime_error(error.text()), error_(std::move(error)) {}

    // The error that was thrown.
    const SceneError& error() const { return error_; }

private:
    SceneError error_;
};

// A T or the error that prevented it.
template <class T>
class [[nodiscard]] Result {
public:
    // Holds either a value or an error.
    Result(T value) : held_(std::move(value)) {}
    Result(SceneError error) : held_(std::move(error)) {}

    // Returns true if there is a value.
    explicit operator bool() const { return held_.index() == 0; }
    // Precondition: the result holds a value.
    T& operator*() { return std::get<0>(held_); }
    const T& operator*() const { return std::get<0>(held_); }
    T* operator->() { return &std::get<0>(held_); }
    const T* operator->() const { return &std::get<0>(held_); }
    // Precondition: the result holds an error.
    const SceneError& error() const { return std::get<1>(held_); }

    // For programs that prefer exceptions: throws a SceneException if there is no value.
    T& value() &
    {
        throw_error();
        return **this;
    }
    // The same for a temporary, whose value is moved out.
    T value() &&
    {
        throw_error();
        return std::move(**this);
    }

private:
    void throw_error() const
    {
        if (!*this) throw SceneException(error());
    }

    std::variant<T, SceneError> held_;
};

// The value type of operations that return nothing.
struct Done {};

// A number, a boolean, a string or three numbers.
using SceneValue = std::variant<double, bool, std::string, std::array<double, 3>>;

// A rapid.param of the scene.
struct SceneParameter {
    std::string name, doc;  // as written in the scene
    SceneValue value;       // with which the scene was run
    SceneValue fallback;    // its default, of the same type
};

// A parameter of a node type.
struct NodeParameter {
    std::string name;       // in the table of arguments
    std::string type;       // as `rapid nodes` shows it: "number", "vec3", "shape"
    std::string unit;       // "m/s", "deg"; empty: none
    std::string doc;        // a sentence
    std::string fallback;   // default as Lua text; empty: none
    bool required = false;  // true if a scene must set it
};

// A type of node that scenes may use.
struct SceneNodeType {
    std::string name, doc;                  // `:NAME { ... }`, and a sentence
    std::vector<NodeParameter> parameters;  // in the order of the declaration
};

// A node of the scene.
struct SceneNode {
    std::string name, type;  // the name is the type's with a number, unless the scene gives one
    std::string file;        // where the scene makes it
    int line = 0;            // of the file, from 1
};

// The values of one attribute, or the members of a group (UInt8, 0 or 1 per point). The memory belongs to the frame: it
// stays valid and unchanged until the frame and all its copies are released.
//
// Layout: shape [count, components], packed within a point; the points are `stride` bytes apart. stride is 0 if all
// points share one value, which is stored once; SceneFrame::expanded() writes it out.
struct SceneColumn {
    std::string_view name;                // belongs to the frame
    ColumnType type = ColumnType::Float;  // of a value
    std::size_t count = 0;                // of points
    std::size_t components = 1;           // 3 for Vec3 (x y z), 4 for Quat (x y z w)
    std::size_t stride = 0;               // bytes
    const void* data = nullptr;  // float, std::int32_t, std::int64_t, std::uint8_t; for String std::uint32_t, tokens

    // Returns the components of point i. T: the type of a component, which must agree with `type`.
    template <class T>
    const T* at(std::size_t i) const
    {
        return reinterpret_cast<const T*>(static_cast<const char*>(data) + i * stride);
    }
};

// The most requested statistics of a frame, from `rapid run --stats`; statistics_json() has all of them.
struct FrameStatisticsSummary {
    std::uint64_t points = 0;                                   // of all outputs
    std::uint64_t born = 0, died = 0, collisions = 0;           // in this frame
    int substeps = 0;                                           // maximum of all Solve nodes
    bool has_errors = false;                                    // true if the next three were estimated
    double error_p50 = 0, error_p95 = 0, error_max = 0;         // m, of positions, accumulated since birth
    double penetration_max = 0;                                 // m
    double constraint_residual_max = 0;                         // m
    double seconds = 0, script_seconds = 0, solve_seconds = 0;  // wall time: total, and of parts
};

// A report in two forms.
struct SceneReport {
    std::string text;  // for people: lines, as the command prints them
    std::string json;  // the same for programs, in one line
};

// Differences between two frames.
struct FrameComparison {
    bool same = true;    // within the tolerance
    SceneReport report;  // as printed by `rapid diff`
};

// Size of a picture in pixels; each edge is from 1 to 16384.
struct PictureSize {
    int width = 640, height = 360;  // of the edges
};

// The camera of a picture. Missing values are fitted.
struct PictureCamera {
    std::optional<std::array<double, 3>> position, target;  // m
    std::optional<double> fov;  // degrees, from the lower to the upper edge; above 0 and below 180
};

class SceneShapes;  // shapes.h

// A computed frame: columns by name, shared with the scene until the scene writes them (copy-on-write). Copies are
// cheap (a shared pointer). Releasing a frame before the next advance() saves the scene a copy of the columns that it
// changes.
class SceneFrame {
public:
    std::int64_t number() const;  // of the frame
    double time() const;          // s since the start of the output's simulation
    double fps() const;           // of the output's simulation

    // Returns the names of the scene's outputs, in order; a scene that returns one node has "main". All functions below
    // apply to the selected output: initially "main", or the first one if there is no "main".
    std::vector<std::string> outputs() const;
    // Returns the same frame with another output selected. Fails, with the nearest name, if there is no such output.
    Result<SceneFrame> output(std::string_view name) const;

    std::size_t size() const;                  // of points
    std::vector<std::string> columns() const;  // names, in order
    std::vector<std::string> groups() const;   // names, in order
    // Takes some nanoseconds for any number of points. Fails, with the nearest name, if there is no such column.
    Result<SceneColumn> column(std::string_view name) const;
    Result<SceneColumn> group(std::string_view name) const;
    // Returns the string of a token, a value of a String column. In a process, equal strings have equal tokens, in no
    // order, and 0 is the empty string. Valid as long as the process. Fails if no string has the token.
    static Result<std::string_view> text_of(std::uint32_t token);
    // Returns the token of a string, for points that the program offers. Fails if the text is not UTF-8.
    static Result<std::uint32_t> token_of(std::string_view text);
    // Does the same as column(), but writes out a value that all points share, so that `stride` is never 0. The frame
    // owns it.
    Result<SceneColumn> expanded(std::string_view name) const;
    // The index for an id that no point has.
    static constexpr std::uint32_t no_index = UINT32_MAX;
    // Returns the indices of the points with these ids in the columns. One call with many ids is much faster than many
    // calls.
    Result<std::vector<std::uint32_t>> indices(const std::vector<std::int64_t>& ids) const;

    std::vector<std::string> details() const;  // names of values of the whole set (:detail), in order
    // Returns such a value: a number or three. Fails, with the nearest name, if there is no such detail value.
    Result<SceneValue> detail(std::string_view name) const;

    // Returns the most requested statistics.
    FrameStatisticsSummary statistics() const;
    // Returns the frame's object in the file of `rapid run --stats` (docs/cli.md), as one line of JSON.
    std::string statistics_json() const;
    // Returns the time of each pass over the points: a list in one line of JSON, in order, with "nodes" (those that
    // processed the points together), "stage" ("graph", "script", "solve"), "begin" and "seconds" (s, since the frame's
    // beginning), "points" and "bytes" of the result.
    std::string profile_json() const;
    // Returns the warnings of nodes in this frame.
    std::vector<std::string> warnings() const;

    // Writes the points to a file in a format that Rapid knows, by the extension; missing folders are made. The file
    // gets its name when it is complete. Fails with the system's error, or if the extension is unknown; the message
    // lists the known ones.
    Result<Done> write(const std::string& path) const;
    // Reads the points of such a file as a frame with the one output "main", with number and time 0. warnings() lists
    // the file's other contents. Fails with the system's error, or if the extension is unknown or write-only, or the
    // file damaged.
    static Result<SceneFrame> read(const std::string& path);

    // Returns the bytes of a .png of the points with these shapes, in the style of their `:picture` nodes. Callable
    // from any thread. Fails if the size or angle of view is impossible.
    Result<std::string> picture(const SceneShapes& shapes, const PictureCamera& camera = {},
                                PictureSize size = {}) const;

    // Describes the number of points, their bounds, the range of each attribute, and the groups, as printed by `rapid
    // info`.
    Result<SceneReport> describe() const;
    // Compares the points of this frame, called A, with those of another one, B, by id. Positions are the same within
    // `tolerance` times the diagonal of the bounds of both, other floats relatively, and everything else if it is
    // equal. Fails if the tolerance is negative or NaN.
    Result<FrameComparison> compare(const SceneFrame& other, double tolerance = 1e-6) const;

private:
    friend class Scene;
    friend class SceneFilm;
    friend struct SceneInside;  // of Rapid itself
    struct Data;
    explicit SceneFrame(std::shared_ptr<const Data> data, std::string output);
    std::shared_ptr<const Data> data_;
    std::string output_;
};

// The complete state from which later frames follow. Copies are cheap (a shared pointer); its columns are shared with
// the scene until either side writes them.
class SceneSnapshot {
public:
    std::int64_t frame() const;  // the last one computed before it was taken
    std::size_t size() const;    // bytes

    // Writes it to a file, which gets its name when it is complete; missing folders are made. Fails with the system's
    // error.
    Result<Done> write(const std::string& path) const;
    // Reads a file. Fails with the system's error, or if the file is of another kind, damaged, of another build of
    // Rapid, or of a run of the command.
    static Result<SceneSnapshot> read(const std::string& path);

private:
    friend class Scene;
    friend struct SceneInside;  // of Rapid itself
    struct Data;
    explicit SceneSnapshot(std::shared_ptr<const Data> data);
    std::shared_ptr<const Data> data_;
};

// Levels of a text for SceneOptions::log: output of scripts, and Rapid's warnings.
enum class LogLevel { Print = 0, Warning = 1 };

// Options for opening and running a scene.
struct SceneOptions {
    // Values of the scene's parameters by name, and of its nodes' by NODE.PARAM ("solve.substeps").
    std::vector<std::pair<std::string, SceneValue>> set;
    std::optional<std::uint64_t> seed;  // replaces the seed of each create node, but no rapid.param "seed"

    // Folders searched for modules and nodes in Lua, after that of the scene and before those of RAPID_PATH.
    std::vector<std::string> paths;
    // Returns the text of a Lua module or node. Called first; nothing means that the folders are searched.
    std::function<std::optional<std::string>(const std::string& name)> find_module;
    // Returns the path of each file that the scene reads or writes, given its name in the scene; an empty path means
    // the usual one, relative to the scene's folder.
    std::function<std::string(const std::string& path)> find_file;

    // Objects that the scene takes as rapid.host "NAME", or through the setting "host:NAME" for a node's parameter, as
    // in {"collide2.shape", "host:floor"}.
    std::vector<std::pair<std::string, HostObject>> objects;
    // Node types in addition to Rapid's own.
    std::vector<HostNode> nodes;
    // Detects callbacks that write past the ends of their arrays.
    bool guard_callbacks = false;

    // Receives the output of scripts, and warnings, on the thread of the call. If it is not set, output is dropped, and
    // warnings are only in Scene::warnings() and SceneFrame::warnings().
    std::function<void(LogLevel level, const std::string& text)> log;
    // Called by advance_to() after each frame; false ends it after that frame with the error Cancelled.
    std::function<bool(std::int64_t frame, std::int64_t last)> progress;

    int threads = 0;                                   // 0: those of the caller's TBB arena; n: n threads of its own
    double script_seconds = 600;                       // limit for scripts, for each frame and for opening
    std::size_t script_memory = std::size_t{1} << 30;  // bytes of Lua memory, for each thread
    std::uint64_t memory = 0;                          // bytes for the whole process; 0: the free memory
    bool estimate_errors = true;                       // false: no estimates; frames may take half the time
    bool keep_all = false;                             // prunes no attribute; the results are bit-identical
};

// Forms of Scene::graph().
enum class GraphForm {
    Dot,   // in Graphviz's language
    Svg,   // a picture
    Json,  // nodes and edges with their positions: an object, as written by `rapid graph -o FILE.json` (docs/cli.md)
};

// Options of Scene::trace().
struct TraceOptions {
    std::vector<std::int64_t> ids;                // of the points
    std::string create;                           // the name of the node that makes them; empty: each
    std::int64_t first = 1, last = 48, step = 1;  // the frames to report
};

// The lives of points: births, changes by each node, forces, contacts, deaths and their causes.
struct SceneTrace {
    SceneReport lives;                 // of the points that were born, as in `rapid trace`; the JSON is a list
    std::vector<std::int64_t> unborn;  // ids that no point had up to the last frame
    std::optional<SceneError> fault;   // why a frame before the last one failed; the lives end there
};

// A scene in Lua that is run frame by frame.
class Scene {
public:
    // Opens the scene of a file, or of a text with a name for messages; modules are searched next to the file, or in
    // the folder of the name. Runs the file and plans the run, but computes no frame. Fails with WrongScene, TooLong or
    // OutOfMemory.
    static Result<Scene> open(const std::string& file, SceneOptions options = {});
    static Result<Scene> open_text(const std::string& name, const std::string& text, SceneOptions options = {});

    // A moved-from scene may only be assigned to or destroyed.
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;
    ~Scene();  // not while a call of another thread is running

    // Loads node types from a library built against the runtime's headers (docs/extending.md), for scenes opened later
    // in the whole process. No other thread may open a scene meanwhile. Fails if the file cannot be read or loaded, is
    // not a plugin, was built with other headers, or has a node whose name is taken.
    static Result<Done> load_plugin(const std::string& file);

    // Both are in the order in which the scene declares them.
    const std::vector<SceneParameter>& parameters() const;
    const std::vector<SceneNode>& nodes() const;
    // Returns the frame rate of the plan's first create node; SceneFrame::fps() is that of an output.
    double fps() const;
    // Returns all node types that a scene of this program may use: native ones, Rapid's own in Lua and the scene's,
    // ordered by name.
    Result<std::vector<SceneNodeType>> node_types();
    // Returns the warnings of opening: meshes with holes, nodes that no output reaches.
    const std::vector<std::string>& warnings() const;

    // Sets parameters, like SceneOptions::set, runs the scene's file again, and returns to the start. After an error
    // the scene is unchanged.
    Result<Done> set(const std::vector<std::pair<std::string, SceneValue>>& values);
    Result<Done> set(const std::string& name, SceneValue value);

    // Replaces or adds an object. Functions of the frame that use rapid.host "NAME" get it from the next frame on,
    // everything else when the scene's file is run again (set()). Fails with WrongCall if an array is missing or wrong,
    // and names it.
    //
    // A mesh with as many positions and the same triangles as that of the frame before moves from there through the
    // frame, like the last file of a sequence of meshes: points are born along its path with its velocity, and as a
    // collider it sweeps points along. With other triangles it is at rest in this frame, with a warning. In a frame
    // without an offer, and after restart() and set(), the last mesh is at rest; a snapshot holds the last meshes.
    Result<Done> offer(const std::string& name, const HostObject& object);

    std::int64_t first_frame() const;  // of the scene
    std::int64_t next_frame() const;   // the one that advance() computes

    // Computes the next frame. After an error the scene has no next frame until restart(), restore() or set().
    Result<SceneFrame> advance();
    // Computes frames up to this one and returns it. Fails with WrongCall if the frame has been computed already.
    Result<SceneFrame> advance_to(std::int64_t frame);

    // Returns to the start.
    Result<Done> restart();
    // Save and restore the complete state, after at least one frame. Frames after restore() are bit-identical to those
    // after save(), in this scene or in another one of the same file. Error of restore(): a snapshot of another graph.
    Result<SceneSnapshot> save();
    Result<Done> restore(const SceneSnapshot& snapshot);

    // Ends the current computation (frames, also of trace() and points_after(); shapes), or else the next one, with
    // the error Cancelled: in a frame at the next chunk of points or substep, and at once in a script. Callable from
    // any thread. restart(), restore() and set() clear it.
    void cancel();

    // Explains what the plan of the scene keeps and prunes, and why: nodes, attributes with their bytes per point,
    // functions of the frame, stages of Solve, as printed by `rapid explain`.
    Result<SceneReport> explain();
    // Returns the graph of the scene, with pruned nodes and the reasons. Error of Svg and Json: Graphviz's program
    // `dot`, which lays them out, is missing.
    Result<std::string> graph(GraphForm form);
    // Traces points by id. Returns to the start and computes the frames up to the last one separately; afterwards the
    // scene is at its start. If a script had to be stopped, the scene must be restarted. Fails if there are no ids, if
    // there is no such create node (with the nearest name), or if the last frame is before the first one.
    Result<SceneTrace> trace(const TraceOptions& options);

    // Returns the points as they leave a node in a frame, as a frame whose only output has the node's name. Goes to the
    // start, and computes the frames up to this one separately, like trace(). Fails if there is no such node (with the
    // nearest name), if the plan omits it, or if the frame is before the first one.
    Result<SceneFrame> points_after(const std::string& node, std::int64_t frame);
    // Returns the shapes that points collide with or are born from in a frame, which need not be computed, and the look
    // of its pictures.
    Result<SceneShapes> shapes(std::int64_t frame);
    // Returns the bytes of a .png of a frame of this scene, with its shapes; the camera is fitted to the frame unless
    // the scene has one.
    Result<std::string> picture(const SceneFrame& frame, PictureSize size = {});

private:
    friend struct SceneInside;  // of Rapid itself
    struct Impl;
    explicit Scene(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid
