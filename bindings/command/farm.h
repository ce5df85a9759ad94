// --farm: submits to a scheduler what would be run here. `rapid farm` tells what became of it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bindings/command/farm_job.h"
#include "bindings/command_line/command.h"

namespace rapid {

class FarmOptions {
public:
    void declare(Options& options);

    // Error: an option that needs --farm without it.
    void check() const;
    bool asked() const { return !farm_.empty(); }

    // The arguments of the command, as they were given: without those above, without --threads, and without `others`.
    std::vector<std::string> words(const Options& options, const std::vector<std::string>& others) const;

    // Submits the job and tells its ids; with --dry-run prints its scripts. Error: no Slurm; what sbatch says; a job of
    // the same folder that still runs.
    int submit(FarmJob job) const;

private:
    std::string farm_;
    std::vector<std::string> options_;
    bool dry_run_ = false;
};

}  // namespace rapid
