// What goes to a farm: tasks that do not need each other, each one command of this program, and one that comes last.
// And the file that keeps what was submitted, FARM.json beside the outputs, with a folder FARM of scripts and logs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace rapid {

struct FarmTask {
    std::string name;                // "part 03of16", "rate=1000"
    std::vector<std::string> words;  // of its own, behind those of all
};

struct FarmJob {
    std::string name;                // that squeue shows
    std::vector<std::string> words;  // of all tasks: {"run", "sparks.lua", "--frames=1-240"}
    std::vector<FarmTask> tasks;
    std::vector<std::vector<std::string>> last;  // the commands that come after all tasks, in one job
    bool last_needs_all = true;                  // it waits until all tasks have succeeded, else until all have ended
    std::vector<std::string> options;            // of sbatch, untouched
    std::filesystem::path folder;                // where the job was submitted, and runs
    std::filesystem::path outputs;               // where FARM.json goes

    std::filesystem::path file() const { return outputs / "FARM.json"; }
    std::filesystem::path scripts() const { return outputs / "FARM"; }
    std::string name_of_last() const { return last.empty() ? "" : last.front().front(); }
    // Where task number `task`, from 1, writes its exit status; 0: the last one.
    std::filesystem::path status_file(std::size_t task) const;
};

// The script of the array of the tasks, of which number k is SLURM_ARRAY_TASK_ID = k; and of the last one.
std::string script_of_tasks(const FarmJob& job, const std::string& program);
std::string script_of_last(const FarmJob& job, const std::string& program);

// A job that was submitted. Ids of Slurm, 0: never.
struct SubmittedJob {
    FarmJob job;
    std::vector<std::int64_t> arrays;  // by task: the array in which it was last submitted
    std::int64_t last = 0;

    // Error: the file can't be read, or is no such file.
    static SubmittedJob read(const std::filesystem::path& file);
    void write() const;
};

// The exit status that a task has written. Nothing if it has not ended.
std::optional<int> read_status(const std::filesystem::path& status_file);

}  // namespace rapid
