// A graph file that has run: its graph, its parameters, and the scripts that its nodes call.
//
// The file runs once in the session's main state, in the restricted environment. Worker threads get their own states
// when they first run a kernel. A session is used from one thread; its kernels run on all threads.
#pragma once

#include <fmt/format.h>

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
#include "runtime/base/error.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "runtime/report/study.h"

namespace rapid {

// Objects and node types that an embedding program offers to a scene, which takes the objects as rapid.host "NAME".
struct Offers {
    // Change only between frames, on the scene's thread.
    std::map<std::string, ObjectPtr> objects;
    std::map<std::string, ObjectPtr> in_motion;  // replace them in functions of the frame
    std::vector<NodeType> node_types;

    // Returns the object for a function of the frame, which may be the state of a moving one (StateInMotion). Throws
    // Error as object() does.
    const ObjectPtr& object_of_frame(const std::string& name) const
    {
        const auto found = in_motion.find(name);
        return found != in_motion.end() ? found->second : object(name);
    }

    // Returns the object at rest. Throws Error if there is none of this name, and lists the existing names.
    const ObjectPtr& object(const std::string& name) const
    {
        if (const auto found = objects.find(name); found != objects.end()) return found->second;
        std::vector<std::string> names;
        for (const auto& entry : objects) names.push_back(entry.first);
        if (names.empty())
            throw Error(fmt::format("rapid.host \"{}\": the program that opened the scene offers no objects", name));
        const std::string nearest = did_you_mean(name, names);
        throw Error(fmt::format("rapid.host \"{}\": the program offers no such object{}", name,
                                nearest.empty() ? fmt::format("; it offers {}", fmt::join(names, ", ")) : nearest));
    }
};

// The sequence in which kernels visit the points. Sequences other than Forward are for `rapid check --races`, on one
// thread.
struct KernelOrder {
    enum Sequence {
        Forward,    // in chunks, on all threads, each with a state of its own
        Reversed,   // one by one, from the last point to the first, in one state
        TwoStates,  // one by one, alternating between two states
    };
    Sequence sequence = Forward;
    std::string node;  // if not empty, only this node's kernel
};

struct SessionOptions {
    std::map<std::string, std::string> set;            // NAME or NODE.PARAM, and the value
    double script_timeout = 600;                       // seconds of script, for each frame and for loading
    std::size_t script_memory = std::size_t{1} << 30;  // bytes of Lua memory for each state
    bool may_write = false;                            // true if levelset:write writes; in a run only
    bool quiet = false;                                // print does nothing
    bool keeps_state = false;                          // refuses functions that no snapshot can hold; code() works
    KernelOrder kernel_order;
    // The knobs of a study's scene, which becomes the graph. If they are empty there is no graph, and only study() may
    // be called.
    std::optional<Knobs> knobs;
    // Called from the watchdog's thread with the message when a script overruns. It must not return to the script.
    std::function<void(const std::string& message)> on_timeout;
    // If set, called with each file before it is read, and with each path at which a module or node was looked for.
    std::function<void(const std::filesystem::path& file)> on_read;
    // The graph's text, used instead of the file's. Messages still name the file.
    std::optional<std::string> text;
    // Search paths of Lua modules and nodes. find_module comes first, then the graph's folder, then these.
    std::vector<std::filesystem::path> paths;
    std::function<std::optional<std::string>(const std::string& name)> find_module;
    // If set, returns the path of a file that the scene names; an empty result means the usual path.
    std::function<std::string(const std::string& path)> find_file;
    std::shared_ptr<const Offers> offers;  // of the embedding program; may be null
    // If set, receives the output of scripts instead of standard output.
    std::function<void(const std::string& text)> on_print;
    // If true, a script that overruns, or that interrupt() stops, throws an error; otherwise on_timeout ends the
    // process.
    bool interruptible = false;
    // The interruption that stops its scripts, from the first line of the file on. Null: one of its own, used by
    // interrupt().
    std::shared_ptr<Interruption> interruption;
    // If set, called with each trace that LuaJIT began to compile and gave up, "FILE:LINE: why", from any thread.
    // Kernels then go to that compiler and are not turned into programs of lanes.
    std::function<void(const std::string& message)> on_trace_abort;
    // If set, called with each kernel that cannot be a program of lanes (lua/lanes.lua), "FILE:LINE: why", from any
    // thread.
    std::function<void(const std::string& message)> on_no_lanes;
};

class ScriptHost;

class Session {
public:
    // Runs the file. Throws Error if it cannot be read, if it has an error of Lua or Rapid (with file and line),
    // or if a name in options.set is unknown (with the nearest name) or has a value of the wrong type.
    Session(const std::filesystem::path& file, SessionOptions options);
    ~Session();

    const Graph& graph() const;
    const Registry& registry() const;

    struct Parameter {
        std::string name, doc;
        Value value, fallback;
    };
    // The parameters in the order in which the file declares them.
    const std::vector<Parameter>& parameters() const;

    // Makes this the thread that uses the session. It may change between two calls.
    void use_from_this_thread();

    // Stops the running scripts in all threads and refuses later ones with this error. Callable from any thread, in an
    // interruptible session.
    void interrupt(const Error& why);
    bool is_interrupted() const;
    // If keeps_state is set, hashes of each function by file, with the first line of each; the file's body comes first.
    // Equal for programs that differ only in comments and line numbers.
    struct FunctionCode {
        int line;
        std::uint64_t hash;
    };
    const std::map<std::string, std::vector<FunctionCode>>& code() const;

    // Returns the warnings of the file's makers since the last call, such as that a mesh has holes. Functions of the
    // frame make objects, too.
    std::vector<std::string> take_warnings();

    // The methods of a study file: its description; its closed form for a row's knobs, with ids from 0 in order; and
    // its own measure of error, for points matched by index. They throw the errors that the script raises or returns.
    Study study() const;
    PointSet study_reference(const Frame& frame, const Knobs& knobs) const;
    double study_error(const PointSet& points, const PointSet& reference) const;

    // Returns the node types that need no graph: the native ones and the shipped Lua nodes.
    static Registry all_node_types();

private:
    std::unique_ptr<ScriptHost> host_;
};

}  // namespace rapid
