// Merges parts of runs.
#include "include/rapid/merge.h"

#include <atomic>

#include "bindings/run/run_parts.h"
#include "bindings/scene/scene_error.h"
#include "runtime/base/cancellation.h"

namespace rapid {

Result<MergedFiles> merge_files(const std::vector<std::string>& patterns, const std::string& output,
                                const std::function<bool(std::int64_t frame, std::uint64_t points)>& progress)
{
    static std::atomic<bool> is_running = false;  // its columns are those of the process
    if (is_running.exchange(true)) return busy();
    struct Ended {
        ~Ended() { is_running = false; }
    } const ended;
    SceneError::Kind kind = SceneError::WrongCall;
    try {
        if (patterns.empty()) refuse("no parts are given; give the patterns of their files");
        const RunParts parts(patterns);
        parts.check_output(output);
        kind = SceneError::FailedFrame;
        MergedFiles merged;
        merged.parts = parts.count();
        for (const int frame : parts.frames()) {
            const std::uint64_t points = parts.write_frame(frame, output);
            merged.points += points;
            ++merged.frames;
            if (progress && !call_program("progress", progress, frame, points)) throw Cancellation::cancelled();
        }
        return merged;
    } catch (...) {
        return caught_error(kind);
    }
}

}  // namespace rapid
