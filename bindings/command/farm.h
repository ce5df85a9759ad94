// Implements --farm, which submits the work to a scheduler. `rapid farm` reports its state.
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

    // Throws Error if an option that needs --farm is given without it.
    void check() const;
    bool requested() const { return !farm_.empty(); }

    // Returns the arguments of the command as given, without those above, without --threads, and without `others`.
    std::vector<std::string> words(const Options& options, const std::vector<std::string>& others) const;

    // Submits the job and prints its ids; with --dry-run prints its scripts. Throws Error if Slurm is missing, if
    // sbatch fails (with its message), or if a job of the same folder is still running.
    int submit(FarmJob job) const;

private:
    std::string farm_;
    std::vector<std::string> options_;
    bool dry_run_ = false;
};

}  // namespace rapid
