// rapid wedge: runs one scene at many settings, each in a process of its own.
#include <fmt/format.h>
#include <tbb/info.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bindings/command/farm.h"
#include "bindings/command/processes.h"
#include "bindings/command/run_options.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_film.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/input_file.h"
#include "runtime/files/temporary_folder.h"
#include "runtime/report/number_text.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// The rows: settings, and the names of the files that each writes.

using Settings = std::vector<std::pair<std::string, std::string>>;

// The result of a run, as far as it got.
struct WedgeResult {
    // The error since birth of the frame where its 95 % quantile is largest.
    struct PositionError {
        double p50, p95, max;  // m, by the solver
        std::int64_t frame;
        double rounding;   // m, of the point with the largest
        double total_p95;  // m, by all sources that are estimated
        bool is_complete;  // all are
    };

    std::string failure;                     // empty: none
    std::uint64_t points = 0;                // of the last frame
    std::optional<std::int64_t> last_frame;  // nothing: none was computed
    std::uint64_t contacts = 0;              // of all frames
    double seconds = 0;                      // wall time of the run
    std::uint64_t peak_bytes = 0;
    std::optional<PositionError> error;
};

struct WedgeRow {
    Settings settings;                 // name and value, in the order of --vary
    std::vector<std::string> outputs;  // -o, with values in place of {NAME}

    WedgeResult result = {};

    // "rate=1000 solve.substeps=4"
    std::string label() const
    {
        std::string text;
        for (const auto& [name, value] : settings) text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
        return text;
    }
};

void check_settings(const std::vector<SweptSetting>& settings, bool zip)
{
    std::set<std::string> names;
    for (const SweptSetting& setting : settings) {
        if (!names.insert(setting.name).second) throw Error(fmt::format("--vary: {} is given twice", setting.name));
        const std::size_t count = setting.values.size(), first = settings.front().values.size();
        if (zip && count != first)
            throw Error(fmt::format("--zip: {} has {} values and {} has {}; give all the same number",
                                    settings.front().name, first, setting.name, count));
    }
}

std::vector<Settings> combinations(const std::vector<SweptSetting>& settings, bool zip)
{
    constexpr std::size_t most = 100000;
    std::size_t count = 1;
    for (const SweptSetting& setting : settings) {
        count = zip ? setting.values.size() : count * setting.values.size();
        if (count > most)
            throw Error(fmt::format("--vary: there are more than {} combinations; give fewer values", most));
    }
    std::vector<Settings> rows(count);
    for (std::size_t row = 0; row < count; ++row) {
        std::size_t rest = row;
        for (auto setting = settings.rbegin(); setting != settings.rend(); ++setting) {
            const std::size_t of = setting->values.size();
            rows[row].emplace_back(setting->name, setting->values[zip ? row : rest % of]);
            rest /= of;
        }
        std::reverse(rows[row].begin(), rows[row].end());
    }
    return rows;
}

// Maps each name in braces to the index of its setting. A PARAM that several nodes have is skipped.
std::map<std::string, std::size_t> names_in_braces(const std::vector<SweptSetting>& settings)
{
    std::map<std::string, std::size_t> names;
    std::map<std::string, int> of_nodes;
    for (const SweptSetting& setting : settings)
        if (const std::size_t dot = setting.name.rfind('.'); dot != std::string::npos)
            ++of_nodes[setting.name.substr(dot + 1)];
    for (std::size_t k = 0; k < settings.size(); ++k) {
        const std::string& name = settings[k].name;
        const std::string param = name.substr(name.rfind('.') + 1);
        if (param != name && of_nodes[param] == 1) names.emplace(param, k);
    }
    for (std::size_t k = 0; k < settings.size(); ++k) names[settings[k].name] = k;
    return names;
}

