// The statistics of a run, by frame and in total: the summary, and the file that --stats writes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "runtime/graph/error_sources.h"
#include "runtime/graph/evaluate.h"
#include "runtime/solver/figures.h"

namespace rapid {

// Returns the figures of a frame without the time of writing, which is known later.
FrameFigures statistics_of(const FrameResult& result);

struct RunStatistics {
    std::string graph;  // as the user named it
    int threads = 1;
    std::uint64_t peak_bytes = 0;
    double seconds = 0;            // wall time from loading the graph to the last file
    std::vector<Stiffness> stiff;  // the worst of each node
    ErrorSources errors;           // that no estimate includes
};

// Parts of a statistics file, in the order in which a run knows them: its head; a line for each frame, after that of
// the previous one; and the totals at the end. A run that ended early has the frames that it completed.
std::string json_head(const RunStatistics& run);
std::string json_line(const FrameFigures& frame, bool first, const ErrorSources* errors = nullptr);
std::string json_end(const RunStatistics& run);

// The total of a figure over the frames of a run, by its type; nothing for most. Its size does not depend on the number
// of frames.
template <class T>
struct Total {
    void add(std::int64_t, const T&) {}
};

template <class T>
requires std::is_arithmetic_v<T>
struct Total<T> {
    T sum = 0;
    std::optional<T> most;
    std::int64_t max_frame = 0;
    std::uint64_t frames = 0;          // with a value other than 0
    std::int64_t first = 0, last = 0;  // of these

    void add(std::int64_t frame, T value)
    {
        sum += value;
        if (!most || value > *most) {
            most = value;
            max_frame = frame;
        }
        if (value == 0) return;
        if (frames++ == 0) first = frame;
        last = frame;
    }
};

template <>
struct Total<Sampled<ErrorQuantiles>> {
    std::optional<ErrorQuantiles> worst;  // of the frame with the largest error
    std::uint64_t frames = 0;             // with an estimate

    void add(std::int64_t frame, const Sampled<ErrorQuantiles>& error);
};

template <>
struct Total<std::vector<std::string>> {
    std::map<std::string, std::int64_t> first;  // frame of each string

    void add(std::int64_t frame, const std::vector<std::string>& strings);
};

template <>
struct Total<std::vector<NodeWork>> {
    std::map<std::string, double> seconds;  // by pass over the points

    void add(std::int64_t, const std::vector<NodeWork>& passes);
};

struct RunTotals {
#define RAPID_FIGURE(type, name, ...) Total<type> name;
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    std::uint64_t frames = 0;
    std::uint64_t last_points = 0;             // of the last frame
    std::optional<std::int64_t> first_solved;  // first frame with points that were solved

    std::uint64_t warnings = 0;                     // printed during the run
    std::map<std::string, double> writing_seconds;  // by extension
    std::uint64_t files = 0, points_of_fullest = 0;
    std::string fullest_file;
    std::set<std::string> films;

    void add(const FrameFigures& figures);
    // Adds a file of a frame that has been written, or a frame of a film: its points, and the seconds that it took.
    void add_file(const std::string& path, bool is_film, std::uint64_t points_of_file, double seconds_of_file);
};

// Returns the summary for the user: points, frames, the slowest part, the error, the files, and a line for each thing
// to look at. If there is none, the last line is `all fine`, unless a part of the error is not estimated. The slowest
// part is missing if no pass was timed, the error if no point was solved.
std::string summary(const RunStatistics& run, const RunTotals& totals);

// Returns a line for each stiff node.
std::string advice(const std::vector<Stiffness>& stiff);

}  // namespace rapid
