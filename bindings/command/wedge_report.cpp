#include "bindings/command/wedge_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bindings/command_line/command.h"
#include "bindings/command_line/or_throw.h"
#include "bindings/scene/picture_sheet.h"
#include "runtime/checked_json.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/whole_file.h"
#include "runtime/printable.h"
#include "runtime/report/number_text.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// The picture of the last frame up to `last` that has one; empty: there is none, or the files are no pictures.
fs::path last_picture(const std::string& output, std::optional<std::int64_t> last)
{
    const FramePattern pattern(parse_output_target(output).pattern);
    if (!last || fs::path(pattern.text()).extension() != ".png") return {};
    if (!pattern.has_frame()) return fs::exists(pattern.text()) ? fs::path(pattern.text()) : fs::path();
    fs::path file;
    for (const auto& [frame, path] : pattern.existing())
        if (frame <= *last) file = path;
    return file;
}

}  // namespace

WedgeReport::WedgeReport(std::string graph, std::vector<SweptSetting> varied, std::vector<WedgeRow> rows,
                         fs::path folder, bool quiet)
    : graph_(std::move(graph)),
      varied_(std::move(varied)),
      rows_(std::move(rows)),
      folder_(std::move(folder)),
      quiet_(quiet),
      results_(rows_.size())
{
}

void WedgeReport::ended(std::size_t row, const EndedProcess& process, const fs::path& statistics)
{
    Result& result = results_[row];
    result.ended = true;
    result.failure = process.failure;
    read(statistics, result);
    ++done_;
    const std::string head = fmt::format("{}/{}  {}: ", done_, rows_.size(), printable(rows_[row].label()));
    if (!result.failure.empty())
        std::fputs(fmt::format("{}failed: {}\n", head, result.failure).c_str(), stderr);
    else if (!quiet_)
        print(fmt::format("{}{} points, {}\n", head, with_separators(result.points), duration_text(result.seconds)));
    std::fflush(stdout);
}

void WedgeReport::read(const fs::path& statistics, Result& result)
{
    std::error_code none;
    if (!fs::is_regular_file(statistics, none)) return;  // reading a pipe would wait
    std::ifstream file(statistics);
    const CheckedJson all = CheckedJson::parse(file, nullptr, false);
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
            if (!result.error || p95 > result.error->p95)
                result.error = {error.at("position_p50"), p95, error.at("position_max"), frame.at("frame")};
        }
    } catch (const nlohmann::json::exception&) {
        result.failure = fmt::format("{}: it does not hold the statistics of a run", statistics.string());
    }
}

std::string WedgeReport::table() const
{
    std::vector<std::vector<std::string>> table = {{}};
    for (const SweptSetting& setting : varied_) table[0].push_back(setting.name);
    table[0].insert(table[0].end(), {"points", "seconds", "error (m)", "contacts"});
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Result& result = results_[k];
        std::vector<std::string>& cells = table.emplace_back();
        for (const auto& [name, value] : rows_[k].settings) cells.push_back(printable(value));
        if (!result.failure.empty())
            cells.insert(cells.end(), {"failed", "", "", ""});
        else
            cells.insert(cells.end(), {with_separators(result.points), fmt::format("{:.3f}", result.seconds),
                                       result.error ? fmt::format("{:.2g}", result.error->p95) : "not estimated",
                                       with_separators(result.contacts)});
    }
    std::vector<std::size_t> widths(table[0].size());
    for (const auto& cells : table)
        for (std::size_t c = 0; c < cells.size(); ++c) widths[c] = std::max(widths[c], cells[c].size());
    std::string text;
    for (const auto& cells : table) {
        std::string line;
        for (std::size_t c = 0; c < cells.size(); ++c) line += fmt::format("{:>{}}  ", cells[c], widths[c]);
        text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
    }
    return text + "error: since birth, estimated; 95 % of the points are within it in every frame\n";
}

void WedgeReport::write_json() const
{
    ordered_json wedge = {{"graph", graph_}, {"varied", ordered_json::object()}, {"rows", ordered_json::array()}};
    for (const SweptSetting& setting : varied_) wedge["varied"][setting.name] = setting.values;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Result& result = results_[k];
        ordered_json row = {{"settings", ordered_json::object()},
                            {"files", rows_[k].outputs},
                            {"status", result.failure.empty() ? "done" : "failed"}};
        for (const auto& [name, value] : rows_[k].settings) row["settings"][name] = value;
        if (!result.failure.empty()) row["failure"] = result.failure;
        row["last_frame"] = result.last_frame ? ordered_json(*result.last_frame) : ordered_json();
        row.update({{"points", result.points},
                    {"contacts", result.contacts},
                    {"seconds", result.seconds},
                    {"peak_bytes", result.peak_bytes},
                    {"error", nullptr}});
        if (result.error)
            row["error"] = {{"position_p50", result.error->p50},
                            {"position_p95", result.error->p95},
                            {"position_max", result.error->max},
                            {"frame", result.error->frame}};
        wedge["rows"].push_back(std::move(row));
    }
    write_whole(folder_ / "wedge.json", wedge.dump(2, ' ', false, ordered_json::error_handler_t::replace) + '\n');
}

// Of the last pictures of the first -o that is one. Returns whether there is any.
bool WedgeReport::write_sheet() const
{
    std::vector<SheetPicture> pictures;
    bool drawn = false;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Result& result = results_[k];
        SheetPicture& picture = pictures.emplace_back();
        for (const std::string& output : rows_[k].outputs)
            if (picture.file.empty()) picture.file = last_picture(output, result.last_frame);
        drawn |= !picture.file.empty();
        picture.label = {rows_[k].label(), result.failure.empty()
                                               ? fmt::format("{} points, {}", with_separators(result.points),
                                                             duration_text(result.seconds))
                                               : "failed"};
    }
    // Of combinations those that differ by the last setting alone belong together.
    const std::size_t of_last = varied_.back().values.size(), series = of_last < rows_.size() ? of_last : 1;
    if (drawn) write_whole(folder_ / "wedge.png", or_throw(picture_sheet(pictures, series)));
    return drawn;
}

bool WedgeReport::finish() const
{
    const bool drawn = write_sheet();
    write_json();
    if (!quiet_) {
        print('\n' + table());
        print(
            fmt::format("wrote {}{}\n", (folder_ / "wedge.json").string(),
                        drawn ? " and " + (folder_ / "wedge.png").string() : "; no contact sheet, as no -o is a .png"));
    }
    return std::all_of(results_.begin(), results_.end(), [](const Result& result) { return result.failure.empty(); });
}

}  // namespace rapid
