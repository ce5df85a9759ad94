// rapid info: describes a cache file, or each file of a sequence.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bindings/command_line/cache_files.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/printable.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t most_of_warning = 4000;  // bytes printed at most

class Info : public Command, public Confined {
public:
    std::string name() const override { return "info"; }
    std::string doc() const override { return "tells what a cache file or sequence holds"; }

    void declare(Options& options) override
    {
        options.add_option("FILE", file_, "a file, or a sequence such as cache.####.vdb").type_name("").required();
        options.add_flag("--json", json_, "as JSON");
        untrusted_.declare(options, "file");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine([&] { return access_to_caches({file_}); }, common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        const CacheFiles cache = find_cache(file_);
        ordered_json all = ordered_json::array();
        for (const auto& [frame, path] : cache.frames) {
            if (SceneInside::is_snapshot(path)) {
                const SceneReport report = SceneInside::describe_snapshot(path).value();
                ordered_json json = {{"file", path.string()}};
                json.update(ordered_json::parse(report.json));
                if (!json_) print(report.text);
                all.push_back(std::move(json));
                continue;
            }
            const SceneFrame points = threads.run([&, &file = path] { return SceneFrame::read(file).value(); });
            const SceneReport report = threads.run([&] { return points.describe().value(); });
            if (json_) {
                ordered_json json = {{"file", path.string()}};
                if (cache.sequence) json["frame"] = frame;
                json.update(ordered_json::parse(report.json));
                json["left_out"] = points.warnings();
                all.push_back(std::move(json));
            } else {
                if (cache.sequence) print(path.string() + '\n');
                print(report.text);
                for (const std::string& what : points.warnings())
                    print(fmt::format("left out    {}\n", shortened(what, most_of_warning)));
            }
        }
        if (json_)
            print((cache.sequence ? all : all.front()).dump(2, ' ', false, ordered_json::error_handler_t::replace) +
                  '\n');
        return status_done;
    }

private:
    std::string file_;
    bool json_ = false;
    UntrustedOptions untrusted_;
};
RAPID_COMMAND(Info);

}  // namespace
}  // namespace rapid
