// Slurm, by its commands: sbatch, squeue, scancel.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bindings/command/farm_job.h"

namespace rapid {

// Error: what is missing of it.
void require_slurm();

// Submits the tasks of these numbers, from 1, as an array; returns its id. Error: what sbatch says.
std::int64_t submit_tasks(const FarmJob& job, const std::vector<std::size_t>& tasks);
// Submits the last one, which waits for jobs: "17", or "17_3" of an array.
std::int64_t submit_last(const FarmJob& job, const std::vector<std::string>& waits_for);

// What is queued or runs, of these jobs: its state and the reason ("PENDING", "Resources"), by job and number in an
// array; of a job that is none the number is 0.
struct QueuedTask {
    std::string state, reason;
};
using Queue = std::map<std::pair<std::int64_t, std::size_t>, QueuedTask>;
Queue queued(const std::vector<std::int64_t>& jobs);

void cancel(const std::vector<std::int64_t>& jobs);

// "1-3,7": of a list in order.
std::string ranges_of(const std::vector<std::size_t>& numbers);

}  // namespace rapid
