// A study: one scene at many settings of its knobs, each run compared with a reference and timed.
//
// Here is what a study asks, what its runs gave, and what follows from them: the observed order of accuracy of each
// line, and the rows that no other row beats. Who runs the scenes is the command's business.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/value.h"

namespace rapid {

using Knobs = std::map<std::string, Value>;  // numbers, booleans and texts

struct Study {
    std::string file, name;
    std::map<std::string, std::vector<Value>> sweep;
    std::vector<std::string> lines;     // the knobs that tell the lines of the plot apart
    std::int64_t first = 1, last = 48;  // frames
    // "rms", "max", "p95"; "residual": of the constraints, the largest; "own": a function of the study file
    std::string error = "rms";
    bool last_frame_only = false;    // else all frames after the first
    std::optional<Knobs> reference;  // knobs of the reference run; none: a closed form of the study file, if any
    int repeat_runs = 5;

    // Whether points are compared with a reference: a residual needs none.
    bool compares() const { return error != "residual"; }
    // Fills in `lines` where the sweep leaves no choice. Error: two knobs are left for the step; unknown names; two
    // rows that would be one.
    void complete();
    // The knob that is not in `lines`: the step along a line. Empty where there is none, or where it has no numbers.
    std::string step() const;
    // Knobs of every row: line by line, in the order of the sweep.
    std::vector<Knobs> rows() const;
    // As "continuous" or "method continuous, drag 2"; of the whole row and of its line.
    std::string label(const Knobs& knobs) const;
    std::string line_of(const Knobs& knobs) const;
    // What a row is compared with: its own knobs, but for those of `reference`.
    Knobs reference_of(const Knobs& knobs) const;
};

struct StudyRow {
    Knobs knobs;
    double error = 0;             // m; of an own error function, its unit
    double rounding = 0;          // what single precision alone may cause, m; 0 where the unit is not known
    std::vector<double> seconds;  // of each repeat
    std::uint64_t compared = 0;   // points, summed over frames
    std::uint64_t missing = 0;    // points of the run or of the reference alone
    std::string failed;           // why there is no error; empty: it ran
    bool refused = false;         // it failed before its first frame

    double median_seconds() const;
    bool at_rounding() const;
};

struct StudyLine {
    std::string name;
    std::optional<double> order;  // none: fewer than two rows to fit
    std::size_t fitted = 0;       // rows
    bool at_rounding = false;     // all rows that ran are exact
};

struct StudyResult {
    Study study;
    std::vector<StudyRow> rows;  // as Study::rows()
    std::vector<std::pair<std::string, std::string>> machine;

    std::vector<StudyLine> lines() const;
    // By row: it ran, and none is at least as good in error and time and better in one. Errors at rounding are equal.
    std::vector<bool> best() const;
};

// The least value that at least 95 % do not exceed. Of values in any order, not empty.
double p95_of(std::vector<double> values);

std::string knob_text(const Value& value);
std::string to_text(const StudyResult& result);
nlohmann::ordered_json to_json(const StudyResult& result);

// Error against run time, both axes logarithmic: an SVG that is the same in light and dark surroundings.
std::string to_svg(const StudyResult& result);

}  // namespace rapid
