#include "bindings/command/farm.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <utility>

#include "bindings/command/processes.h"
#include "bindings/command_line/programs.h"
#include "runtime/base/json.h"
#include "runtime/files/input_file.h"
#include "runtime/files/start_program.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Slurm's commands: sbatch, squeue, scancel.

// Returns its standard output. Throws Error with its message if it fails.
std::string standard_output_of(const std::vector<std::string>& words)
{
    const ProgramOutput output = output_of(words);
    if (output.status == 0) return output.out;
    throw Error(fmt::format("{} failed with status {}: {}", words.front(), output.status, output.errors));
}

std::int64_t submit(const FarmJob& job, const fs::path& script, std::vector<std::string> words)
{
    words.insert(words.begin(), {"sbatch", "--parsable"});
    words.insert(words.end(), job.options.begin(), job.options.end());
    words.push_back(script.string());
    const std::string said = standard_output_of(words);  // "17", or "17;CLUSTER"
    std::int64_t id = 0;
    const auto parsed = std::from_chars(said.data(), said.data() + said.size(), id);
    if (parsed.ec != std::errc() || id <= 0)
        throw Error(fmt::format("sbatch printed \"{}\" instead of the id of a job", said));
    return id;
}

// Returns the ids of the submitted jobs, without duplicates.
std::set<std::int64_t> jobs_of(const SubmittedJob& submitted)
{
    std::set<std::int64_t> jobs(submitted.arrays.begin(), submitted.arrays.end());
    jobs.insert(submitted.last);
    jobs.erase(jobs.begin(), jobs.upper_bound(0));
    return jobs;
}

// Throws Error if a command of Slurm is missing.
void require_slurm()
{
    std::vector<std::string> missing;
    for (const char* program : {"sbatch", "squeue", "scancel"})
        if (program_path(program).empty()) missing.emplace_back(program);
    if (!missing.empty())
        throw Error(
            fmt::format("--farm slurm: {} {} not on the PATH; install slurm-client, or see the scripts with --dry-run",
                        fmt::join(missing, " and "), missing.size() == 1 ? "is" : "are"));
}

// Returns sorted numbers as "1-3,7".
std::string ranges_of(const std::vector<std::size_t>& numbers)
{
    std::vector<std::string> ranges;
    for (std::size_t begin = 0, end = 1; begin < numbers.size(); begin = end++) {
        while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
        ranges.push_back(end == begin + 1 ? fmt::format("{}", numbers[begin])
                                          : fmt::format("{}-{}", numbers[begin], numbers[end - 1]));
    }
    return fmt::format("{}", fmt::join(ranges, ","));
}

// Submits tasks by number, from 1, as an array, and returns its id.
std::int64_t submit_tasks(const FarmJob& job, const std::vector<std::size_t>& tasks)
{
    return submit(job, job.scripts() / "tasks.sh", {"--array=" + ranges_of(tasks)});
}

// Submits the last job, which waits for others: "17", or "17_3" of an array.
std::int64_t submit_last(const FarmJob& job, const std::vector<std::string>& waits_for)
{
    std::vector<std::string> words;
    if (!waits_for.empty())
        words.push_back(
            fmt::format("--dependency={}:{}", job.last_needs_all ? "afterok" : "afterany", fmt::join(waits_for, ":")));
    return submit(job, job.scripts() / "last.sh", std::move(words));
}

// The state and reason ("PENDING", "Resources") of a queued or running task, by job and number in an array; the number
// is 0 outside of arrays.
struct QueuedTask {
    std::string state, reason;
};
using Queue = std::map<std::pair<std::int64_t, std::size_t>, QueuedTask>;
Queue queued(const std::set<std::int64_t>& jobs)
{
    Queue queue;
    if (jobs.empty()) return queue;
    // squeue complains about jobs that Slurm has forgotten; they are not queued.
    const ProgramOutput output = output_of(
        {"squeue", "--noheader", "--array", "--format=%F|%K|%T|%r", "--jobs", fmt::format("{}", fmt::join(jobs, ","))});
    if (output.status != 0 && output.errors.find("Invalid job id") == std::string::npos)
        throw Error(fmt::format("squeue failed with status {}: {}", output.status, output.errors));
    std::istringstream lines(output.out);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream fields(line);
        std::string job, task, state, reason;
        std::getline(fields, job, '|');
        std::getline(fields, task, '|');
        std::getline(fields, state, '|');
        std::getline(fields, reason, '|');
        std::int64_t id = 0;
        std::size_t number = 0;
        std::from_chars(job.data(), job.data() + job.size(), id);
        std::from_chars(task.data(), task.data() + task.size(), number);  // "N/A" outside of arrays
        queue[{id, number}] = {state, reason};
    }
    return queue;
}

