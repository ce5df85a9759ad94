#include "bindings/command/graph_options.h"

#include <fmt/format.h>

#include "runtime/memory_budget.h"

namespace rapid {

void GraphOptions::declare(CLI::App& app)
{
    app.add_option("GRAPH", file_, "the graph file, such as graphs/first.lua")->type_name("")->required();
    app.add_option_function<std::vector<std::string>>(
           "--set",
           [this](const std::vector<std::string>& texts) {
               for (const std::string& text : texts) {
                   const std::size_t equals = text.find('=');
                   if (equals == std::string::npos || equals == 0)
                       throw Error(fmt::format("--set \"{}\"; it must be NAME=VALUE", text));
                   session_.set[text.substr(0, equals)] = text.substr(equals + 1);
               }
           },
           "gives a rapid.param of the graph a value, or a node's parameter: solve.substeps=4")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    app.add_option_function<std::string>(
           "--seed", [this](const std::string& text) { seed_ = read_seed(text); }, "replaces the seed of every create")
        ->type_name("N");
    app.add_option_function<std::string>(
           "--script-timeout",
           [this](const std::string& text) { session_.script_timeout = read_positive("--script-timeout", text); },
           fmt::format("time that scripts may take, a frame [default {:g}]", session_.script_timeout))
        ->type_name("SECONDS");
    app.add_option_function<std::string>(
           "--script-memory",
           [this](const std::string& text) { session_.script_memory = read_bytes("--script-memory", text); },
           fmt::format("memory that a script's state may take: bytes, or 512M, 1G [default {}G]",
                       session_.script_memory >> 30))
        ->type_name("BYTES");
    app.add_option_function<std::string>(
           "--memory", [](const std::string& text) { set_memory_budget(read_bytes("--memory", text)); },
           "memory that the run may take: bytes, or 512M, 16G [default: what is free]")
        ->type_name("BYTES");
}

std::unique_ptr<Session> GraphOptions::load(bool may_write, std::function<void(const std::string& message)> on_timeout,
                                            std::function<void(const std::filesystem::path& file)> on_read) const
{
    SessionOptions options = session_;
    options.may_write = may_write;
    options.on_timeout = std::move(on_timeout);
    options.on_read = std::move(on_read);
    return std::make_unique<Session>(file_, std::move(options));
}

std::unique_ptr<Session> GraphOptions::load_to_look_at(const CommonOptions& common) const
{
    std::unique_ptr<Session> session = load(false, end_at_limit(common));
    for (const std::string& warning : session->take_warnings()) print_warning(warning);
    return session;
}

std::unique_ptr<Session> GraphOptions::load_other(const std::string& file,
                                                  std::function<void(const std::string& message)> on_timeout) const
{
    SessionOptions options = session_;
    options.set.clear();
    options.on_timeout = std::move(on_timeout);
    return std::make_unique<Session>(file, std::move(options));
}

std::unique_ptr<Session> GraphOptions::load_again(const KernelOrder& order,
                                                  std::function<void(const std::string& message)> on_timeout) const
{
    SessionOptions options = session_;
    options.quiet = true;
    options.kernel_order = order;
    options.on_timeout = std::move(on_timeout);
    return std::make_unique<Session>(file_, std::move(options));
}

}  // namespace rapid
