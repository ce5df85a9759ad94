// rapid info: describes a cache file, or each file of a sequence.
#include <fmt/format.h>

#include "bindings/command_line/cache_files.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

constexpr std::size_t max_warning_bytes = 4000;  // bytes printed at most

class Info : public Command, public Confined {
public:
    std::string name() const override { return "info"; }
    std::string doc() const override { return "describes a cache file or sequence"; }

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
        JsonText json(2);
        if (cache.sequence) json.begin_list();
        for (const auto& [frame, path] : cache.frames) {
            json.begin_object();
            json.member("file", path.string());
            if (SceneInside::is_snapshot(path)) {
                const SceneReport report = SceneInside::describe_snapshot(path).value();
                if (!json_) print(report.text);
                json.add_members(CheckedJson::parse(report.json));
            } else {
                const SceneFrame points = threads.run([&, &file = path] { return SceneFrame::read(file).value(); });
                const SceneReport report = threads.run([&] { return points.describe().value(); });
                if (!json_ && cache.sequence) print(path.string() + '\n');
                if (!json_) print(report.text);
                for (const std::string& what : points.warnings())
                    if (!json_) print(fmt::format("note        {}\n", shortened(what, max_warning_bytes)));
                if (cache.sequence) json.member("frame", frame);
                json.add_members(CheckedJson::parse(report.json));
                json.member("left_out", points.warnings());
            }
            json.end();
        }
        if (cache.sequence) json.end();
        if (json_) print(json.text() + '\n');
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