std::string with_values(const std::string& pattern, const Settings& row,
                        const std::map<std::string, std::size_t>& names)
{
    std::string result;
    for (std::size_t at = 0; at < pattern.size();) {
        const std::size_t open = pattern.find('{', at), close = pattern.find('}', open);
        if (close == std::string::npos) return result + pattern.substr(at);
        result += pattern.substr(at, open - at);
        const std::string name = pattern.substr(open + 1, close - open - 1);
        at = close + 1;
        if (name == "output") {
            result += "{output}";
            continue;
        }
        const auto found = names.find(name);
        if (found == names.end()) {
            std::vector<std::string> known;
            for (const auto& [other, place] : names) known.push_back(other);
            throw Error(fmt::format("-o {}: {{{}}} is not the name of a varied parameter{}", pattern, name,
                                    did_you_mean(name, known)));
        }
        std::string value = row[found->second].second;
        std::erase_if(value, [](char c) { return c == '{' || c == '}' || c == ' '; });  // of a vec3
        if (value.empty() || value.find_first_of("/#$%:") != std::string::npos || value.front() == '.')
            throw Error(
                fmt::format("-o {}: the value {} of {} can't be part of a file name; remove it from the pattern, or "
                            "vary a parameter with plain values",
                            pattern, value, name));
        result += value;
    }
    return result;
}

// Returns "{rate} and {substeps}": the varied names that are missing in the pattern.
std::string missing_names(const std::string& pattern, const std::vector<SweptSetting>& settings)
{
    std::map<std::size_t, std::string> shortest;
    for (const auto& [name, place] : names_in_braces(settings)) {
        std::string& text = shortest[place];
        if (text.empty() || name.size() < text.size()) text = name;
    }
    std::vector<std::string> missing;
    for (const auto& [place, name] : shortest) {
        const bool there = pattern.find('{' + name + '}') != pattern.npos ||
                           pattern.find('{' + settings[place].name + '}') != pattern.npos;
        if (!there && settings[place].values.size() > 1) missing.push_back('{' + name + '}');
    }
    return fmt::format("{}", fmt::join(missing, " and "));
}

[[noreturn]] void refuse_same_files(const std::string& pattern, const std::vector<SweptSetting>& settings,
                                    const std::string& row, const std::string& other)
{
    if (row == other) throw Error(fmt::format("--vary: {} appears twice; remove one", row));
    const std::string missing = missing_names(pattern, settings);
    throw Error(fmt::format("-o {}: {} and {} write the same files; {}", pattern, row, other,
                            missing.empty() ? "remove one" : fmt::format("put {} into the pattern", missing)));
}

// Returns all combinations, with the last setting changing fastest; with zip, the n-th values together. In a pattern
// {NAME}, or for NODE.PARAM also {PARAM}, is replaced by the value; {output} stays. Throws Error for a duplicate
// setting; lists of different lengths with zip; a name in braces that is not varied; a value that cannot be part of a
// file name; or rows that write the same files.
std::vector<WedgeRow> wedge_rows(const std::vector<SweptSetting>& settings, bool zip,
                                 const std::vector<std::string>& patterns)
{
    check_settings(settings, zip);
    const std::map<std::string, std::size_t> names = names_in_braces(settings);
    std::vector<WedgeRow> rows;
    std::map<std::string, std::string> written;  // by the file's name: the row
    for (Settings& row : combinations(settings, zip)) {
        rows.push_back({std::move(row), {}});
        for (const std::string& pattern : patterns) {
            const std::string name = with_values(pattern, rows.back().settings, names);
            const auto [other, is_new] = written.emplace(name, rows.back().label());
            if (!is_new) refuse_same_files(pattern, settings, other->second, rows.back().label());
            rows.back().outputs.push_back(name);
        }
    }
    return rows;
}

// The report: a line for each row as it ends, a table, wedge.json, and wedge.png, a contact sheet.

// Reads a run's --stats file. Leaves the result unchanged if there is none.
void read_statistics(const fs::path& file, WedgeResult& result)
{
    std::error_code none;
    if (!fs::is_regular_file(file, none)) return;  // reading a pipe would block
    std::ifstream text(file);
    const CheckedJson all = CheckedJson::parse(text, nullptr, false);
    if (all.is_discarded()) return;
    try {
        result.seconds = all.at("seconds");
        result.peak_bytes = all.at("peak_bytes");
        for (const CheckedJson& frame : all.at("frames")) {
            result.last_frame = frame.at("frame").get<std::int64_t>();
            result.points = frame.at("points");
            result.contacts += frame.at("collisions").get<std::uint64_t>();
            if (!frame.contains("error")) continue;
            const CheckedJson& error = frame.at("error");
            const double p95 = error.at("position_p95");
            const CheckedJson& total = frame.at("error_by_source").at("total");
            if (!result.error || p95 > result.error->p95)
                result.error = {error.at("position_p50"), p95,
                                error.at("position_max"), frame.at("frame"),
                                frame.at("rounding"),     total.at("position_p95"),
                                total.at("is_complete")};
        }
    } catch (const CheckedJson::exception&) {
        result.failure = fmt::format("{}: does not contain the statistics of a run", file.string());
    }
}

