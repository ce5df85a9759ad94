#include "bindings/command_line/scene_arguments.h"

#include <fmt/format.h>

#include <utility>

#include "bindings/scene/scene_inside.h"
#include "runtime/base/memory_budget.h"

namespace rapid {
namespace {

// The memory limit applies to opening; the scene itself watches frames, since it knows the node.
Scene opened(const std::string& file, SceneOptions options, SceneHooks hooks)
{
    const MemoryLimit limit(file, hooks.on_script_timeout);
    return SceneInside::open(file, std::move(options), std::move(hooks)).value();
}

}  // namespace

void SceneArguments::declare(Options& options)
{
    options.add_option("GRAPH", file_, "the graph file, such as graphs/first.lua").type_name("").required();
    options
        .add_repeated(
            "--set",
            [this](const std::vector<std::string>& strings) {
                for (const std::string& text : strings) {
                    const std::size_t equals = text.find('=');
                    if (equals == std::string::npos || equals == 0)
                        throw Error(fmt::format("--set \"{}\"; it must be NAME=VALUE", text));
                    settings_[text.substr(0, equals)] = text.substr(equals + 1);
                }
            },
            "sets a rapid.param of the graph, or a parameter of a node: solve.substeps=4")
        .type_name("NAME=VALUE")
        .one_value();
    options
        .add_option(
            "--seed", [this](const std::string& text) { options_.seed = read_seed(text); },
            "replaces the seed of every create")
        .type_name("N");
    options
        .add_option(
            "--script-timeout",
            [this](const std::string& text) { options_.script_seconds = read_positive("--script-timeout", text); },
            fmt::format("time limit of each stretch of script [default {:g}]", options_.script_seconds))
        .type_name("SECONDS");
    options
        .add_option(
            "--script-memory",
            [this](const std::string& text) { options_.script_memory = read_bytes("--script-memory", text); },
            fmt::format("limit of Lua's memory: bytes, 512M or 1G [default {}G]", options_.script_memory >> 30))
        .type_name("BYTES");
    options
        .add_option(
            "--memory", [](const std::string& text) { set_memory_budget(read_bytes("--memory", text)); },
            "memory budget of the run: bytes, 512M or 16G [default: the free memory]")
        .type_name("BYTES");
}

SceneOptions SceneArguments::scene_options() const
{
    SceneOptions options = options_;
    options.set.assign(settings_.begin(), settings_.end());
    options.log = [](LogLevel level, const std::string& text) {
        level == LogLevel::Print ? print(text + '\n') : print_warning(text);
    };
    return options;
}

Scene SceneArguments::open(const CommonOptions& common, AtLimit frame) const
{
    SceneHooks hooks;
    hooks.on_script_timeout = end_at_limit(common);
    if (frame == AtLimit::EndsProcess) hooks.on_memory_exceeded = hooks.on_script_timeout;
    return opened(file_, scene_options(), std::move(hooks));
}

Scene SceneArguments::open_other(const std::string& file, const CommonOptions& common) const
{
    SceneOptions options = scene_options();
    options.set.clear();
    SceneHooks hooks;
    hooks.on_script_timeout = end_at_limit(common);
    return opened(file, std::move(options), std::move(hooks));
}

}  // namespace rapid
