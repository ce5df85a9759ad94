// --part and --sample: some of the points.
#pragma once

#include <optional>
#include <string>

#include "bindings/command/command.h"
#include "runtime/points/subset.h"

namespace rapid {

class PartOptions {
public:
    void declare(CLI::App& app);

    const std::optional<Part>& part() const { return part_; }
    const std::optional<double>& sample() const { return sample_; }
    Subset subset() const { return {part_, sample_}; }

private:
    std::optional<Part> part_;
    std::optional<double> sample_;
};

constexpr int most_parts = 100000;

// "03of16": the number as wide as the count, so that names are in order.
std::string name_of(const Part& part);

}  // namespace rapid
