// Runs and measures the scenes of a study. Every function here starts threads and runs scripts: call it in a child
// process (child.h).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "bindings/command/child.h"
#include "bindings/command/point_store.h"
#include "bindings/host/session.h"
#include "runtime/report/study.h"

namespace rapid {

// The source of a study's scenes.
struct StudySource {
    std::string file;
    bool is_graph = false;  // its knobs are arguments, NODE.PARAM; else a study file, which makes a scene of its knobs
    SessionOptions session;
    std::optional<std::uint64_t> seed;
    int threads = 0;
};

// Each tells one event, besides those of progress: {"failed": why, "refused": whether no frame was computed}, or
//
//   {"study": ...}  the description of the study file; for a graph, `asked` with its frames. Runs no scene.
//   {"kept": true}  the frames of the reference's scene are in `store`.
//   {"row": ...}    a row, read by read_row(); after each of its runs {"run": how many are done}.
void describe_study(const StudySource& source, const Study& asked, bool default_frames, const TellParent& tell);
void run_reference(const StudySource& source, const Study& study, const Knobs& knobs, PointStore& store,
                   const TellParent& tell);
// `store` has the reference's frames; it is not used where the study has a closed form.
void run_row(const StudySource& source, const Study& study, const Knobs& knobs, const PointStore& store,
             const TellParent& tell);

Study read_study(const nlohmann::json& event);
void read_row(const nlohmann::json& event, StudyRow& row);

}  // namespace rapid
