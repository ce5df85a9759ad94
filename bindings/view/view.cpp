// rapid view: shows a scene, or the files of a sequence, in a web page on this machine.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "bindings/command_line/cache_files.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/programs.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/signals.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/installation.h"
#include "bindings/view/requests.h"
#include "bindings/view/server.h"
#include "bindings/view/simulation.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/threads.h"
#include "runtime/files/output_file.h"
#include "runtime/files/start_program.h"

namespace rapid {
namespace {

constexpr int watch_interval = 100;  // ms between checks of the files that a run has read

// Returns the page's folder: next to the Lua modules in an installation, among the sources in a checkout.
std::filesystem::path page_folder()
{
    const std::filesystem::path root = std::filesystem::path(Installation::find().value().lua).parent_path();
    std::error_code none;
    return std::filesystem::exists(root / "view/index.html", none) ? root / "view" : root / "bindings/view/page";
}

class View : public Command, public Confined {
public:
    std::string name() const override { return "view"; }
    std::string doc() const override { return program(name()).doc; }

    void declare(Options& options) override
    {
        graph_.declare(options);
        declare_frames(options, frames_, "the frames to compute: 1-240 or 100 [default: 240 from the first]");
        options
            .add_option(
                "--port",
                [this](const std::string& text) {
                    port_ = static_cast<int>(std::min<std::int64_t>(read_whole("--port", text, 0), 65536));
                    if (port_ > 65535) throw Error(fmt::format("--port = {}; it must be at most 65535", text));
                },
                "the port of the page; 0, the default, takes a free one")
            .type_name("N");
        options.add_flag("--no-open", no_open_, "doesn't open the page in a browser");
        options
            .add_option("--cache", cache_,
                        "also stores frames in this folder: those that exceed the memory, and for the next view of the "
                        "same scene")
            .type_name("DIR");
        untrusted_.declare(options, "graph");
    }

    // The sandbox cannot create sockets, so the listening one is made before.
    void confine(const CommonOptions& common) override
    {
        untrusted_.confine(
            [&] {
                const int socket = ViewServer::listen(port_);
                if (socket != inherited_socket && dup2(socket, inherited_socket) < 0)
                    throw Error(
                        fmt::format("--untrusted: can't make a socket for the page ({})", std::strerror(errno)));
                fcntl(inherited_socket, F_SETFD, 0);
                SandboxAccess access{ViewServer::files(page_folder()), {}, inherited_socket + 1};
                access.readable.push_back(folder_of(graph_.file()));
                if (!cache_.empty()) {
                    std::filesystem::create_directories(cache_);
                    access.writable.push_back(cache_);
                }
                return access;
            },
            common, Processes::None, Connections::Accepted);
    }

    int run(const CommonOptions& common) override
    {
        std::signal(SIGPIPE, SIG_IGN);
        const SignalThread signals([](int signal) {
            remove_unfinished_files();
            _exit(128 + signal);
        });
        const Threads threads(common.threads);
        // The run needs memory, too.
        ViewOptions options{graph_.file(),
                            graph_.scene_options(),
                            {},
                            {},
                            threads.count(),
                            static_cast<std::size_t>(memory_budget() / 2),
                            cache_,
                            untrusted_.requested()};
        options.scene.log = nullptr;  // the page shows the warnings
        if (frames_) options.frames = {frames_->first, frames_->last};
        if (std::filesystem::path(graph_.file()).extension() != ".lua")
            options.files = find_cache(graph_.file()).frames;

        std::unique_ptr<ViewRequests> requests;
        ViewServer server(untrusted_.requested() ? inherited_socket : ViewServer::listen(port_), page_folder(),
                          [&](const std::string& message, const Answer& answer) { requests->handle(message, answer); });
        ViewSimulation simulation(std::move(options), [&] {
            server.post([&] {
                if (requests) requests->answer_waiting();
            });
        });
        server.post([&] {
            requests = std::make_unique<ViewRequests>(simulation, graph_.file(),
                                                      [&](std::function<void()> f) { server.post(std::move(f)); });
        });
        server.repeat(watch_interval, [&] { simulation.check_files(); });
        print(server.address() + '\n');
        std::fflush(stdout);
        if (!no_open_ && !untrusted_.requested()) open(server.address_to_open());  // starts a program
        server.run();
        return status_done;
    }

private:
    // Opens a browser if there is a desktop.
    static void open(const std::string& address)
    {
        if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
        const std::string program = program_path("xdg-open");
        if (program.empty() || fork() != 0) return;  // the printed line has to suffice
        execl(program.c_str(), program.c_str(), address.c_str(), nullptr);
        _exit(status_failed);
    }

    static constexpr int inherited_socket = 3;  // in the process that restarts in the sandbox

    SceneArguments graph_;
    UntrustedOptions untrusted_;
    std::optional<RunFrames> frames_;
    std::string cache_;
    int port_ = 0;
    bool no_open_ = false;
};
RAPID_COMMAND(View);

}  // namespace
}  // namespace rapid
