// Rapid inside a program: a scene in Lua is opened, given parameters, advanced frame by frame, and its points are read
// without a copy. `docs/host.md` is the guide; rapid/rapid.h is the same for C and for other languages.
//
//   auto scene = rapid::Scene::open("first.lua");
//   if (!scene) return fail(scene.error().text());
//   auto frame = scene->advance_to(48);
//   if (!frame) return fail(frame.error().text());
//   auto P = frame->column("P");
//
// Errors are values: no function of this header throws, but Result::value() on request. Lengths are in metres, times in
// seconds, angles in degrees, as in scenes.
//
// Threads. A Scene is used by one thread at a time, which may be another one at each call; a second call meanwhile,
// from another thread or from a callback, is an error and changes nothing. cancel() is for any thread at any time.
// Different scenes run at once on different threads. Frames and snapshots are read, copied and released from any
// thread.
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

// What went wrong. The numbers are those of the statuses of rapid.h.
struct SceneError {
    // What is to be done about it.
    enum Kind {
        WrongCall = 1,    // an argument, or a call at the wrong time; nothing has changed
        WrongScene = 2,   // found before the first frame: Lua, a node's argument, a missing file
        FailedFrame = 3,  // found while a frame was computed
        Cancelled = 4,    // by cancel(), or by the progress callback
        TooLong = 5,      // a script took longer than SceneOptions::script_seconds
        OutOfMemory = 6,  // the system's, or a limit's
        Busy = 7,         // the scene is in another call
        Unexpected = 8,   // of a library or a callback; the text is all that is known
    };
    Kind kind = Unexpected;  // of the fault
    std::string message;     // what is wrong; what would be right
    std::string file;        // of the scene or module, as it was named; empty where there is none
    int line = 0;            // from 1; 0 where there is none
    std::string node;        // of the scene; empty where there is none
    // The calls of the script in which it was raised, a line each, the innermost first; empty if it was in no script.
    std::string script_stack;

    // FILE:LINE: node "NAME": MESSAGE, of what is known.
    std::string text() const;
};

// What Result::value() throws.
class SceneException : public std::runtime_error {
public:
    explicit SceneException(SceneError error) : std::runtime_error(error.text()), error_(std::move(error)) {}

    const SceneError& error() const { return error_; }

private:
    SceneError error_;
};

// A T or the error that kept it from being made.
template <class T>
class [[nodiscard]] Result {
public:
    // Of a value, or of an error.
    Result(T value) : held_(std::move(value)) {}
    Result(SceneError error) : held_(std::move(error)) {}

    // Whether there is a value.
    explicit operator bool() const { return held_.index() == 0; }
    // Only where there is a value.
    T& operator*() { return std::get<0>(held_); }
    const T& operator*() const { return std::get<0>(held_); }
    T* operator->() { return &std::get<0>(held_); }
    const T* operator->() const { return &std::get<0>(held_); }
    // Only where there is none.
    const SceneError& error() const { return std::get<1>(held_); }

    // For programs that prefer exceptions: throws a SceneException if there is no value.
    T& value() &
    {
        throw_error();
        return **this;
    }
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

// The value of what is only done.
struct Done {};

// A number, a boolean, a text or three numbers.
using SceneValue = std::variant<double, bool, std::string, std::array<double, 3>>;

// A rapid.param of the scene.
struct SceneParameter {
    std::string name, doc;  // as the scene gives them
    SceneValue value;       // that the scene was run with
    SceneValue fallback;    // its default, of the same type
};

// A parameter of a node type.
struct NodeParameter {
    std::string name;       // in the table of arguments
    std::string type;       // as `rapid nodes` shows it: "number", "vec3", "shape"
    std::string unit;       // "m/s", "deg"; empty: none
    std::string doc;        // a sentence
    std::string fallback;   // the default as Lua text; empty: none
    bool required = false;  // whether a scene must give it
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

// The values of one attribute, or the members of a group (UInt8, 0 or 1 a point). The memory belongs to the frame: it
// stays valid and unchanged until the frame and all its copies are released.
//
// Layout: shape [count, components], packed within a point; the points are `stride` bytes apart. stride is 0 where all
// points share one value, which is held once; SceneFrame::expanded() gives those an array, too.
struct SceneColumn {
    std::string_view name;                // belongs to the frame
    ColumnType type = ColumnType::Float;  // of a value
    std::size_t count = 0;                // of points
    std::size_t components = 1;           // 3 of Vec3 (x y z), 4 of Quat (x y z w)
    std::size_t stride = 0;               // bytes
    const void* data = nullptr;  // of float, std::int32_t, std::int64_t, std::uint8_t; of String std::uint32_t, tokens

