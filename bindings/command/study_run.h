// The work of a study in child processes (processes.h), each of which opens a scene, starts threads and runs scripts.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "bindings/command/processes.h"
#include "include/rapid/study.h"

namespace rapid {

// How the children run the scenes.
struct StudyChild {
    StudySource source;
    int threads = 0;
};

// Each tells one event, besides those of progress: {"failed": why, "refused": whether no frame was computed}, or
//
//   {"study": ...}  the description of the study file; for a scene, `asked` with its frames. Runs no scene.
//   {"kept": true}  the frames of the reference's scene are in `reference`.
//   {"row": ...}    a row, read by read_row(); after each of its runs {"run": how many are done}.
void describe_study(const StudyChild& child, const SceneStudy& asked, bool default_frames, const TellParent& tell);
void run_reference(const StudyChild& child, const SceneStudy& study, const StudyKnobs& knobs,
                   const StudyReference& reference, const TellParent& tell);
// reference: null where the study has none.
void run_row(const StudyChild& child, const SceneStudy& study, const StudyKnobs& knobs, const StudyReference* reference,
             const TellParent& tell);

SceneStudy read_study(const nlohmann::json& event);
StudyRun read_row(const nlohmann::json& event, StudyKnobs knobs);

}  // namespace rapid
