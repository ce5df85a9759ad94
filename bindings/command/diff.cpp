// rapid diff: compares two cache files, or two sequences frame by frame; points are matched by id.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <set>

#include "bindings/command_line/cache_files.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/untrusted.h"
#include "include/rapid/scene.h"
#include "runtime/base/json.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

class Diff : public Command, public Confined {
public:
    std::string name() const override { return "diff"; }
    std::string doc() const override { return "compares two cache files or sequences by id"; }

    void declare(Options& options) override
    {
        options.add_option("A", a_, "a file, or a sequence such as cache.####.vdb").type_name("").required();
        options.add_option("B", b_, "the other").type_name("").required();
        options
            .add_option(
                "--tolerance", [this](const std::string& text) { tolerance_ = read_tolerance(text); },
                fmt::format("allowed difference: for P times the diagonal of the bounds, for other attributes relative "
                            "[default {}]",
                            default_tolerance))
            .type_name("X");
        options.add_flag("--json", json_, "as JSON");
        untrusted_.declare(options, "file");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine([&] { return access_to_caches({a_, b_}); }, common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const CacheFiles a = find_cache(a_), b = find_cache(b_);
            if (a.sequence != b.sequence)
                throw Error(fmt::format("{} is a sequence and {} is a file; give two files or two sequences",
                                        a.sequence ? a_ : b_, a.sequence ? b_ : a_));
            return a.sequence ? compare_sequences(a, b) : compare_files();
        });
    }

private:
    static constexpr const char* default_tolerance = "1e-6";

    static double read_tolerance(const std::string& text)
    {
        double value = 0;
        const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool whole = parsed.ec == std::errc() && parsed.ptr == text.data() + text.size();
        if (!whole || !(value >= 0) || !std::isfinite(value))
            throw Error(fmt::format("--tolerance = \"{}\"; it must be a number, at least 0", text));
        return value;
    }

    FrameComparison compare(const std::string& a, const std::string& b) const
    {
        const SceneFrame of_a = SceneFrame::read(a).value(), of_b = SceneFrame::read(b).value();
        return of_a.compare(of_b, tolerance_).value();
    }

    int compare_files() const
    {
        const FrameComparison found = compare(a_, b_);
        print(json_ ? json_text(CheckedJson::parse(found.report.json), 2) + '\n' : found.report.text);
        return found.same ? status_done : status_failed;
    }

    // A frame that only one sequence has is a difference.
    int compare_sequences(const CacheFiles& a, const CacheFiles& b) const
    {
        std::vector<int> both, only_a, only_b;
        for (const auto& [frame, path] : a.frames) (b.frames.count(frame) ? both : only_a).push_back(frame);
        for (const auto& [frame, path] : b.frames)
            if (!a.frames.count(frame)) only_b.push_back(frame);

        std::size_t different = 0;
        std::vector<std::pair<int, std::string>> reports;  // as JSON
        for (const int frame : both) {
            const FrameComparison found = compare(a.frames.at(frame), b.frames.at(frame));
            different += !found.same;
            if (json_)
                reports.emplace_back(frame, found.report.json);
            else if (!found.same)
                print(fmt::format("frame {}\n{}", frame, found.report.text));
        }
        const bool same = different == 0 && only_a.empty() && only_b.empty();
        if (json_) {
            JsonText json(2);
            json.begin_object();
            json.members("same", same, "only_a", only_a, "only_b", only_b);
            json.list("frames", reports, [&](const auto& report) {
                json.begin_object();
                json.member("frame", report.first);
                json.add_members(CheckedJson::parse(report.second));
                json.end();
            });
            json.end();
            print(json.text() + '\n');
        } else {
            if (!only_a.empty()) print(fmt::format("only in {}: frames {}\n", a_, fmt::join(only_a, ", ")));
            if (!only_b.empty()) print(fmt::format("only in {}: frames {}\n", b_, fmt::join(only_b, ", ")));
            print(fmt::format("{} of {} common frames are the same\n", both.size() - different, both.size()));
        }
        return same ? status_done : status_failed;
    }

    std::string a_, b_;
    double tolerance_ = read_tolerance(default_tolerance);
    bool json_ = false;
    UntrustedOptions untrusted_;
};
RAPID_COMMAND(Diff);

}  // namespace
}  // namespace rapid