void cancel(const std::set<std::int64_t>& jobs)
{
    std::vector<std::string> words = {"scancel"};
    for (const std::int64_t job : jobs) words.push_back(fmt::format("{}", job));
    if (words.size() > 1) standard_output_of(words);
}

// Splits a text into words as a shell does at spaces; a part in quotes is one word.
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

// Throws Error if tasks of a job in this folder are still queued or running.
void require_free(const FarmJob& job)
{
    std::error_code none;
    if (!fs::exists(job.file(), none)) return;
    const SubmittedJob before = SubmittedJob::read(job.file());
    if (const Queue queue = queued(jobs_of(before)); !queue.empty())
        throw Error(
            fmt::format("{} tasks of the job in {} are queued or running; wait for them, or run `rapid farm cancel {}`",
                        queue.size(), job.file().string(), job.file().string()));
}

// rapid farm: reports the state of a job that --farm submitted.

// Lost: neither queued nor ended, for example because it was cancelled before it ran.
enum class JobStage { Done, Failed, Running, Waiting, Lost };
constexpr std::string_view state_names[] = {"done", "failed", "running", "waiting", "lost"};

struct TaskState {
    JobStage state;
    std::string why;  // of Failed and Waiting
};

TaskState state_of(const Queue& queue, std::int64_t job, std::size_t number, const fs::path& status)
{
    if (const auto found = queue.find({job, number}); found != queue.end()) {
        const auto& [state, reason] = found->second;
        if (state == "RUNNING" || state == "COMPLETING") return {JobStage::Running, ""};
        return {JobStage::Waiting, reason};
    }
    const std::optional<int> code = read_status(status);
    if (!code) return {JobStage::Lost, ""};
    if (*code == 0) return {JobStage::Done, ""};
    return {JobStage::Failed, *code > 128 ? fmt::format("signal {}", *code - 128) : fmt::format("status {}", *code)};
}

class Farm : public Command {
public:
    std::string name() const override { return "farm"; }
    std::string doc() const override
    {
        return "reports on jobs on a farm, cancels them, and repeats failed and lost tasks";
    }

    void declare(Options& options) override
    {
        options.add_option("ACTION", action_, "status, cancel or retry")
            .type_name("")
            .required()
            .one_of({"status", "cancel", "retry"});
        options.add_option("FILE", file_, "FARM.json, which --farm has written next to the outputs")
            .type_name("")
            .required();
        options.add_flag("--json", json_, "with status: as JSON");
    }

    int run(const CommonOptions&) override
    {
        if (json_ && action_ != "status") throw Error("--json belongs to status; remove it");
        SubmittedJob submitted = SubmittedJob::read(file_);
        require_slurm();
        const std::vector<TaskState> states = states_of(submitted);
        if (action_ == "status") return report(submitted, states);
        return action_ == "cancel" ? cancel_all(submitted, states) : retry(submitted, states);
    }

private:
    // Returns the states of the tasks, then of the last job.
    static std::vector<TaskState> states_of(const SubmittedJob& submitted)
    {
        const Queue queue = queued(jobs_of(submitted));
        std::vector<TaskState> states;
        for (std::size_t k = 0; k < submitted.arrays.size(); ++k)
            states.push_back(state_of(queue, submitted.arrays[k], k + 1, submitted.job.status_file(k + 1)));
        states.push_back(state_of(queue, submitted.last, 0, submitted.job.status_file(0)));
        return states;
    }

    static bool is_open(const TaskState& task)
    {
        return task.state == JobStage::Running || task.state == JobStage::Waiting;
    }

