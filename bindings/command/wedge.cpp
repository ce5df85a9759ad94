// rapid wedge: one scene at many settings, each run in a process of its own.
#include <fmt/format.h>
#include <tbb/info.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "bindings/command/cache_options.h"
#include "bindings/command/farm_options.h"
#include "bindings/command/file_options.h"
#include "bindings/command/process_pool.h"
#include "bindings/command/wedge_report.h"
#include "bindings/command/wedge_rows.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/or_throw.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/temporary_folder.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

class WedgeCommand : public Command, public Confined {
public:
    std::string name() const override { return "wedge"; }
    std::string doc() const override { return "runs a graph at many settings"; }

    void declare(Options& options) override
    {
        given_ = &options;
        graph_.declare(options);
        options
            .add_repeated(
                "--vary",
                [this](const std::vector<std::string>& texts) {
                    for (const std::string& text : texts)
                        settings_.push_back(read_swept_setting("--vary", text, "NAME"));
                },
                "the values of a rapid.param, or of a node's parameter: solve.substeps=1,4")
            .type_name("NAME=A,B,...")
            .one_value()
            .required();
        options.add_flag("--zip", zip_,
                         "the n-th values of all that is varied go together, in place of all combinations");
        declare_frames(options, frames_,
                       fmt::format("the frames to write, as of run [default: {} from the first]", default_frames));
        files_.declare(options);
        options
            .add_option(
                "--jobs", [this](const std::string& text) { jobs_ = read_whole("--jobs", text, 1); },
                "rows that run at a time, which share the threads [default 1]")
            .type_name("N");
        cache_.declare(options, "rows keep snapshots too, in folders below this one, as of run",
                       "computes rows that are done, too");
        options.add_flag("--quiet", quiet_, "no progress and no table");
        farm_.declare(options);
        options.add_option(collect_option, collect_).internal();  // what comes last on a farm
        untrusted_.declare(options, "graph");
    }

    // The processes of the rows confine themselves; this one runs no script but in a copy of itself.
    void confine(const CommonOptions&) override {}
    bool takes_plugins() const override { return false; }

    int run(const CommonOptions& common) override
    {
        const std::vector<WedgeRow> rows = wedge_rows(settings_, zip_, files_.names());
        const std::vector<std::string> folders = or_throw(output_folders(files_.files()));
        const fs::path folder = folders.empty() ? "." : folders.front();
        cache_.check();
        farm_.check();
        WedgeReport report(graph_.file(), settings_, rows, folder, quiet_);
        if (!collect_.empty()) return collect(rows, report);
        check(rows.front(), common);
        if (farm_.asked()) return submit(rows, folder, common);
        const TemporaryFolder statistics("wedge");
        const auto statistics_of = [&](std::size_t row) { return statistics.path() / fmt::format("{}.json", row); };
        const int signal = run_processes(
            rows.size(), static_cast<int>(std::min(jobs_, static_cast<std::int64_t>(rows.size()))),
            [&](std::size_t row) {
                std::vector<std::string> words = words_of(rows[row], statistics_of(row), folder, common);
                words.push_back("--claims=" + statistics.path().string());
                return words;
            },
            [&](std::size_t row, const EndedProcess& ended) { report.ended(row, ended, statistics_of(row)); });
        if (signal != 0) return signal;
        return report.finish() ? status_done : status_failed;
    }

private:
    static constexpr const char* collect_option = "--collect";

    // A task for each row, then the report of all.
    int submit(const std::vector<WedgeRow>& rows, const fs::path& outputs, const CommonOptions& common) const
    {
        FarmJob job;
        job.name = "rapid-wedge-" + fs::path(graph_.file()).stem().string();
        job.outputs = outputs;
        const fs::path folder = fs::absolute(job.scripts()).lexically_normal();
        for (std::size_t row = 0; row < rows.size(); ++row) {
            std::vector<std::string> words = words_of(rows[row], statistics_of(folder, row), outputs, common);
            words.erase(words.begin());  // the name of the program
            // A task that begins again goes on behind its last snapshot.
            std::erase_if(words, [](const std::string& word) {
                return word.starts_with("--threads=") || word == "--cache-every=0";
            });
            job.tasks.push_back({rows[row].label(), {words.begin() + 2, words.end()}});
            job.words.assign(words.begin(), words.begin() + 2);  // run GRAPH
        }
        job.last.push_back(farm_.words(*given_, {"--jobs"}));
        job.last.back().push_back(fmt::format("{}={}", collect_option, folder.string()));
        job.last_needs_all = false;
        return farm_.submit(std::move(job));
    }

