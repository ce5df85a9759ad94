#include "bindings/command/farm_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "bindings/command/slurm.h"
#include "bindings/command_line/programs.h"
#include "runtime/files/whole_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// The words of a text, as a shell splits them at spaces; a part in quotes is one word.
std::vector<std::string> split_words(const std::string& text)
{
    std::vector<std::string> words;
    std::string word;
    bool in_word = false;
    char quote = 0;
    for (const char c : text) {
        if (quote ? c == quote : c == '"' || c == '\'') {
            quote = quote ? '\0' : c;
            in_word = true;
        } else if (!quote && (c == ' ' || c == '\t' || c == '\n')) {
            if (in_word) words.push_back(std::exchange(word, {}));
            in_word = false;
        } else {
            word.push_back(c);
            in_word = true;
        }
    }
    if (quote) throw Error(fmt::format("--farm-options = \"{}\"; a {} is not closed", text, quote));
    if (in_word) words.push_back(word);
    return words;
}

// Error: tasks of a job of this folder are still to come, or run.
void require_free(const FarmJob& job)
{
    std::error_code none;
    if (!fs::exists(job.file(), none)) return;
    const SubmittedJob before = SubmittedJob::read(job.file());
    std::vector<std::int64_t> jobs = before.arrays;
    jobs.push_back(before.last);
    if (const Queue queue = queued(jobs); !queue.empty())
        throw Error(
            fmt::format("{} tasks of the job of {} are queued or run; wait for them, or give `rapid farm cancel "
                        "{}`",
                        queue.size(), job.file().string(), job.file().string()));
}

}  // namespace

void FarmOptions::declare(Options& options)
{
    options
        .add_option(
            "--farm",
            [this](const std::string& text) {
                if (text != "slurm") throw Error(fmt::format("--farm = \"{}\"; it must be slurm", text));
                farm_ = text;
            },
            "submits to a farm in place of running here: slurm")
        .type_name("slurm");
    options
        .add_repeated(
            "--farm-options",
            [this](const std::vector<std::string>& texts) {
                for (const std::string& text : texts)
                    for (std::string& word : split_words(text)) options_.push_back(std::move(word));
            },
            "options of sbatch, untouched: \"-p fx -t 2:00:00\"")
        .type_name("OPTIONS")
        .one_value();
    options.add_flag("--dry-run", dry_run_, "with --farm: prints the scripts, and submits nothing");
}

void FarmOptions::check() const
{
    if (asked()) return;
    if (!options_.empty()) throw Error("--farm-options are for --farm; give --farm slurm, too");
    if (dry_run_) throw Error("--dry-run is for --farm; give --farm slurm, too");
}

std::vector<std::string> FarmOptions::words(const Options& options, const std::vector<std::string>& others) const
{
    std::vector<std::string> skipped = {"--farm", "--farm-options", "--dry-run", "--threads", "--quiet"};
    skipped.insert(skipped.end(), others.begin(), others.end());
    return options.words(skipped);
}

int FarmOptions::submit(FarmJob job) const
{
    job.options = options_;
    job.folder = fs::current_path();
    job.outputs = fs::absolute(job.outputs).lexically_normal();
    const std::string program = command_file().string(), tasks = script_of_tasks(job, program);
    const std::string last = job.last.empty() ? std::string() : script_of_last(job, program);
    if (dry_run_) {
        print(fmt::format("# sbatch --array=1-{} {} {}\n{}", job.tasks.size(), fmt::join(job.options, " "),
                          (job.scripts() / "tasks.sh").string(), tasks));
        if (!last.empty())
            print(fmt::format("\n# sbatch --dependency={}:JOB {} {}\n{}", job.last_needs_all ? "afterok" : "afterany",
                              fmt::join(job.options, " "), (job.scripts() / "last.sh").string(), last));
        return status_done;
    }
    require_slurm();
    require_free(job);
    fs::remove_all(job.scripts());
    write_whole(job.scripts() / "tasks.sh", tasks);
    if (!last.empty()) write_whole(job.scripts() / "last.sh", last);

    SubmittedJob submitted{std::move(job), {}, 0};
    std::vector<std::size_t> all(submitted.job.tasks.size());
    std::iota(all.begin(), all.end(), std::size_t{1});
    const std::int64_t array = submit_tasks(submitted.job, all);
    submitted.arrays.assign(all.size(), array);
    submitted.write();  // what is submitted is known, whatever happens next
    print(fmt::format("job {}: {} tasks\n", array, all.size()));
    if (!last.empty()) {
        submitted.last = submit_last(submitted.job, {fmt::format("{}", array)});
        submitted.write();
        print(fmt::format("job {}: {}, when they are done\n", submitted.last, submitted.job.name_of_last()));
    }
    print(fmt::format("rapid farm status {}\n", submitted.job.file().string()));
    return status_done;
}

}  // namespace rapid