// Returns the last picture at or before frame `last`; empty if there is none, or if the files are not pictures.
fs::path last_picture(const std::string& output, std::optional<std::int64_t> last)
{
    const FramePattern pattern(parse_output_target(output).pattern);
    if (!last || fs::path(pattern.text()).extension() != ".png") return {};
    if (!pattern.has_frame()) return fs::exists(pattern.name()) ? fs::path(pattern.name()) : fs::path();
    fs::path file;
    for (const auto& [frame, path] : pattern.existing())
        if (frame <= *last) file = path;
    return file;
}

std::string error_text(const std::optional<WedgeResult::PositionError>& error)
{
    if (error && error->is_complete) return fmt::format("{:.2g}", error->total_p95);
    if (error && error->p95 > error->rounding) return fmt::format("{:.2g} from substeps", error->total_p95);
    return "not estimated";
}

std::string table_of(const std::vector<SweptSetting>& varied, const std::vector<WedgeRow>& rows)
{
    TextTable table = {{}};
    for (const SweptSetting& setting : varied) table[0].push_back(setting.name);
    table[0].insert(table[0].end(), {"points", "seconds", "error (m)", "contacts"});
    for (const WedgeRow& row : rows) {
        const WedgeResult& result = row.result;
        std::vector<std::string>& cells = table.emplace_back();
        for (const auto& [name, value] : row.settings) cells.push_back(printable(value));
        if (!result.failure.empty())
            cells.insert(cells.end(), {"failed", "", "", ""});
        else
            cells.insert(cells.end(), {with_separators(result.points), fmt::format("{:.3f}", result.seconds),
                                       error_text(result.error), with_separators(result.contacts)});
    }
    return table_text(table) +
           "error: estimated, since birth; in every frame 95 % of the points are within it; \"from substeps\": "
           "other sources are not estimated\n";
}

void add_row(JsonText& json, const WedgeRow& row)
{
    const WedgeResult& result = row.result;
    json.begin_object();
    json.key("settings");
    json.begin_object();
    for (const auto& [name, value] : row.settings) json.member(name, value);
    json.end();
    json.members("files", row.outputs, "status", result.failure.empty() ? "done" : "failed");
    if (!result.failure.empty()) json.member("failure", result.failure);
    json.members("last_frame", result.last_frame, "points", result.points, "contacts", result.contacts, "seconds",
                 result.seconds, "peak_bytes", result.peak_bytes);
    json.key("error");
    if (const auto& error = result.error)
        json.object("position_p50", error->p50, "position_p95", error->p95, "position_max", error->max, "frame",
                    error->frame, "is_complete", error->is_complete);
    else
        json.value(nullptr);
    json.end();
}

// Writes the contact sheet from the last pictures of the first -o that makes pictures. Returns false if there are none.
bool write_sheet(const fs::path& file, const std::vector<SweptSetting>& varied, const std::vector<WedgeRow>& rows)
{
    std::vector<SheetPicture> pictures;
    bool drawn = false;
    for (const WedgeRow& row : rows) {
        const WedgeResult& result = row.result;
        SheetPicture& picture = pictures.emplace_back();
        for (const std::string& output : row.outputs)
            if (picture.file.empty()) picture.file = last_picture(output, result.last_frame);
        drawn |= !picture.file.empty();
        picture.label = {row.label(), result.failure.empty()
                                          ? fmt::format("{} points, {}", with_separators(result.points),
                                                        duration_text(result.seconds))
                                          : "failed"};
    }
    // Combinations that differ only in the last setting form a series.
    const std::size_t of_last = varied.back().values.size(), series = of_last < rows.size() ? of_last : 1;
    if (drawn) write_whole(file, picture_sheet(pictures, series).value());
    return drawn;
}

