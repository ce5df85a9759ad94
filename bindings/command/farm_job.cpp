#include "bindings/command/farm_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr int job_version = 1;

// Returns a text as one word of the shell, quoted if necessary.
std::string shell_word(const std::string& text)
{
    constexpr std::string_view plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/@%";
    if (!text.empty() && text.find_first_not_of(plain) == std::string::npos) return text;
    std::string quoted(1, '\'');
    for (const char c : text) {
        if (c == '\'')
            quoted.append("'\\''");
        else
            quoted.push_back(c);
    }
    quoted.push_back('\'');
    return quoted;
}

std::string shell_words(const std::vector<std::string>& words)
{
    std::vector<std::string> quoted;
    for (const std::string& word : words) quoted.push_back(shell_word(word));
    return fmt::format("{}", fmt::join(quoted, " "));
}

bool limits_memory(const std::vector<std::string>& words)
{
    return std::any_of(words.begin(), words.end(),
                       [](const std::string& word) { return word.starts_with("--memory="); });
}

// Keeps a text in one line: a script's comment ends at a newline, and the rest would be executed.
std::string one_line(std::string text)
{
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, ' ');
    return text;
}

void check_one_line(const std::string& what, const std::string& text)
{
    if (one_line(text) != text) throw Error(fmt::format("--farm: {} \"{}\" has a control character", what, text));
}

// The script restarts a job that is preempted or whose node is lost. On SIGTERM, which all its processes get, this
// program ends by itself; the shell waits for it.
std::string head(const FarmJob& job, const std::string& log)
{
    check_one_line("the name of the job", job.name);
    check_one_line("the folder of the outputs", job.outputs.string());
    check_one_line("the current folder", job.folder.string());
    return fmt::format(
        "#!/bin/bash\n"
        "#SBATCH --job-name={}\n"
        "#SBATCH --output={}\n"
        "#SBATCH --open-mode=append\n"
        "#SBATCH --requeue\n"
        "#SBATCH --chdir={}\n",
        shell_word(job.name), shell_word((job.scripts() / log).string()), shell_word(job.folder.string()));
}

// Returns a script that runs commands of this program and records their exit status. The number of threads is
// --cpus-per-task if the job has that option, else the processors that Slurm assigned on the node.
std::string body(const std::string& status, const std::string& program, const std::vector<std::string>& commands)
{
    std::string text = fmt::format(
        "trap : TERM\nstatus={}\nrm -f \"$status\"\nended=0\n"
        "threads=${{SLURM_CPUS_PER_TASK:-$SLURM_CPUS_ON_NODE}}\n",
        status);
    for (const std::string& words : commands)
        text += fmt::format("{} {} ${{threads:+--threads=$threads}} || ended=$?\n", shell_word(program), words);
    return text + "echo $ended >\"$status.new\" && mv \"$status.new\" \"$status\"\nexit $ended\n";
}

}  // namespace

fs::path FarmJob::status_file(std::size_t task) const
{
    return scripts() / (task == 0 ? std::string("last.status") : fmt::format("{}.status", task));
}

std::optional<int> read_status(const fs::path& status_file)
{
    std::error_code none;
    if (!fs::is_regular_file(status_file, none)) return {};  // reading a pipe would block
    std::ifstream file(status_file);
    int status = 0;
    if (!(file >> status)) return {};
    return status;
}

std::string script_of_tasks(const FarmJob& job, const std::string& program)
{
    std::string text = head(job, "%a.log") + "case $SLURM_ARRAY_TASK_ID in\n";
    for (std::size_t k = 0; k < job.tasks.size(); ++k)
        text += fmt::format("{}) set -- {} ;;  # {}\n", k + 1, shell_words(job.tasks[k].words),
                            one_line(job.tasks[k].name));
    text += "esac\n";
    const std::string status = shell_word(job.scripts().string() + '/') + "$SLURM_ARRAY_TASK_ID.status";
    std::string words = shell_words(job.words) + " \"$@\"";
    // The job's share of the node's memory, in MiB.
    if (!limits_memory(job.words) && !limits_memory(job.tasks.front().words)) {
        text += "memory=${SLURM_MEM_PER_NODE:-${SLURM_MEM_PER_CPU:+$((SLURM_MEM_PER_CPU * SLURM_CPUS_ON_NODE))}}\n";
        words += " ${memory:+--memory=${memory}M}";
    }
    return text + body(status, program, {words});
}

std::string script_of_last(const FarmJob& job, const std::string& program)
{
    std::vector<std::string> commands;
    for (const std::vector<std::string>& words : job.last) commands.push_back(shell_words(words));
    return head(job, "last.log") + body(shell_word(job.status_file(0).string()), program, commands);
}

SubmittedJob SubmittedJob::read(const fs::path& file)
{
    try {
        const CheckedJson json = CheckedJson::parse(InputFile(file).text());
        if (const int version = json.at("rapid_farm").get<int>(); version != job_version)
            throw Error(fmt::format("has version {}; it must be {}", version, job_version));
        SubmittedJob submitted;
        FarmJob& job = submitted.job;
        job.name = json.at("name");
        job.words = json.at("command").get<std::vector<std::string>>();
        job.last = json.at("last").at("commands").get<std::vector<std::vector<std::string>>>();
        job.last_needs_all = json.at("last").at("needs_all");
        job.options = json.at("options").get<std::vector<std::string>>();
        job.folder = json.at("folder").get<std::string>();
        job.outputs = json.at("outputs").get<std::string>();
        submitted.last = json.at("last").at("job");
        for (const CheckedJson& task : json.at("tasks")) {
            job.tasks.push_back({task.at("name"), task.at("command").get<std::vector<std::string>>()});
            submitted.arrays.push_back(task.at("job"));
        }
        if (job.tasks.empty()) throw Error("has no tasks");
        return submitted;
    } catch (Error& error) {
        throw error.at({file.string(), 0});
    } catch (const CheckedJson::parse_error& error) {  // its text holds all of the unparsable input
        throw Error(fmt::format("is not a FARM.json: byte {} is not valid JSON", error.byte)).at({file.string(), 0});
    } catch (const CheckedJson::exception& error) {
        throw Error(fmt::format("is not a FARM.json: {}", error.what())).at({file.string(), 0});
    }
}

void SubmittedJob::write() const
{
    JsonText json(2);
    json.begin_object();
    json.members("rapid_farm", job_version, "name", job.name, "folder", job.folder.string(), "outputs",
                 job.outputs.string(), "options", job.options, "command", job.words);
    std::size_t number = 0;
    json.list("tasks", job.tasks, [&](const FarmTask& task) {
        const auto array = arrays[number];
        json.object("name", task.name, "command", task.words, "job", array, "number", ++number);
    });
    json.key("last");
    json.object("commands", job.last, "needs_all", job.last_needs_all, "job", last);
    json.end();
    write_whole(job.file(), json.text() + '\n');
}

}  // namespace rapid
