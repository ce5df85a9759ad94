// A job for a farm: independent tasks, each one command of this program, and a last one. The file FARM.json next to the
// outputs records the submission; a folder FARM holds scripts and logs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace rapid {

struct FarmTask {
    std::string name;                // "part 03of16", "rate=1000"
    std::vector<std::string> words;  // its own, appended to the common ones
};

struct FarmJob {
    std::string name;                // that squeue shows
    std::vector<std::string> words;  // of all tasks: {"run", "sparks.lua", "--frames=1-240"}
    std::vector<FarmTask> tasks;
    std::vector<std::vector<std::string>> last;  // the commands that come after all tasks, in one job
    bool last_needs_all = true;                  // waits until all tasks have succeeded, else until all have ended
    std::vector<std::string> options;            // of sbatch, passed on unchanged
    std::filesystem::path folder;                // where the job was submitted, and runs
    std::filesystem::path outputs;               // where FARM.json goes

    std::filesystem::path file() const { return outputs / "FARM.json"; }
    std::filesystem::path scripts() const { return outputs / "FARM"; }
    std::string name_of_last() const { return last.empty() ? "" : last.front().front(); }
    // Returns the file for the exit status of task number `task`, from 1; 0: the last one.
    std::filesystem::path status_file(std::size_t task) const;
};

// Return the script of the array of tasks, in which number k is SLURM_ARRAY_TASK_ID = k; and of the last job.
std::string script_of_tasks(const FarmJob& job, const std::string& program);
std::string script_of_last(const FarmJob& job, const std::string& program);

// A submitted job, with Slurm's ids; 0: never submitted.
struct SubmittedJob {
    FarmJob job;
    std::vector<std::int64_t> arrays;  // by task: the array in which it was last submitted
    std::int64_t last = 0;

    // Throws Error if the file cannot be read, or is not such a file.
    static SubmittedJob read(const std::filesystem::path& file);
    void write() const;
};

// Returns the exit status that a task has written, or nothing if it has not ended.
std::optional<int> read_status(const std::filesystem::path& status_file);

}  // namespace rapid
