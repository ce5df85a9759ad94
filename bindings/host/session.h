// A graph file that has been run: its graph, its parameters, and the scripts that its nodes call.
//
// The file runs once in the session's main state, in the restricted environment; worker threads get states of their own
// when they first run a kernel. A session is used from one thread; its kernels run in all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bindings/host/interruption.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "runtime/report/study.h"

namespace rapid {

// The sequence in which kernels go over the points. Any but Forward is for `rapid check --races`, on one thread.
struct KernelOrder {
    enum Sequence {
        Forward,    // in chunks, on all threads, each of which has a state of its own
        Reversed,   // one by one, from the last point to the first, in one state
        TwoStates,  // one by one, in two states by turns
    };
    Sequence sequence = Forward;
    std::string node;  // if not empty, of this node's kernel alone
};

struct Offers;  // offers.h

struct SessionOptions {
    std::map<std::string, std::string> set;            // NAME or NODE.PARAM, and the value
    double script_timeout = 600;                       // s in scripts, for each frame and for loading
    std::size_t script_memory = std::size_t{1} << 30;  // bytes of Lua memory for each state
    bool may_write = false;                            // whether levelset:write acts; in a run only
    bool quiet = false;                                // print says nothing
    bool keeps_state = false;                          // what a snapshot can't hold is refused, and code() is there
    KernelOrder kernel_order;
    // Of a study file: the knobs of the scene that becomes its graph. Empty: there is no graph, and only study() is
    // called.
    std::optional<Knobs> knobs;
    // Called from the watchdog's thread when a script overruns, with the message; it must not return to the script.
    std::function<void(const std::string& message)> on_timeout;
    // If set, told of each file before it is read, and of each place where a module or node was looked for.
    std::function<void(const std::filesystem::path& file)> on_read;
    // The graph as text, in place of the file's, whose name it has then in messages.
    std::optional<std::string> text;
    // Where modules and nodes in Lua are looked for: what find_module gives first, then the graph's folder, then these.
    std::vector<std::filesystem::path> paths;
    std::function<std::optional<std::string>(const std::string& name)> find_module;
    // If set, gives the path of a file that the scene names; empty: as usual.
    std::function<std::string(const std::string& path)> find_file;
    std::shared_ptr<const Offers> offers;  // of the program that embeds Rapid; may be null
    // If set, what scripts print goes there, not to standard output.
    std::function<void(const std::string& text)> on_print;
    // A script that overruns, or that interrupt() stops, is an Error; else on_timeout ends the process.
    bool interruptible = false;
    // With it, what stops its scripts, from the first line of the file on; null: one of its own, which interrupt()
    // asks.
    std::shared_ptr<Interruption> interruption;
    // If set, told of each trace that LuaJIT began to compile and gave up: "FILE:LINE: why". From any thread.
    // With it kernels go to that compiler, and are no programs of lanes.
    std::function<void(const std::string& message)> on_trace_abort;
    // If set, told of each kernel that is no program of lanes (lua/lanes.lua): "FILE:LINE: why". From any thread.
    std::function<void(const std::string& message)> on_no_lanes;
};

class ScriptHost;

class Session {
public:
    // Runs the file. Error: it can't be read; an error of Lua or Rapid in it, with file and line; an unknown or
    // ill-typed name in options.set, with the nearest.
    Session(const std::filesystem::path& file, SessionOptions options);
    ~Session();

    const Graph& graph() const;
    const Registry& registry() const;

    struct Parameter {
        std::string name, doc;
        Value value, fallback;
    };
    // In the order in which the file declares them.
    const std::vector<Parameter>& parameters() const;

    // From now on this is the thread that uses the session, between two calls of which it may change.
    void use_from_this_thread();

    // Stops the scripts that run now, in all threads, and all that would run later, with this error. From any thread;
    // in an interruptible session.
    void interrupt(const Error& why);
    bool is_interrupted() const;
    // With keeps_state, by file: a hash of each of its functions, and the line in which it begins; the body's first.
    // Equal for programs that do the same, whatever their comments and their lines.
    struct FunctionCode {
        int line;
        std::uint64_t hash;
    };
    const std::map<std::string, std::vector<FunctionCode>>& code() const;

    // Of the file's makers, such as that a mesh has holes, since they were last taken: functions of the frame make
    // objects, too.
    std::vector<std::string> take_warnings();

    // Of a study file: its description; its closed form, with ids from 0 in order, for a row of these knobs; and its
    // own measure of error, of points that are matched place by place. Error: what the script raised or returned.
    Study study() const;
    PointSet study_reference(const Frame& frame, const Knobs& knobs) const;
    double study_error(const PointSet& points, const PointSet& reference) const;

    // The node types that need no graph: the native ones and those of the shipped Lua nodes.
    static Registry all_node_types();

private:
    std::unique_ptr<ScriptHost> host_;
};

}  // namespace rapid
