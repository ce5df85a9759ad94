// The statistics of a run, by frame and in total: the summary, and the file that --stats writes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

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
};

// Parts of a statistics file, in the order in which a run knows them: its head; a line for each frame, after that of
// the previous one; and the totals at the end. A run that ended early has the frames that it completed.
std::string json_head(const RunStatistics& run);
std::string json_line(const FrameFigures& frame, bool first);
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

template <class T>
requires std::is_same_v<T, StageSeconds> || std::is_same_v<T, ContactEnergy>
struct Total<T> {
    T sum;

    void add(std::int64_t, const T& figure) { sum += figure; }
};

template <>
struct Total<Sampled<ErrorQuantiles>> {
    std::optional<ErrorQuantiles> worst;  // of the frame with the largest error
    std::int64_t worst_frame = 0;
    std::uint64_t frames = 0;  // with an estimate

    void add(std::int64_t frame, const Sampled<ErrorQuantiles>& error);
};

template <>
struct Total<std::vector<std::string>> {
    std::map<std::string, std::int64_t> first;  // frame of each string

    void add(std::int64_t frame, const std::vector<std::string>& strings);
};

template <>
struct Total<std::optional<Ledger>> {
    std::optional<Ledger> sum;

    void add(std::int64_t, const std::optional<Ledger>& ledger);
};

template <>
struct Total<std::optional<ContactGrids>> {
    double search_seconds = 0;

    void add(std::int64_t, const std::optional<ContactGrids>& grids);
};

template <>
struct Total<std::vector<BandFigures>> {
    std::map<std::string, BandFigures> by_node;  // the largest, and the seconds of all frames

    void add(std::int64_t, const std::vector<BandFigures>& bands);
};

struct RunTotals {
#define RAPID_FIGURE(type, name, ...) Total<type> name;
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    std::uint64_t frames = 0;
    FrameFigures last;
    std::optional<std::int64_t> first_solved;  // frame with points

    void add(const FrameFigures& figures);
    void add_writing(double of_files) { seconds.sum.write += of_files; }
};

// Returns a line each for points, frames, seconds by stage, memory, errors and other figures; and one for each stiff
// node and each warning of Solve.
std::string summary(const RunStatistics& run, const RunTotals& totals);

// Returns a line for each stiff node.
std::string advice(const std::vector<Stiffness>& stiff);

}  // namespace rapid
