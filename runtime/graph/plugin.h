// Plugins: shared libraries, built against the installed package, whose nodes register themselves when the library is
// loaded (`--plugin FILE`, RAPID_PLUGIN_PATH) and then act like native ones.
//
//   #include "runtime/graph/plugin.h"
//   RAPID_PLUGIN;          once, in one of its sources
//   RAPID_NODE(MyNode);
//
// C++ has no stable binary layout across versions: a library built with other headers would crash in its first call.
// RAPID_PLUGIN embeds a mark with a hash of the headers, which is checked before the file is loaded.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/abi.h"
#include "runtime/graph/node.h"
#include "runtime/solver/constraints/constraint.h"

#define RAPID_PLUGIN_MARK "rapid plugin, built with "
#define RAPID_PLUGIN                                                                        \
    extern "C" __attribute__((used, visibility("default"))) const char rapid_plugin_mark[]; \
    const char rapid_plugin_mark[] = RAPID_PLUGIN_MARK RAPID_ABI

namespace rapid {

// Must be called before the first Registry is created. Throws Error if the file cannot be read or loaded, is not a
// plugin, was built with other headers, or has a node whose name is taken.
void load_plugin(const std::string& file);

// path: a colon-separated list of plugins and folders; all *.so of a folder are loaded in order of name.
void load_plugins(const std::string& path);

// Returns the files of the loaded plugins, in order.
const std::vector<std::string>& loaded_plugins();

// Returns a constraint from a function of the points that returns its rows (solver/constraints/rows.h), called before
// each frame.
template <class F>
std::shared_ptr<const Constraint> constrain(const Evaluation& now, const std::string& group, F rows_of)
{
    struct Made : Constraint {
        F rows_of;
        explicit Made(F f) : rows_of(std::move(f)) {}
        std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
        {
            auto rows = rows_of(points);
            rows->follow(points, group);
            return rows;
        }
    };
    return dynamic_of<Made>(now, group, std::move(rows_of));
}

// Returns an action from a function of a point's P (m) and v (m/s), called in every substep from any thread.
template <class F>
std::shared_ptr<const Action> act(const Evaluation& now, F edit)
{
    struct Pass : ActionPass {
        F edit;
        explicit Pass(F f) : edit(std::move(f)) {}
        void act(const Chunk& chunk, std::span<Vec3d>, std::span<std::uint8_t>) override
        {
            for (std::size_t i = 0; i < chunk.size(); ++i) edit(chunk.P[i], chunk.v[i]);
        }
    };
    struct Made : Action {
        F edit;
        explicit Made(F f) : edit(std::move(f)) {}
        std::unique_ptr<ActionPass> begin(PointSet&) const override { return std::make_unique<Pass>(edit); }
    };
    return dynamic_of<Made>(now, {}, std::move(edit));
}

// Returns the library's RAPID_ABI (abi.h). A program compares it with its own: with libraries for several processor
// levels, the loader may find one from another build.
const char* library_abi();

}  // namespace rapid
