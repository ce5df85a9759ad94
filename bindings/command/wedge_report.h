// What a wedge tells: a line for each row as it ends, a table, wedge.json, and wedge.png, a contact sheet.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bindings/command/process_pool.h"
#include "bindings/command/wedge_rows.h"

namespace rapid {

class WedgeReport {
public:
    // folder: where wedge.json and wedge.png go.
    WedgeReport(std::string graph, std::vector<SweptSetting> varied, std::vector<WedgeRow> rows,
                std::filesystem::path folder, bool quiet);

    // statistics: the file of --stats of the row's run, which may be missing where it failed.
    void ended(std::size_t row, const EndedProcess& process, const std::filesystem::path& statistics);

    // Prints the table and writes the files. Returns whether no row failed. Error: a file can't be written.
    bool finish() const;

private:
    // The error since birth of the frame where its 95 % quantile is largest.
    struct PositionError {
        double p50, p95, max;  // m
        std::int64_t frame;
    };
    struct Result {
        std::string failure;  // empty: none
        bool ended = false;
        std::uint64_t points = 0;                // of the last frame
        std::optional<std::int64_t> last_frame;  // nothing: none was computed
        std::uint64_t contacts = 0;              // of all frames
        double seconds = 0;                      // wall time of the run
        std::uint64_t peak_bytes = 0;
        std::optional<PositionError> error;
    };
    static void read(const std::filesystem::path& statistics, Result& result);
    std::string table() const;
    void write_json() const;
    bool write_sheet() const;

    const std::string graph_;
    const std::vector<SweptSetting> varied_;
    const std::vector<WedgeRow> rows_;
    const std::filesystem::path folder_;
    const bool quiet_;
    std::vector<Result> results_;
    std::size_t done_ = 0;
};

}  // namespace rapid
