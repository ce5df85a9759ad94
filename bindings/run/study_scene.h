// A scene of a study: at the knobs of a row, or of the reference that rows are compared with.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "bindings/host/session.h"
#include "runtime/files/frame_archive.h"
#include "runtime/graph/plan.h"
#include "runtime/report/study.h"

namespace rapid {

class StudyScene {
public:
    // session: that of the graph's scripts, and of the study file. The study and the session live longer.
    StudyScene(const Study& study, const Session& session, Graph graph, std::optional<std::uint64_t> seed);

    // Both tell how many runs are done: 0 when the first frame is due. Error: frames before the scene's first; no
    // output that is to be compared; those of frames; no error that is a number.
    using Progress = std::function<void(int runs)>;

    // Replaces what the log has by the frames that are compared.
    void keep_frames(RecordLog& log, const Progress& progress) const;
    // Runs it once to measure the error, then for the time, as often as the study wants. reference: null where the
    // study needs none.
    StudyRow measure(const Knobs& knobs, const RecordLog* reference, const Progress& progress) const;

private:
    Plan plan() const;

    const Study& study_;
    const Session& session_;
    const Graph graph_;
    const std::optional<std::uint64_t> seed_;
};

}  // namespace rapid
