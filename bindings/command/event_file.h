// The events of a run, as points in a file: --events.
#pragma once

#include <string>

#include "bindings/command/command.h"
#include "runtime/graph/evaluate.h"

namespace rapid {

class EventFile {
public:
    void declare(CLI::App& app);

    // Empty where nobody asks for it.
    const std::string& path() const { return path_; }
    // Error: no format that can be one file of points.
    void check() const;

    // The events of a frame, in the order of their times.
    void add(const FrameResult& result);
    // Writes the file.
    void finish() const;

private:
    std::string path_;
    PointSet events_;
};

}  // namespace rapid