class WedgeCommand : public Command, public Confined {
public:
    std::string name() const override { return "wedge"; }
    std::string doc() const override { return "runs a graph with many settings"; }

    void declare(Options& options) override
    {
        given_ = &options;
        graph_.declare(options);
        options
            .add_repeated(
                "--vary",
                [this](const std::vector<std::string>& strings) {
                    for (const std::string& text : strings)
                        settings_.push_back(read_swept_setting("--vary", text, "NAME"));
                },
                "values of a rapid.param or of a node's parameter: solve.substeps=1,4")
            .type_name("NAME=A,B,...")
            .one_value()
            .required();
        options.add_flag("--zip", zip_,
                         "combines the nth values of all varied parameters, instead of running all combinations");
        declare_frames(options, frames_,
                       fmt::format("the frames to write, as for run [default: {} from the first]", default_frames));
        files_.declare(options);
        options
            .add_option(
                "--jobs", [this](const std::string& text) { jobs_ = read_whole("--jobs", text, 1); },
                "number of runs at the same time; they share the threads [default 1]")
            .type_name("N");
        cache_.declare(options, "also stores snapshots, in folders below this one, as for run",
                       "also computes runs that are complete");
        options.add_flag("--quiet", quiet_, "no progress and no table");
        farm_.declare(options);
        options.add_option(collect_option, collect_).internal();  // the last job on a farm
        untrusted_.declare(options, "graph");
    }

    // The processes of the rows confine themselves; this one runs scripts only in a copy of itself.
    void confine(const CommonOptions&) override {}
    bool takes_plugins() const override { return false; }

    int run(const CommonOptions& common) override
    {
        rows_ = wedge_rows(settings_, zip_, files_.names());
        const std::vector<std::string> folders = SceneInside::output_folders(files_.files()).value();
        if (!folders.empty()) folder_ = folders.front();
        cache_.check();
        farm_.check();
        if (!collect_.empty()) return collect();
        check(common);
        if (farm_.requested()) return submit(common);
        const TemporaryFolder statistics("wedge");
        const int signal = run_processes(
            rows_.size(), static_cast<int>(std::min(jobs_, static_cast<std::int64_t>(rows_.size()))),
            [&](std::size_t row) {
                std::vector<std::string> words = words_of(row, statistics.path(), common);
                words.push_back("--claims=" + statistics.path().string());
                return words;
            },
            [&](std::size_t row, const EndedProcess& process) { end_row(row, process.failure, statistics.path()); });
        return signal != 0 ? signal : report();
    }

private:
    static constexpr const char* collect_option = "--collect";

