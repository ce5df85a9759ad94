// The events of a run, as points in a file: --events.
#pragma once

#include <optional>
#include <string>

#include "bindings/command/command.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/point_file.h"

namespace rapid {

class EventFile {
public:
    void declare(CLI::App& app);

    // Empty where nobody asks for it.
    const std::string& path() const { return path_; }
    // The events of a part of the points, "03of16".
    void take_part(const std::string& part);
    // Before the first frame. Error: no format that can be one file of points; a file that can't be written.
    void begin();

    // The events of a frame, in the order of their times.
    void add(const FrameResult& result);
    // From now on all events are kept in memory, too.
    void keep_all();
    // Of all frames so far, where they are kept.
    const PointSet& events() const { return *kept_; }
    // Those of frames that are not computed again: before the first that is.
    void set_events(PointSet events);
    // Names the file, which there is not before.
    void finish();

private:
    void check() const;

    std::string path_;
    std::optional<PointFile> file_;
    std::optional<PointSet> kept_;
};

}  // namespace rapid