    // The values of point i. T: the type of a component, which must agree with `type`.
    template <class T>
    const T* at(std::size_t i) const
    {
        return reinterpret_cast<const T*>(static_cast<const char*>(data) + i * stride);
    }
};

// The figures of a frame, those of `rapid run --stats` that are asked for most; statistics_json() has all of them.
struct FrameStatisticsSummary {
    std::uint64_t points = 0;                                   // of all outputs
    std::uint64_t born = 0, died = 0, collisions = 0;           // in this frame
    int substeps = 0;                                           // the most that a Solve took
    bool has_errors = false;                                    // whether the next three were estimated
    double error_p50 = 0, error_p95 = 0, error_max = 0;         // m, of positions, accumulated since birth
    double penetration_max = 0;                                 // m
    double constraint_residual_max = 0;                         // m
    double seconds = 0, script_seconds = 0, solve_seconds = 0;  // wall time: in all, and of parts
};

// What is told of something.
struct SceneReport {
    std::string text;  // for people: lines, as the command prints them
    std::string json;  // the same for programs, in one line
};

// What is different in two frames.
struct FrameComparison {
    bool same = true;    // within the tolerance
    SceneReport report;  // as `rapid diff` prints it
};

// Of a picture: pixels, each edge from 1 to 16384.
struct PictureSize {
    int width = 640, height = 360;  // of the edges
};

// From where a picture is seen; what is left open is fitted.
struct PictureCamera {
    std::optional<std::array<double, 3>> position, target;  // m
    std::optional<double> fov;  // degrees, from the lower to the upper edge; above 0 and below 180
};

class SceneShapes;  // shapes.h

// A computed frame: columns by name, shared with the scene until the scene writes them (copy-on-write). Copying one
// copies a pointer. A frame that is released before the next advance() spares the scene a copy of the columns that it
// changes.
class SceneFrame {
public:
    std::int64_t number() const;  // of the frame
    double time() const;          // s since the start of the output's simulation
    double fps() const;           // of the output's simulation

    // The names of the scene's outputs, in order; a scene that returns one node has "main". All functions below speak
    // of the output that is chosen: at first "main", or the first one where there is no "main".
    std::vector<std::string> outputs() const;
    // The same frame with another output chosen. Error: no such output, with the nearest name.
    Result<SceneFrame> output(std::string_view name) const;

    std::size_t size() const;                  // of points
    std::vector<std::string> columns() const;  // names, in order
    std::vector<std::string> groups() const;   // names, in order
    // Takes some nanoseconds, however many points there are. Error: no such column, with the nearest name.
    Result<SceneColumn> column(std::string_view name) const;
    Result<SceneColumn> group(std::string_view name) const;
    // The text of a token, a value of a String column: equal texts have equal ones in a process, in no order, and 0 is
    // the empty text. Valid as long as the process is. Error: no text has the token.
    static Result<std::string_view> text_of(std::uint32_t token);
    // For points that the program offers. Error: text that is no UTF-8.
    static Result<std::uint32_t> token_of(std::string_view text);
    // As column(), where `stride` is never 0: values that all points share are written out once, and kept by the frame.
    Result<SceneColumn> expanded(std::string_view name) const;
    // Of an id that no point has.
    static constexpr std::uint32_t no_place = UINT32_MAX;
    // Where the points of these ids are in the columns: for many ids at once much faster than for one after the other.
    Result<std::vector<std::uint32_t>> places(const std::vector<std::int64_t>& ids) const;

    std::vector<std::string> details() const;  // names of values of the whole set (:detail), in order
    // Such a value: a number or three. Error: no such detail value, with the nearest name.
    Result<SceneValue> detail(std::string_view name) const;

    // The figures that are asked for most.
    FrameStatisticsSummary statistics() const;
    // The frame's object in the file of `rapid run --stats` (docs/cli.md), as one line of JSON.
    std::string statistics_json() const;
    // Where its time went: a list in one line of JSON, a member for each pass over the points, in order: "nodes" (those
    // that went over them together), "stage" ("graph", "script", "solve"), "begin" and "seconds" (s, since the frame's
    // beginning), "points" and "bytes" of the result.
    std::string profile_json() const;
    // What nodes warned of in this frame.
    std::vector<std::string> warnings() const;