    static fs::path statistics_of(const fs::path& folder, std::size_t row)
    {
        return folder / fmt::format("{}.json", row + 1);
    }

    // The rows have run on a farm.
    int collect(const std::vector<WedgeRow>& rows, WedgeReport& report) const
    {
        for (std::size_t row = 0; row < rows.size(); ++row) {
            EndedProcess ended{"it did not run to its end", status_failed};
            const fs::path path = fs::path(collect_) / fmt::format("{}.status", row + 1);
            std::error_code none;
            std::ifstream file;
            if (fs::is_regular_file(path, none)) file.open(path);  // reading a pipe would wait
            if (int status = 0; file.is_open() && file >> status) {
                ended = {"", status};
                if (status != status_done)
                    ended.failure = fmt::format("ended with status {}; see {}", status,
                                                (fs::path(collect_) / fmt::format("{}.log", row + 1)).string());
            }
            report.ended(row, ended, statistics_of(collect_, row));
        }
        return report.finish() ? status_done : status_failed;
    }

    // What a misspelt setting is wrong with is found before any row runs. Error: that of `rapid check`.
    void check(const WedgeRow& row, const CommonOptions& common) const
    {
        std::string failure;
        const int signal = run_processes(
            1, 1,
            [&](std::size_t) {
                std::vector<std::string> words = {"rapid", "check", graph_.file()};
                add_shared(words, row, common);
                // check takes it that there are several frames.
                if (!frames_ || !frames_->single()) add_outputs(words, row);
                return words;
            },
            [&](std::size_t, const EndedProcess& ended) { failure = ended.failure; });
        if (signal != 0) std::exit(signal);
        if (!failure.empty()) throw Error(failure);
    }

    // `rapid run` of the row.
    std::vector<std::string> words_of(const WedgeRow& row, const fs::path& statistics, const fs::path& folder,
                                      const CommonOptions& common) const
    {
        const int threads = common.threads > 0 ? common.threads : tbb::info::default_concurrency();
        std::vector<std::string> words = {"rapid",
                                          "run",
                                          graph_.file(),
                                          "--quiet",
                                          "--stats=" + statistics.string(),
                                          fmt::format("--threads={}", std::max<std::int64_t>(1, threads / jobs_))};
        for (const std::string& frames : given_->values_of("--frames")) words.push_back("--frames=" + frames);
        // What a row has done is known by its journal: one of the same fingerprint is not run again.
        const fs::path of_rows = cache_.asked() ? fs::path(cache_.folder()) : folder / "wedge.cache";
        words.push_back("--cache=" + (of_rows / hash_text(content_hash(row.label()))).string());
        words.push_back("--cache-replace");
        if (const std::int64_t every = cache_.asked() ? cache_.every().value_or(-1) : 0; every >= 0)
            words.push_back(fmt::format("--cache-every={}", every));
        if (cache_.again()) words.push_back("--again");
        add_shared(words, row, common);
        add_outputs(words, row);
        return words;
    }

    static void add_outputs(std::vector<std::string>& words, const WedgeRow& row)
    {
        for (const std::string& output : row.outputs) words.push_back("--output=" + output);
    }

    // The options that check and run take alike.
    void add_shared(std::vector<std::string>& words, const WedgeRow& row, const CommonOptions& common) const
    {
        for (const std::string& plugin : common.plugins) words.push_back("--plugin=" + plugin);
        for (const char* option :
             {"--set", "--seed", "--script-timeout", "--script-memory", "--memory", "--camera", "--size"})
            for (const std::string& value : given_->values_of(option))
                words.push_back(fmt::format("{}={}", option, value));
        for (const auto& [name, value] : row.settings) words.push_back(fmt::format("--set={}={}", name, value));
        for (const std::string& word : untrusted_.words()) words.push_back(word);
    }

    Options* given_ = nullptr;
    SceneArguments graph_;
    FileOptions files_;
    UntrustedOptions untrusted_;
    std::vector<SweptSetting> settings_;
    std::optional<FrameSelection> frames_;
    std::int64_t jobs_ = 1;
    CacheOptions cache_;
    bool zip_ = false, quiet_ = false;
    FarmOptions farm_;
    std::string collect_;  // the folder of their statistics
};
RAPID_COMMAND(WedgeCommand);

}  // namespace
}  // namespace rapid