    // Submits a task for each row, then the report of all.
    int submit(const CommonOptions& common) const
    {
        FarmJob job;
        job.name = "rapid-wedge-" + fs::path(graph_.file()).stem().string();
        job.outputs = folder_;
        const fs::path folder = fs::absolute(job.scripts()).lexically_normal();
        for (std::size_t row = 0; row < rows_.size(); ++row) {
            std::vector<std::string> words = words_of(row, folder, common);
            words.erase(words.begin());  // the name of the program
            // A restarted task continues after its last snapshot.
            std::erase_if(words, [](const std::string& word) {
                return word.starts_with("--threads=") || word == "--cache-every=0";
            });
            job.tasks.push_back({rows_[row].label(), {words.begin() + 2, words.end()}});
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

    // Collects the rows that have run on a farm.
    int collect()
    {
        for (std::size_t row = 0; row < rows_.size(); ++row) {
            const std::optional<int> status = read_status(fs::path(collect_) / fmt::format("{}.status", row + 1));
            std::string failure;
            if (!status)
                failure = "did not finish";
            else if (*status != status_done)
                failure = fmt::format("ended with status {}; see {}", *status,
                                      (fs::path(collect_) / fmt::format("{}.log", row + 1)).string());
            end_row(row, std::move(failure), collect_);
        }
        return report();
    }

    // statistics: the folder of all rows' statistics; that of a failed row may be missing.
    void end_row(std::size_t row, std::string failure, const fs::path& statistics)
    {
        WedgeResult& result = rows_[row].result;
        result.failure = std::move(failure);
        read_statistics(statistics_of(statistics, row), result);
        const std::string head = fmt::format("{}/{}  {}: ", ++done_, rows_.size(), printable(rows_[row].label()));
        if (!result.failure.empty())
            std::fputs(fmt::format("{}failed: {}\n", head, result.failure).c_str(), stderr);
        else if (!quiet_)
            print(
                fmt::format("{}{} points, {}\n", head, with_separators(result.points), duration_text(result.seconds)));
        std::fflush(stdout);
    }

    // Returns the exit status. Throws Error if a file cannot be written.
    int report() const
    {
        const bool drawn = write_sheet(folder_ / "wedge.png", settings_, rows_);
        JsonText json(2);
        json.begin_object();
        json.member("graph", graph_.file());
        json.key("varied");
        json.begin_object();
        for (const SweptSetting& setting : settings_) json.member(setting.name, setting.values);
        json.end();
        json.list("rows", rows_, [&](const WedgeRow& row) { add_row(json, row); });
        json.end();
        write_whole(folder_ / "wedge.json", json.text() + '\n');
        if (!quiet_) {
            print('\n' + table_of(settings_, rows_));
            print(fmt::format(
                "wrote {}{}\n", (folder_ / "wedge.json").string(),
                drawn ? " and " + (folder_ / "wedge.png").string() : "; no contact sheet, because no -o is a .png"));
        }
        const bool all_done =
            std::all_of(rows_.begin(), rows_.end(), [](const WedgeRow& row) { return row.result.failure.empty(); });
        return all_done ? status_done : status_failed;
    }

    // Finds misspelt settings before any row runs. Throws the error of `rapid check`.
    void check(const CommonOptions& common) const
    {
        std::string failure;
        const int signal = run_processes(
            1, 1,
            [&](std::size_t) {
                std::vector<std::string> words = {"rapid", "check", graph_.file()};
                add_shared(words, rows_.front(), common);
                // check assumes that there are several frames.
                if (!frames_ || !frames_->single()) add_outputs(words, rows_.front());
                return words;
            },
            [&](std::size_t, const EndedProcess& ended) { failure = ended.failure; });
        if (signal != 0) std::exit(signal);
        if (!failure.empty()) throw Error(failure);
    }

    // Returns the words of `rapid run` for the row.
    std::vector<std::string> words_of(std::size_t number, const fs::path& statistics, const CommonOptions& common) const
    {
        const WedgeRow& row = rows_[number];
        const int threads = common.threads > 0 ? common.threads : tbb::info::default_concurrency();
        std::vector<std::string> words = {"rapid",
                                          "run",
                                          graph_.file(),
                                          "--quiet",
                                          "--stats=" + statistics_of(statistics, number).string(),
                                          fmt::format("--threads={}", std::max<std::int64_t>(1, threads / jobs_))};
        for (const std::string& frames : given_->values_of("--frames")) words.push_back("--frames=" + frames);
        // A row's journal records its work: one with the same fingerprint is not run again.
        const fs::path of_rows = cache_.requested() ? fs::path(cache_.folder()) : folder_ / "wedge.cache";
        words.push_back("--cache=" + (of_rows / hash_text(content_hash(row.label()))).string());
        words.push_back("--cache-replace");
        if (const std::int64_t every = cache_.requested() ? cache_.every().value_or(-1) : 0; every >= 0)
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

    // Adds the options that check and run share.
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
    std::optional<RunFrames> frames_;
    std::int64_t jobs_ = 1;
    CacheOptions cache_;
    bool zip_ = false, quiet_ = false;
    FarmOptions farm_;
    std::string collect_;  // the folder of their statistics
    std::vector<WedgeRow> rows_;
    fs::path folder_ = ".";  // where wedge.json and wedge.png go
    std::size_t done_ = 0;   // rows that have ended
};
RAPID_COMMAND(WedgeCommand);

}  // namespace
}  // namespace rapid