    // Writes the points to a file of a format that Rapid knows, by the extension; missing folders are made. The file
    // has its name when it is complete. Error: an unknown extension, with the known ones; the system's.
    Result<Done> write(const std::string& path) const;
    // The points of such a file as a frame with the one output "main", of number and time 0; of what the file holds
    // besides there are warnings(). Error: an extension that is unknown, or only written; the system's; a file that is
    // damaged.
    static Result<SceneFrame> read(const std::string& path);

    // The bytes of a .png of the points among these shapes, as their `:picture` nodes say. From any thread. Error: a
    // size or an angle of view that no picture has.
    Result<std::string> picture(const SceneShapes& shapes, const PictureCamera& camera = {},
                                PictureSize size = {}) const;

    // How many points there are, their bounds, the range of each attribute, the groups: as `rapid info` prints it.
    Result<SceneReport> describe() const;
    // Compares the points of this frame, called A, with those of another one, B, by their ids. Positions are the same
    // within `tolerance` times the diagonal of the bounds of both, other floats relatively, all else when it is equal.
    // Error: a tolerance that is negative or no number.
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

// All that the next frames depend on. Copying one copies a pointer; its columns are shared with the scene until either
// side writes them.
class SceneSnapshot {
public:
    std::int64_t frame() const;  // the last one computed before it was taken
    std::size_t size() const;    // bytes

    // Writes it to a file, which has its name when it is complete; missing folders are made. Error: the system's.
    Result<Done> write(const std::string& path) const;
    // Error: the system's; a file that is of something else, damaged, of another build of Rapid, or of a run of the
    // command.
    static Result<SceneSnapshot> read(const std::string& path);

private:
    friend class Scene;
    friend struct SceneInside;  // of Rapid itself
    struct Data;
    explicit SceneSnapshot(std::shared_ptr<const Data> data);
    std::shared_ptr<const Data> data_;
};

// Of a text for SceneOptions::log: what scripts print, and what Rapid warns of.
enum class LogLevel { Print = 0, Warning = 1 };

// How a scene is opened and run.
struct SceneOptions {
    // Values of the scene's parameters by name, and of its nodes' by NODE.PARAM ("solve.substeps").
    std::vector<std::pair<std::string, SceneValue>> set;
    std::optional<std::uint64_t> seed;  // replaces the seed of each create, but no rapid.param "seed"

    // Folders where modules and nodes in Lua are looked for, after that of the scene and before those of RAPID_PATH.
    std::vector<std::string> paths;
    // Asked first for the text of a module or of a node in Lua; nothing: it is looked for in the folders.
    std::function<std::optional<std::string>(const std::string& name)> find_module;
    // Asked for the path of each file that the scene reads or writes, as the scene names it; an empty path: as usual,
    // relative to the scene's folder.
    std::function<std::string(const std::string& path)> find_file;

    // What the scene takes as rapid.host "NAME"; and by the setting "host:NAME" for a node's parameter, as
    // {"collide2.shape", "host:floor"}.
    std::vector<std::pair<std::string, HostObject>> objects;
    // Types of nodes besides Rapid's own.
    std::vector<HostNode> nodes;
    // Finds callbacks that write past the ends of their arrays.
    bool guard_callbacks = false;

    // Told of what scripts print and of warnings; where it is not set, prints are dropped and warnings are in
    // Scene::warnings() and SceneFrame::warnings() alone. On the thread of the call.
    std::function<void(LogLevel level, const std::string& text)> log;
    // Told by advance_to() of each frame that is done; false ends it with the error Cancelled behind that frame.
    std::function<bool(std::int64_t frame, std::int64_t last)> progress;

    int threads = 0;                                   // 0: those of the caller's TBB arena; n: n of its own
    double script_seconds = 600;                       // that scripts may take, for each frame and for opening
    std::size_t script_memory = std::size_t{1} << 30;  // bytes of Lua memory, for each thread
    std::uint64_t memory = 0;                          // bytes that the process may have in all; 0: what is free
    bool estimate_errors = true;                       // false: none in the statistics; frames may take half the time
    bool keep_all = false;                             // leaves no attribute out, to the same bits
};

// How Scene::graph() gives a graph.
enum class GraphForm {
    Dot,   // in Graphviz's language
    Svg,   // a picture
    Json,  // nodes and edges with their places: an object, as `rapid graph -o FILE.json` writes it (docs/cli.md)
};

// Of Scene::trace().
struct TraceOptions {
    std::vector<std::int64_t> ids;                // of the points
    std::string create;                           // the name of the node that makes them; empty: each
    std::int64_t first = 1, last = 48, step = 1;  // the frames that are told
};

// The lives of points: births, what each node changed, forces, contacts, deaths and why.
struct SceneTrace {
    SceneReport lives;                 // of those that were born, as `rapid trace` prints it; the JSON is a list
    std::vector<std::int64_t> unborn;  // ids that no point had up to the last frame
    std::optional<SceneError> fault;   // why a frame before the last one failed; the lives are told until then
};

// A scene in Lua that is run frame by frame.
class Scene {
public:
    // Opens the scene of a file, or of a text with a name for messages; modules are looked for beside the file, or in
    // the folder of the name. Runs the file, plans the run, computes no frame. Errors: WrongScene; TooLong;
    // OutOfMemory.
    static Result<Scene> open(const std::string& file, SceneOptions options = {});
    static Result<Scene> open_text(const std::string& name, const std::string& text, SceneOptions options = {});

