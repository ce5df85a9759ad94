// A scene of a study: at the knobs of a row, or of the reference that rows are compared with.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bindings/host/session.h"
#include "runtime/files/frame_archive.h"
#include "runtime/graph/plan.h"
#include "runtime/report/study.h"

namespace rapid {

// Where the scenes of a study come from.
struct StudySource {
    std::string file;  // a study file, which makes a scene of its knobs (docs/lua-api.md), or a scene
    bool is_scene = false;
    SessionOptions session;  // but the knobs
    std::optional<std::uint64_t> seed;
};

// The study of a study file. Error: the file is wrong.
Study read_study(const StudySource& source);

class StudyScene {
public:
    // Runs the file. The study lives longer. Error: the file or a knob is wrong.
    StudyScene(const Study& study, const StudySource& source, const Knobs& knobs);

    std::int64_t first_frame() const { return Plan(graph_, {seed_, {}}).first_frame(); }

    // Both tell how many runs are done: 0 when the first frame is due. Error: frames before the scene's first; no
    // output that is to be compared; those of frames; no error that is a number.
    using Progress = std::function<void(int runs)>;

    // Replaces what the log has by the frames that are compared.
    void keep_frames(RecordLog& log, const Progress& progress) const;
    // Runs it once to measure the error, then for the time, as often as the study wants. reference: null where the
    // study needs none.
    StudyRow measure(const RecordLog* reference, const Progress& progress) const;

private:
    Plan plan() const;

    const Study& study_;
    const Knobs knobs_;
    const Session session_;
    const Graph graph_;
    const std::optional<std::uint64_t> seed_;
};

}  // namespace rapid
