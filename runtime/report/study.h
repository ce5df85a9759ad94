// A study: one scene at many settings of its knobs, each run compared with a reference and timed.
//
// Defines a study, the results of its runs, and the values derived from them: the observed order of accuracy of each
// line, and the Pareto-optimal rows.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/value.h"

namespace rapid {

using Knobs = std::map<std::string, Value>;  // numbers, booleans, texts and vectors

struct Study {
    std::string file, name;
    std::map<std::string, std::vector<Value>> sweep;
    std::vector<std::string> lines;     // the knobs that distinguish the lines of the plot
    std::int64_t first = 1, last = 48;  // frames
    // "rms", "max", "p95" of the positions; "residual": the largest of the constraints; "own": a function of the file
    std::string error = "rms";
    bool last_frame_only = false;    // else all frames after the first
    std::optional<Knobs> reference;  // knobs of the reference run; none: the closed form of the study file, if any
    int repeat_runs = 5;

    // Returns true if points are compared with a reference. A residual needs none.
    bool compares() const { return error != "residual"; }
    // Completes `lines` if the sweep leaves no choice. Throws Error if two knobs remain for the step, a name is
    // unknown, or a value or a line is given twice.
    void complete();
    // Returns the knob along a line: the one that is not in `lines`; empty if there is none, or if it has no numbers.
    std::string step() const;
    // Returns the knobs of every row: line by line, in the order of the sweep.
    std::vector<Knobs> rows() const;
    // Returns the label of a row, "method continuous, drag 2". In that of its line, a text omits its knob:
    // "continuous".
    std::string label(const Knobs& knobs) const;
    std::string line_of(const Knobs& knobs) const;
    // Returns the knobs of the run that a row is compared with: its own, overridden by `reference`.
    Knobs reference_of(const Knobs& knobs) const;
};

struct StudyRow {
    Knobs knobs;
    double error = 0;             // m; of an own error function, its unit
    double rounding = 0;          // error of single precision alone, m; 0 if the unit is not known
    std::vector<double> seconds;  // of each repetition
    std::uint64_t compared = 0;   // points, summed over frames
    std::uint64_t missing = 0;    // points only in the run or only in the reference
    std::string failed;           // the reason; empty if it ran
    // The sources of error that no estimate includes (graph/error_sources.h).
    std::vector<std::string> unmeasured = {};

    double median_seconds() const;
    bool at_rounding() const;
};

struct StudyLine {
    std::string name;
    std::optional<double> order;  // nothing with fewer than two rows to fit
    std::size_t fitted = 0;       // rows
    bool at_rounding = false;     // all rows that ran are exact to rounding
};

struct StudyResult {
    Study study;
    std::vector<StudyRow> rows;  // as Study::rows()
    std::vector<std::pair<std::string, std::string>> machine;

    std::vector<StudyLine> lines() const;
    // Returns the unmeasured sources of error that are the same in all rows, which no row shows. Empty if the reference
    // is a closed form, which includes them, or if nothing is compared.
    std::vector<std::string> held_fixed() const;
    // Returns true if the errors of the rows include all sources.
    bool shows_all() const;
    // Returns true for each row that ran and is Pareto-optimal in error and time. Errors at rounding are equal.
    std::vector<bool> best() const;
};

// Returns the 95th percentile: the least value that at least 95 % do not exceed. Values in any order, not empty.
double p95_of(std::vector<double> values);

std::string knob_text(const Value& value);
std::string to_text(const StudyResult& result);
std::string to_json(const StudyResult& result);

// Returns an SVG of error against run time, both axes logarithmic, for light and dark backgrounds.
std::string to_svg(const StudyResult& result);

}  // namespace rapid