    // What is moved from may only be assigned to, or end.
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;
    ~Scene();  // not while a call of another thread is running

    // Loads types of nodes from a library that is built against the runtime's headers (docs/extending.md), for scenes
    // that are opened later, in the whole process. Not while another thread opens a scene. Error: a file that can't be
    // read or loaded, is no plugin, was built with other headers, or has a node of a name that is taken.
    static Result<Done> load_plugin(const std::string& file);

    // In the order in which the scene declares them.
    const std::vector<SceneParameter>& parameters() const;
    const std::vector<SceneNode>& nodes() const;
    // Frames a second of the first create of the plan; SceneFrame::fps() is that of an output.
    double fps() const;
    // All types that a scene of this program may use: native ones, Rapid's own in Lua, the scene's, in order of name.
    Result<std::vector<SceneNodeType>> node_types();
    // Of opening: meshes with holes, nodes that no output reaches.
    const std::vector<std::string>& warnings() const;

    // Gives parameters values, as SceneOptions::set, runs the scene's file again, and goes to the start. After an error
    // the scene is as it was.
    Result<Done> set(const std::vector<std::pair<std::string, SceneValue>>& values);
    Result<Done> set(const std::string& name, SceneValue value);

    // Replaces or adds an object. Functions of the frame that say rapid.host "NAME" get it from the next frame on, all
    // else when the scene's file is run again (set()). Error: WrongCall, with the array that is missing or wrong.
    Result<Done> offer(const std::string& name, const HostObject& object);

    std::int64_t first_frame() const;  // of the scene
    std::int64_t next_frame() const;   // that advance() computes

    // Computes the next frame. After an error the scene has no next frame until restart(), restore() or set().
    Result<SceneFrame> advance();
    // Computes frames up to this one and returns it. Error: WrongCall where the frame has been computed already.
    Result<SceneFrame> advance_to(std::int64_t frame);

    // Goes back to the start.
    Result<Done> restart();
    // After at least one frame. The frames behind restore() are to the bit those behind save(), in this scene or in
    // another one of the same file. Error of restore(): a snapshot of another graph.
    Result<SceneSnapshot> save();
    Result<Done> restore(const SceneSnapshot& snapshot);

    // Ends what is being computed (frames, also of trace() and points_behind(); arguments, shapes), or else what is
    // next, with the error Cancelled: in a frame at the next chunk of points or sub-step, and at once in a script. From
    // any thread. restart(), restore() and set() forget it.
    void cancel();

    // What the plan of the scene keeps and leaves out, and why: nodes, attributes with their bytes a point, functions
    // of the frame, stages of Solve, as `rapid explain` prints it.
    Result<SceneReport> explain();
    // The graph of the scene, with what is left out and why. Error of Svg and Json: Graphviz's program `dot`, which
    // lays them out, is not there.
    Result<std::string> graph(GraphForm form);
    // Tells of points by their ids: goes to the start, and computes the frames up to the last one beside the scene,
    // which then is at its start; where a script had to be stopped it is to be restarted. Error: no ids; no such
    // create, with the nearest name; a last frame before the first one.
    Result<SceneTrace> trace(const TraceOptions& options);

    // The points as they leave a node in a frame, as one with the only output of the node's name: goes to the start,
    // and computes the frames up to this one beside the scene, as trace(). Error: no such node, with the nearest name;
    // one that is left out; a frame before the first one.
    Result<SceneFrame> points_behind(const std::string& node, std::int64_t frame);
    // What points collide with, and are born from, in a frame, which need not be computed; how its pictures look.
    Result<SceneShapes> shapes(std::int64_t frame);
    // The bytes of a .png of a frame of this scene, with its shapes; the camera is fitted to the frame unless the scene
    // has one.
    Result<std::string> picture(const SceneFrame& frame, PictureSize size = {});

private:
    friend struct SceneInside;  // of Rapid itself
    struct Impl;
    explicit Scene(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid
