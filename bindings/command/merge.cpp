// rapid merge: puts the parts of a run together.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <set>

#include "bindings/command/command.h"
#include "bindings/command/untrusted.h"
#include "bindings/run/part_record.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/first_error.h"
#include "runtime/frame.h"
#include "runtime/io/format.h"
#include "runtime/io/merge_parts.h"
#include "runtime/points/column_files.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Bytes of a frame's files beyond which its points are not all held in memory, and of them that then are.
constexpr std::uintmax_t most_in_memory = 24 << 20;
constexpr std::size_t resident = 32 << 20;

// Bytes of the files of parts that are read at the same time; in memory they take several times as much.
constexpr std::uintmax_t most_read_at_once = 48 << 20;

// Parts or frames that are said to be missing; a record of others may promise any number.
constexpr std::size_t most_missing = 1000;

// One part: its sequence, and what is known of it.
struct PartFiles {
    std::string text;  // the pattern
    PartRecord record;
    std::map<int, fs::path> frames;
};

// "1-3, 7": frames that follow each other by a step of the run.
std::string list_of_frames(const std::vector<int>& frames, std::int64_t step)
{
    std::vector<std::string> runs;
    for (std::size_t begin = 0, end = 1; begin < frames.size(); begin = end++) {
        while (end < frames.size() && frames[end] == frames[end - 1] + step) ++end;
        runs.push_back(end == begin + 1 ? fmt::format("{}", frames[begin])
                                        : fmt::format("{}-{}", frames[begin], frames[end - 1]));
    }
    return fmt::format("{}", fmt::join(runs, ", "));
}

// The patterns that {part} stands for: those of which there is a record, in order of name.
std::vector<std::string> found_parts(const std::string& pattern)
{
    constexpr std::string_view variable = "{part}";
    const fs::path record = part_record_file(pattern);
    const std::string name = record.filename().string();
    const std::size_t at = name.find(variable);
    if (at == std::string::npos)
        throw Error("{part} must be in the name of the files, not of their folder").at({pattern, 0});
    const std::string prefix = name.substr(0, at), suffix = name.substr(at + variable.size());
    std::vector<std::string> found;
    std::error_code none;
    const fs::path folder = folder_of(record);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
        const std::string other = entry.path().filename().string();
        if (other.size() <= prefix.size() + suffix.size() || !other.starts_with(prefix) || !other.ends_with(suffix))
            continue;
        const std::string part = other.substr(prefix.size(), other.size() - prefix.size() - suffix.size());
        if (part.find_first_not_of("0123456789of") == std::string::npos) found.push_back(with_part(pattern, part));
    }
    std::sort(found.begin(), found.end());
    if (found.empty())
        throw Error(fmt::format("no complete part of this name is there; each has a file such as {}",
                                part_record_file(with_part(pattern, "1of2")).string()))
            .at({pattern, 0});
    return found;
}

class Merge : public Command, public Confined {
public:
    std::string name() const override { return "merge"; }
    std::string doc() const override { return "puts the parts of a run together, bit for bit as the whole run"; }

    void declare(CLI::App& app) override
    {
        app.add_option("-o,--output", output_, "the files of the whole: #### is the frame's number")
            ->type_name("WHOLE")
            ->required();
        app.add_option("PART", texts_, "the files of each part, as -o of run had them; {part} stands for all parts")
            ->type_name("")
            ->required();
        app.add_flag("--quiet", quiet_, "says nothing but errors");
        untrusted_.declare(app, "file");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine(
            [&] {
                SandboxAccess access;
                for (const std::string& text : texts_) access.readable.push_back(folder_of(text));
                access.writable.push_back(folder_of(output_));
                fs::create_directories(access.writable.back());
                return access;
            },
            common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const std::vector<PartFiles> parts = find_parts();
            check_output(parts);
            try {
                return merge(parts);
            } catch (const Error& error) {
                print_error(error, common.verbose);
                return static_cast<int>(status_failed);
            }
        });
    }

