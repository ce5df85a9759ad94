// Studies: the error of a scene against its run time, at many settings of its knobs, each run compared with a reference
// and timed. As `rapid study` makes them (docs/cli.md), for programs that choose settings by themselves.
//
//   rapid::StudySource source;
//   source.file = "graphs/bounce.lua";
//   source.is_scene = true;
//   rapid::SceneStudy study;
//   study.sweep["solve.substeps"] = {1.0, 2.0, 4.0};
//   study.reference = {{"solve.substeps", 64.0}};
//   if (auto done = study.complete(); !done) return fail(done.error().text());
//   auto reference = rapid::StudyReference::make();
//   if (!reference) return fail(reference.error().text());
//   auto rows = study.rows();
//   if (!rows) return fail(rows.error().text());
//   auto computed = study.compute_reference(source, study.reference_of(rows->front()), *reference);
//   if (!computed) return fail(computed.error().text());
//   std::vector<rapid::StudyRun> runs;
//   for (const rapid::StudyKnobs& knobs : *rows) {
//       auto run = study.measure(source, knobs, &*reference);
//       if (!run) return fail(run.error().text());
//       runs.push_back(*run);
//   }
//   if (auto report = study.report(runs)) std::cout << report->text;
//
// Runs take place in this process, one after the other. A program that is to outlive a setting which crashes forks a
// process for each; what is said to start no threads may be called before that.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene.h"

namespace rapid {

// Values by knob: of a scene by NODE.PARAM, where NODE is a node's name, or its type where one node has it; of a study
// file by a name of its own.
using StudyKnobs = std::map<std::string, SceneValue>;

// The value that a text gives, as of the command line: true or false, a number, {x,y,z}, else the text itself. Starts
// no threads.
SceneValue knob_value(const std::string& text);

// Where the scenes of a study come from, and how they run.
struct StudySource {
    std::string file;       // a study file, which makes a scene of its knobs (docs/lua-api.md), or a scene
    bool is_scene = false;  // a scene
    // But `progress`, `estimate_errors` and `keep_all`: nothing is estimated, and `log` is told of prints alone.
    SceneOptions options;
    SceneHooks hooks;  // but `keep_state` and `tell_points`
};

// The frames of the run that others are compared with, in memory without a name that is gone with its last copy.
// Copying one copies a pointer; what is moved from may only be assigned to, or end. Processes that are forked share it:
// one may compute it, and others measure by it. It is written by one thread at a time, and read by any number.
class StudyReference {
public:
    // Starts no threads. Error: the system's.
    static Result<StudyReference> make();

private:
    friend struct SceneStudy;
    struct Data;
    explicit StudyReference(std::shared_ptr<Data> data);
    std::shared_ptr<Data> data_;
};

// What a run of one row gave.
struct StudyRun {
    StudyKnobs knobs;             // of the row
    double error = 0;             // m; of an own error function, its unit
    double rounding = 0;          // error of single precision alone, m; 0 where the unit is not known
    std::vector<double> seconds;  // of each timed run
    std::uint64_t compared = 0;   // points, summed over frames
    std::uint64_t missing = 0;    // points only in the run or only in the reference
    std::string failed;           // why there is none of this; empty where it ran

    double median_seconds() const;  // 0 without runs
};

// What is told of a study.
struct StudyReport {
    std::string text;  // a table for people, with the orders of accuracy that were observed
    std::string json;  // the same for programs, in lines (docs/cli.md)
    std::string svg;   // error against run time, both axes logarithmic, for light and dark backgrounds
};

// Told how many runs of a scene are done: 0 when its first frame is due. false ends the work with the error Cancelled.
using StudyProgress = std::function<bool(int runs)>;

// What is varied, compared and timed.
struct SceneStudy {
    std::string file, name;                                // of the source; of the study, for reports
    std::map<std::string, std::vector<SceneValue>> sweep;  // the values of each knob
    std::vector<std::string> lines;                        // the knobs that tell the lines of the plot apart
    std::int64_t first = 1, last = 48;                     // frames
    // "rms", "max", "p95" of the positions; "residual": the largest of the constraints; "own": a function of the file.
    std::string error = "rms";
    bool last_frame_only = false;         // else all frames after the first are compared
    std::optional<StudyKnobs> reference;  // knobs of the reference run; none: the closed form of the study file, if any
    int repeat_runs = 5;                  // timed runs of each row

    // That of a study file. Errors: as Scene::open().
    static Result<SceneStudy> read(const StudySource& source);

    // Of these members: completes `lines` where the sweep leaves no choice. Starts no threads. Error: two knobs remain
    // for the step along a line; a name that is no knob; a value given twice; members that can't be.
    Result<Done> complete();

    // Whether points are compared with a reference: a residual needs none.
    bool compares() const { return error != "residual"; }
    // The knobs of every row, line by line, in the order of the sweep. Starts no threads. Error: a line that is no
    // knob.
    Result<std::vector<StudyKnobs>> rows() const;
    // "method continuous, drag 2". Starts no threads.
    std::string label(const StudyKnobs& knobs) const;
    // The knobs of the run that a row is compared with: its own, overridden by `reference`, if any. Starts no threads.
    StudyKnobs reference_of(const StudyKnobs& knobs) const;

    // The first frame of the scene of the first row: opens it, which finds what is wrong before any run.
    Result<std::int64_t> first_frame(const StudySource& source) const;

    // Computes the frames of the scene of these knobs into `into`, in place of those that it has. Errors: WrongScene
    // before its first frame; as those of Scene::advance() behind.
    Result<Done> compute_reference(const StudySource& source, const StudyKnobs& knobs, const StudyReference& into,
                                   const StudyProgress& progress = {}) const;
    // Runs the scene of these knobs once to compare it with its reference, which is that of reference_of(knobs) and may
    // be null where the study has none, and then `repeat_runs` times for its time. Errors: as compute_reference(); no
    // point is in the run and in its reference; an error that is not finite.
    Result<StudyRun> measure(const StudySource& source, const StudyKnobs& knobs, const StudyReference* from,
                             const StudyProgress& progress = {}) const;

    // What the rows show, given in the order of rows(). machine: names and values, of what run times depend on. Starts
    // no threads. Error: rows of other knobs; a row that ran without a time.
    Result<StudyReport> report(const std::vector<StudyRun>& rows,
                               const std::vector<std::pair<std::string, std::string>>& machine = {}) const;
};

}  // namespace rapid
