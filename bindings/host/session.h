// A graph file that has been run: its graph, its parameters, and the scripts that its nodes call.
//
// The file runs once in the session's main state, in the restricted environment; worker threads get states of their own
// when they first run a kernel. A session is used from one thread; its kernels run in all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "runtime/report/study.h"

namespace rapid {

// How kernels go over the points. Anything but the first way is for `rapid check --races`, on one thread.
struct KernelOrder {
    enum Way {
        Forward,    // in chunks, on all threads, each of which has a state of its own
        Reversed,   // one by one, from the last point to the first, in one state
        TwoStates,  // one by one, in two states by turns
    };
    Way way = Forward;
    std::string node;  // where given, of this node's kernel alone
};

struct SessionOptions {
    std::map<std::string, std::string> set;            // --set NAME=VALUE
    double script_timeout = 600;                       // s, a frame (or a load) may spend in scripts
    std::size_t script_memory = std::size_t{1} << 30;  // bytes of Lua memory, a state
    bool may_write = false;                            // levelset:write acts in a run alone
    bool quiet = false;                                // print says nothing
    KernelOrder kernel_order;
    // Of a study file: the knobs of the scene that is to be its graph. Empty: none is made; study() alone is asked.
    std::optional<Knobs> knobs;
    // Called from the watchdog's thread when a script overruns, with the message; it must not return to the script.
    std::function<void(const std::string& message)> on_timeout;
    // Where given, told of each file before it is read, and of each where a module or node was looked for.
    std::function<void(const std::filesystem::path& file)> on_read;
    // Where given, told of everything that LuaJIT began to compile and gave up: "FILE:LINE: why". From any thread.
    std::function<void(const std::string& message)> on_trace_abort;
};

class ScriptHost;

class Session {
public:
    // Runs the file. Error: it can't be read; what Lua or Rapid found wrong with it, with file and line; an unknown or
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

    // What was doubtful while the file ran: a mesh with holes, ...
    const std::vector<std::string>& warnings() const;

    // Of a study file: what it asks; its closed form, with ids from 0 in order, for a row of these knobs; and its own
    // measure of error, of points that are matched place by place. Error: what the script raised or returned.
    Study study() const;
    PointSet study_reference(const Frame& frame, const Knobs& knobs) const;
    double study_error(const PointSet& points, const PointSet& reference) const;

    // The node types that are there without any graph: the native ones and those of the shipped Lua nodes.
    static Registry all_node_types();

private:
    std::unique_ptr<ScriptHost> host_;
};

}  // namespace rapid