private:
    // In order of their numbers. Error: what is missing, doubled or does not fit, all of it.
    std::vector<PartFiles> find_parts() const
    {
        std::vector<std::string> patterns;
        for (const std::string& text : texts_) {
            const std::vector<std::string> found = has_part(text) ? found_parts(text) : std::vector{text};
            patterns.insert(patterns.end(), found.begin(), found.end());
        }
        std::vector<std::string> problems;
        std::map<int, PartFiles> parts;
        std::string first;  // the text of the part that the others are compared with
        const PartRecord* with = nullptr;
        for (const std::string& pattern : patterns) {
            const fs::path file = part_record_file(pattern);
            std::error_code none;
            if (!fs::exists(file, none)) {
                problems.push_back(
                    fmt::format("{} is no complete part: {} is not there, which run --part writes at its end", pattern,
                                file.string()));
                continue;
            }
            PartFiles part{pattern, PartRecord::read(file), {}};
            if (with)
                if (const std::string found = difference(*with, part.record); !found.empty())
                    problems.push_back(fmt::format("{} is of another run than {}: {}", pattern, first, found));
            const int number = part.record.part.number;
            const auto [place, is_new] = parts.emplace(number, std::move(part));
            if (!is_new)
                problems.push_back(
                    fmt::format("part {} is there twice: {} and {}",
                                part_name(place->second.record.part.number, place->second.record.part.count),
                                place->second.text, pattern));
            if (!with) with = &place->second.record, first = pattern;
        }
        if (with) find_missing(parts, with->part.count, problems);
        for (auto& [number, part] : parts) find_frames(part, problems);
        if (!problems.empty()) throw Error(fmt::format("the parts are no whole: {}", fmt::join(problems, "; ")));
        std::vector<PartFiles> result;
        for (auto& [number, part] : parts) result.push_back(std::move(part));
        return result;
    }

    static void find_missing(const std::map<int, PartFiles>& parts, int count, std::vector<std::string>& problems)
    {
        std::vector<std::string> missing;
        for (int number = 1; number <= count; ++number)
            if (!parts.count(number) && missing.size() <= most_missing) missing.push_back(part_name(number, count));
        if (missing.size() > most_missing) missing.back() = "and more";
        if (!missing.empty())
            problems.push_back(
                fmt::format("missing {} {}", missing.size() == 1 ? "is part" : "are parts", fmt::join(missing, ", ")));
    }

    static void find_frames(PartFiles& part, std::vector<std::string>& problems)
    {
        const FrameSelection& wanted = part.record.frames;
        const FramePattern pattern(part.text);
        std::vector<int> missing;
        std::error_code none;
        for (std::int64_t frame = wanted.first; frame <= wanted.last; frame += wanted.step) {
            const int number = static_cast<int>(frame);
            const fs::path path = pattern.expand(number);
            if (fs::exists(path, none))
                part.frames.emplace(number, path);
            else
                missing.push_back(number);
            if (missing.size() == most_missing) break;
        }
        if (!missing.empty())
            problems.push_back(fmt::format(
                "of {} {} missing: {}{}", part.text, missing.size() == 1 ? "a frame is" : "frames are",
                list_of_frames(missing, wanted.step), missing.size() == most_missing ? ", and maybe more" : ""));
    }

    void check_output(const std::vector<PartFiles>& parts) const
    {
        const Format& format = format_of(output_);
        if (!format.read || format.film || format.places_alone)
            throw Error(fmt::format("-o {}: a {} file holds no points; merge to a format that does", output_,
                                    format.extension));
        for (const PartFiles& part : parts)
            if (const Format& own = format_of(part.text); !own.read || own.places_alone)
                throw Error(fmt::format("{}: a {} file holds no points that could be read", part.text, own.extension));
        const FramePattern pattern(output_);
        if (parts.front().frames.size() > 1 && !pattern.has_frame())
            throw Error(
                fmt::format("-o {}: several frames go to one file; put the frame's number into its name, as "
                            "####",
                            output_));
        std::error_code none;
        for (const PartFiles& part : parts)
            for (const auto& [frame, path] : part.frames)
                if (fs::equivalent(pattern.expand(frame), path, none))
                    throw Error(fmt::format("-o {}: would replace {}, a part; give the whole another name", output_,
                                            path.string()));
    }

    int merge(const std::vector<PartFiles>& parts) const
    {
        std::uint64_t points = 0;
        for (const auto& [frame, path] : parts.front().frames) points += merge_frame(parts, frame);
        if (!quiet_)
            print(fmt::format("{} frames of {} parts, {} points: {}\n", parts.front().frames.size(), parts.size(),
                              points, output_));
        return status_done;
    }

    // One or several at the same time: .vdb is read by processes of one thread (read_apart.h).
    static std::vector<PointSet> read_parts(const std::vector<std::string>& files, bool into_files)
    {
        std::vector<PointSet> parts(files.size());
        std::error_code none;
        for (std::size_t first = 0, end = 0; first < files.size(); first = end) {
            std::uintmax_t bytes = fs::file_size(files[end++], none);
            while (end < files.size() && (bytes += fs::file_size(files[end], none)) <= most_read_at_once) ++end;
            FirstError error;
            std::optional<ColumnFiles::Pause> pause(std::in_place);
            tbb::parallel_for(first, end,
                              [&](std::size_t k) { error.guard(0, k, [&] { parts[k] = read_points(files[k]); }); });
            error.rethrow();
            pause.reset();
            if (into_files)
                for (std::size_t k = first; k < end; ++k) parts[k] = ColumnFiles::moved(std::move(parts[k]));
        }
        return parts;
    }

    std::uint64_t merge_frame(const std::vector<PartFiles>& parts, int frame) const
    {
        const std::string path = FramePattern(output_).expand(frame);
        std::uintmax_t bytes = 0;
        std::error_code none;
        for (const PartFiles& part : parts) bytes += fs::file_size(part.frames.at(frame), none);
        fs::create_directories(folder_of(path), none);
        std::optional<ColumnFiles> columns;
        if (bytes > most_in_memory) columns.emplace(folder_of(path), resident);

        std::vector<std::string> names;
        for (const PartFiles& part : parts) names.push_back(part.frames.at(frame).string());
        std::vector<PointSet> read = read_parts(names, columns.has_value());
        const PointSet whole = merge_parts(read, names);
        read.clear();
        const PartRecord& record = parts.front().record;
        FrameInfo info;
        info.number = frame;
        info.time = FrameClock{record.fps, record.start}.at(frame).time;
        info.fps = record.fps;
        write_points(path, whole, info);
        return whole.size();
    }

    std::string output_;
    std::vector<std::string> texts_;
    bool quiet_ = false;
    UntrustedOptions untrusted_;
};
RAPID_COMMAND(Merge);

}  // namespace
}  // namespace rapid
