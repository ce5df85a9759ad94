// Options --part and --sample, which select some of the points.
#pragma once

#include <optional>

#include "bindings/command_line/command.h"
#include "include/rapid/run.h"

namespace rapid {

class PartOptions {
public:
    void declare(Options& options);

    const std::optional<RunPart>& part() const { return part_; }
    const std::optional<double>& sample() const { return sample_; }

private:
    std::optional<RunPart> part_;
    std::optional<double> sample_;
};

}  // namespace rapid