    // Returns status 1 if a task has failed or is lost.
    int report(const SubmittedJob& submitted, const std::vector<TaskState>& states) const
    {
        const FarmJob& job = submitted.job;
        const std::size_t count = job.tasks.size() + !job.last.empty();
        std::map<JobStage, std::size_t> counts;
        JsonText json(2);
        json.begin_object();
        json.member("name", job.name);
        json.key("tasks");
        json.begin_list();
        std::string lines;
        for (std::size_t k = 0; k < count; ++k) {
            const bool is_last = k == job.tasks.size();
            const std::string name = is_last ? job.name_of_last() : job.tasks[k].name;
            const std::int64_t id = is_last ? submitted.last : submitted.arrays[k];
            const std::string log =
                (job.scripts() / (is_last ? std::string("last.log") : fmt::format("{}.log", k + 1))).string();
            const TaskState& task = states[k];
            ++counts[task.state];
            const std::string_view state = state_names[static_cast<std::size_t>(task.state)];
            json.object("name", name, "job", id, "state", state, "why", task.why, "log", log);
            if (task.state == JobStage::Failed || task.state == JobStage::Lost)
                lines += fmt::format("{}: {}{}{}, {}\n", name, state, task.why.empty() ? "" : ", ", task.why, log);
        }
        std::vector<std::string> summary;
        for (const auto& [state, number] : counts)
            summary.push_back(fmt::format("{} {}", number, state_names[static_cast<std::size_t>(state)]));
        json.end();
        json.end();
        if (json_)
            print(json.text() + '\n');
        else
            print(fmt::format("{}: {} tasks: {}\n{}", job.name, count, fmt::join(summary, ", "), lines));
        return counts[JobStage::Failed] + counts[JobStage::Lost] > 0 ? status_failed : status_done;
    }

    static int cancel_all(const SubmittedJob& submitted, const std::vector<TaskState>& states)
    {
        cancel(jobs_of(submitted));
        print(fmt::format("{} tasks cancelled\n", std::count_if(states.begin(), states.end(), is_open)));
        return status_done;
    }

    static int retry(SubmittedJob& submitted, const std::vector<TaskState>& states)
    {
        std::vector<std::size_t> again;
        for (std::size_t k = 0; k < submitted.arrays.size(); ++k)
            if (states[k].state == JobStage::Failed || states[k].state == JobStage::Lost) again.push_back(k + 1);
        const bool has_last = !submitted.job.last.empty();
        const TaskState& last = states.back();
        if (again.empty() && (!has_last || is_open(last) || last.state == JobStage::Done)) {
            print("nothing has failed\n");
            return status_done;
        }
        std::vector<std::string> waits_for;
        for (std::size_t k = 0; k < submitted.arrays.size(); ++k)
            if (is_open(states[k])) waits_for.push_back(fmt::format("{}_{}", submitted.arrays[k], k + 1));
        if (!again.empty()) {
            for (const std::size_t task : again) fs::remove(submitted.job.status_file(task));
            const std::int64_t array = submit_tasks(submitted.job, again);
            for (const std::size_t task : again) submitted.arrays[task - 1] = array;
            submitted.write();
            waits_for.push_back(fmt::format("{}", array));
            print(fmt::format("job {}: {} tasks repeated: {}\n", array, again.size(), ranges_of(again)));
        }
        if (!has_last) return status_done;
        if (is_open(last)) cancel({submitted.last});  // it waits for tasks that have failed
        fs::remove(submitted.job.status_file(0));
        submitted.last = submit_last(submitted.job, waits_for);
        submitted.write();
        print(fmt::format("job {}: {}, after the others\n", submitted.last, submitted.job.name_of_last()));
        return status_done;
    }

    std::string action_, file_;
    bool json_ = false;
};
RAPID_COMMAND(Farm);

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
            "submits to a farm instead of running here: slurm")
        .type_name("slurm");
    options
        .add_repeated(
            "--farm-options",
            [this](const std::vector<std::string>& strings) {
                for (const std::string& text : strings)
                    for (std::string& word : split_words(text)) options_.push_back(std::move(word));
            },
            "options that are passed to sbatch: \"-p fx -t 2:00:00\"")
        .type_name("OPTIONS")
        .one_value();
    options.add_flag("--dry-run", dry_run_, "with --farm: prints the scripts and submits nothing");
}

void FarmOptions::check() const
{
    if (requested()) return;
    if (!options_.empty()) throw Error("--farm-options needs --farm slurm");
    if (dry_run_) throw Error("--dry-run needs --farm slurm");
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
    submitted.write();  // records the submission, whatever happens next
    print(fmt::format("job {}: {} tasks\n", array, all.size()));
    if (!last.empty()) {
        submitted.last = submit_last(submitted.job, {fmt::format("{}", array)});
        submitted.write();
        print(fmt::format("job {}: {}, after the others\n", submitted.last, submitted.job.name_of_last()));
    }
    print(fmt::format("rapid farm status {}\n", submitted.job.file().string()));
    return status_done;
}

}  // namespace rapid
