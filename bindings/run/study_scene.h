// A scene of a study, at the knobs of a row or of the reference.
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

// The source of a study's scenes.
struct StudySource {
    std::string file;  // a study file, which makes a scene from its knobs (docs/lua-api.md), or a scene
    bool is_scene = false;
    SessionOptions session;  // all except the knobs
    std::optional<std::uint64_t> seed;
};

// Returns the study of a study file. Throws Error if the file is wrong.
Study read_study(const StudySource& source);

class StudyScene {
public:
    // Runs the file. The study must outlive this object. Throws Error if the file or a knob is wrong.
    StudyScene(const Study& study, const StudySource& source, const Knobs& knobs);

    std::int64_t first_frame() const { return Plan(graph_, {seed_, {}}).first_frame(); }

    // Both report the number of completed runs: 0 before the first frame. They throw Error if frames precede the
    // scene's first, if no output can be compared, if a frame fails, or if the error is not a number.
    using Progress = std::function<void(int runs)>;

    // Replaces the contents of the log with the frames that are compared.
    void keep_frames(RecordLog& log, const Progress& progress) const;
    // Runs it once to measure the error, then for the time, as often as the study requests. reference: null if the
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
