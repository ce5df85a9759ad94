// rapid farm: what became of a job that --farm submitted.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "bindings/command/farm_job.h"
#include "bindings/command/slurm.h"
#include "bindings/command_line/command.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Lost: neither queued nor ended, as when it was cancelled before it ran.
enum class State { Done, Failed, Running, Waiting, Lost };
constexpr std::string_view state_names[] = {"done", "failed", "running", "waiting", "lost"};

struct TaskState {
    State state;
    std::string why;  // of Failed and Waiting
};

std::optional<int> ended_with(const fs::path& status)
{
    std::error_code none;
    if (!fs::is_regular_file(status, none)) return {};  // reading a pipe would wait
    std::ifstream file(status);
    int code = 0;
    if (!(file >> code)) return {};
    return code;
}

TaskState state_of(const Queue& queue, std::int64_t job, std::size_t number, const fs::path& status)
{
    if (const auto found = queue.find({job, number}); found != queue.end()) {
        const auto& [state, reason] = found->second;
        if (state == "RUNNING" || state == "COMPLETING") return {State::Running, ""};
        return {State::Waiting, reason};
    }
    const std::optional<int> code = ended_with(status);
    if (!code) return {State::Lost, ""};
    if (*code == 0) return {State::Done, ""};
    return {State::Failed, *code > 128 ? fmt::format("signal {}", *code - 128) : fmt::format("status {}", *code)};
}

class Farm : public Command {
public:
    std::string name() const override { return "farm"; }
    std::string doc() const override { return "tells of jobs on a farm, cancels them, and runs again what is missing"; }

    void declare(Options& options) override
    {
        options.add_option("ACTION", action_, "status, cancel or retry")
            .type_name("")
            .required()
            .one_of({"status", "cancel", "retry"});
        options.add_option("FILE", file_, "FARM.json, which --farm has written beside the outputs")
            .type_name("")
            .required();
        options.add_flag("--json", json_, "with status: as JSON");
    }

    int run(const CommonOptions&) override
    {
        if (json_ && action_ != "status") throw Error("--json is for status; leave it out");
        SubmittedJob submitted = SubmittedJob::read(file_);
        require_slurm();
        const std::vector<TaskState> states = states_of(submitted);
        if (action_ == "status") return tell(submitted, states);
        return action_ == "cancel" ? cancel_all(submitted, states) : retry(submitted, states);
    }

private:
    // Of the tasks, then of the last one.
    static std::vector<TaskState> states_of(const SubmittedJob& submitted)
    {
        std::vector<std::int64_t> jobs = submitted.arrays;
        jobs.push_back(submitted.last);
        const Queue queue = queued(jobs);
        std::vector<TaskState> states;
        for (std::size_t k = 0; k < submitted.arrays.size(); ++k)
            states.push_back(state_of(queue, submitted.arrays[k], k + 1, submitted.job.status_file(k + 1)));
        states.push_back(state_of(queue, submitted.last, 0, submitted.job.status_file(0)));
        return states;
    }

    static bool is_open(const TaskState& task) { return task.state == State::Running || task.state == State::Waiting; }

    // Status 1 where something has failed or is lost.
    int tell(const SubmittedJob& submitted, const std::vector<TaskState>& states) const
    {
        const FarmJob& job = submitted.job;
        const std::size_t count = job.tasks.size() + !job.last.empty();
        std::map<State, std::size_t> counts;
        ordered_json tasks = ordered_json::array();
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
            tasks.push_back({{"name", name}, {"job", id}, {"state", state}, {"why", task.why}, {"log", log}});
            if (task.state == State::Failed || task.state == State::Lost)
                lines += fmt::format("{}: {}{}{}, {}\n", name, state, task.why.empty() ? "" : ", ", task.why, log);
        }
        std::vector<std::string> summary;
        for (const auto& [state, number] : counts)
            summary.push_back(fmt::format("{} {}", number, state_names[static_cast<std::size_t>(state)]));
        if (json_)
            print(ordered_json{{"name", job.name}, {"tasks", tasks}}.dump(2, ' ', false,
                                                                          ordered_json::error_handler_t::replace) +
                  '\n');
        else
            print(fmt::format("{}: {} tasks: {}\n{}", job.name, count, fmt::join(summary, ", "), lines));
        return counts[State::Failed] + counts[State::Lost] > 0 ? status_failed : status_done;
    }

    static int cancel_all(const SubmittedJob& submitted, const std::vector<TaskState>& states)
    {
        std::vector<std::int64_t> jobs = submitted.arrays;
        jobs.push_back(submitted.last);
        cancel(jobs);
        print(fmt::format("{} tasks cancelled\n", std::count_if(states.begin(), states.end(), is_open)));
        return status_done;
    }

    static int retry(SubmittedJob& submitted, const std::vector<TaskState>& states)
    {
        std::vector<std::size_t> again;
        for (std::size_t k = 0; k < submitted.arrays.size(); ++k)
            if (states[k].state == State::Failed || states[k].state == State::Lost) again.push_back(k + 1);
        const bool has_last = !submitted.job.last.empty();
        const TaskState& last = states.back();
        if (again.empty() && (!has_last || is_open(last) || last.state == State::Done)) {
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
            print(fmt::format("job {}: {} tasks again: {}\n", array, again.size(), ranges_of(again)));
        }
        if (!has_last) return status_done;
        if (is_open(last)) cancel({submitted.last});  // it waits for tasks that have failed
        fs::remove(submitted.job.status_file(0));
        submitted.last = submit_last(submitted.job, waits_for);
        submitted.write();
        print(fmt::format("job {}: {}, when they are done\n", submitted.last, submitted.job.name_of_last()));
        return status_done;
    }

    std::string action_, file_;
    bool json_ = false;
};
RAPID_COMMAND(Farm);

}  // namespace
}  // namespace rapid
