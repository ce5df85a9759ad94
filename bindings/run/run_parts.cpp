#include "bindings/run/run_parts.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>

#include "runtime/base/first_error.h"
#include "runtime/base/frame.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/io/format.h"
#include "runtime/io/merge_parts.h"
#include "runtime/points/column_files.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Bytes of a frame's files above which its points are not all held in memory, and bytes of points that then are.
constexpr std::uintmax_t max_in_memory = 24 << 20;
constexpr std::size_t resident = 32 << 20;

// Bytes of parts' files that are read at the same time; in memory they take several times as much.
constexpr std::uintmax_t max_read_at_once = 48 << 20;

// Missing parts or frames that are listed; a foreign record may promise any number.
constexpr std::size_t max_missing = 1000;

fs::path folder_above(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

// Returns "1-3, 7" for frames that follow each other by a step of the run.
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

// Returns the patterns that {part} stands for: those with a record, ordered by name.
std::vector<std::string> found_parts(const std::string& pattern)
{
    constexpr std::string_view variable = "{part}";
    const fs::path record = part_record_file(pattern);
    const std::string name = record.filename().string();
    const std::size_t at = name.find(variable);
    if (at == std::string::npos)
        throw Error("{part} must be in the name of the files, not in the name of their folder").at({pattern, 0});
    const std::string prefix = name.substr(0, at), suffix = name.substr(at + variable.size());
    std::vector<std::string> found;
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_above(record), none)) {
        const std::string other = entry.path().filename().string();
        if (other.size() <= prefix.size() + suffix.size() || !other.starts_with(prefix) || !other.ends_with(suffix))
            continue;
        const std::string part = other.substr(prefix.size(), other.size() - prefix.size() - suffix.size());
        if (part.find_first_not_of("0123456789of") == std::string::npos) found.push_back(with_part(pattern, part));
    }
    std::sort(found.begin(), found.end());
    if (found.empty())
        throw Error(fmt::format("there is no complete part with this name; each has a file such as {}",
                                part_record_file(with_part(pattern, "1of2")).string()))
            .at({pattern, 0});
    return found;
}

// Reads the file of a part. Throws Error if its bytes are not those that the part has written: it may belong to another
// run or frame, or lack its last points.
PointSet read_part(const std::string& file, const PartRecord::File& written)
{
    PointSet points = read_points(file);
    if (hash_text(file_hash(file)) != written.hash)
        throw Error(
            fmt::format("was changed after the part wrote it: it had {} points then and has {} now. Run the part again",
                        written.points, points.size()))
            .at({file, 0});
    return points;
}

// Reads the files of a frame, several at the same time: .vdb is read by processes of one thread (read_sandboxed.h).
std::vector<PointSet> read_parts(const std::vector<std::string>& files, const std::vector<PartRecord::File>& written,
                                 bool into_files)
{
    std::vector<PointSet> parts(files.size());
    std::error_code none;
    for (std::size_t first = 0, end = 0; first < files.size(); first = end) {
        std::uintmax_t bytes = fs::file_size(files[end++], none);
        while (end < files.size() && (bytes += fs::file_size(files[end], none)) <= max_read_at_once) ++end;
        FirstError error;
        std::optional<ColumnFiles::Pause> pause(std::in_place);
        tbb::parallel_for(
            first, end, [&](std::size_t k) { error.guard(0, k, [&] { parts[k] = read_part(files[k], written[k]); }); });
        error.rethrow();
        pause.reset();
        if (into_files)
            for (std::size_t k = first; k < end; ++k) parts[k] = ColumnFiles::moved(std::move(parts[k]));
    }
    return parts;
}

}  // namespace

RunParts::RunParts(const std::vector<std::string>& given)
{
    std::vector<std::string> patterns;
    for (const std::string& text : given) {
        const std::vector<std::string> found = has_part(text) ? found_parts(text) : std::vector{text};
        patterns.insert(patterns.end(), found.begin(), found.end());
    }
    std::vector<std::string> problems;
    std::map<int, PartFiles> parts;
    std::string first;  // the text of the part with which the others are compared
    const PartRecord* with = nullptr;
    for (const std::string& pattern : patterns) {
        const fs::path file = part_record_file(pattern);
        std::error_code none;
        if (!fs::exists(file, none)) {
            problems.push_back(fmt::format("{} is not a complete part: {} is missing, which run {} writes at the end",
                                           pattern, file.string(), name_of(Setting::Part)));
            continue;
        }
        PartFiles part{pattern, PartRecord::read(file), {}};
        if (with)
            if (const std::string found = difference(*with, part.record); !found.empty())
                problems.push_back(fmt::format("{} belongs to another run than {}: {}", pattern, first, found));
        const auto [number, count] = part.record.part;
        const auto [place, is_new] = parts.emplace(number, std::move(part));
        if (!is_new)
            problems.push_back(fmt::format("part {} appears twice: {} and {}",
                                           part_name(number, place->second.record.part.count), place->second.text,
                                           pattern));
        if (!with) with = &place->second.record, first = pattern;
    }
    if (with) find_missing(parts, with->part.count, problems);
    for (auto& [number, part] : parts) find_frames(part, problems);
    if (!problems.empty()) throw Error(fmt::format("the parts can't be merged: {}", fmt::join(problems, "; ")));
    for (auto& [number, part] : parts) parts_.push_back(std::move(part));
}

void RunParts::find_missing(const std::map<int, PartFiles>& parts, int count, std::vector<std::string>& problems)
{
    std::vector<std::string> missing;
    for (int number = 1; number <= count; ++number)
        if (!parts.count(number) && missing.size() <= max_missing) missing.push_back(part_name(number, count));
    if (missing.size() > max_missing) missing.back() = "and more";
    if (!missing.empty())
        problems.push_back(
            fmt::format("missing {} {}", missing.size() == 1 ? "is part" : "are parts", fmt::join(missing, ", ")));
}

void RunParts::find_frames(PartFiles& part, std::vector<std::string>& problems)
{
    const RunFrames& requested = part.record.frames;
    const FramePattern pattern(part.text);
    std::vector<int> missing;
    std::error_code none;
    for (std::int64_t frame = requested.first; frame <= requested.last; frame += requested.step) {
        const int number = static_cast<int>(frame);
        const fs::path path = pattern.expand(number);
        if (fs::exists(path, none) && part.record.files.contains(frame))
            part.frames.emplace(number, path);
        else
            missing.push_back(number);
        if (missing.size() == max_missing) break;
    }
    if (!missing.empty())
        problems.push_back(fmt::format(
            "of {} {} missing: {}{}", part.text, missing.size() == 1 ? "a frame is" : "frames are",
            list_of_frames(missing, requested.step), missing.size() == max_missing ? ", and maybe more" : ""));
}

std::vector<int> RunParts::frames() const
{
    std::vector<int> numbers;
    for (const auto& [frame, path] : parts_.front().frames) numbers.push_back(frame);
    return numbers;
}

void RunParts::check_output(const std::string& output) const
{
    const Format& format = format_of(output);
    if (!format.read || format.film || format.positions_only)
        throw Error(fmt::format("{} {}: a {} file can't store points; merge into another format",
                                name_of(Setting::Output), output, format.extension));
    for (const PartFiles& part : parts_)
        if (const Format& own = format_of(part.text); !own.read || own.positions_only)
            throw Error(fmt::format("{}: points can't be read from a {} file", part.text, own.extension));
    const FramePattern pattern(output);
    if (parts_.front().frames.size() > 1 && !pattern.has_frame())
        throw Error(
            fmt::format("{} {}: several frames would go into one file; put #### into the name for the frame number",
                        name_of(Setting::Output), output));
    std::error_code none;
    for (const PartFiles& part : parts_)
        for (const auto& [frame, path] : part.frames)
            if (fs::equivalent(pattern.expand(frame), path, none))
                throw Error(fmt::format("{} {}: would replace the part {}; give the merged files another name",
                                        name_of(Setting::Output), output, path.string()));
}

std::uint64_t RunParts::write_frame(int frame, const std::string& output) const
{
    const std::string path = FramePattern(output).expand(frame);
    std::uintmax_t bytes = 0;
    std::error_code none;
    for (const PartFiles& part : parts_) bytes += fs::file_size(part.frames.at(frame), none);
    fs::create_directories(folder_above(path), none);
    std::optional<ColumnFiles> columns;
    if (bytes > max_in_memory) columns.emplace(folder_above(path), resident);

    std::vector<std::string> names;
    std::vector<PartRecord::File> written;
    for (const PartFiles& part : parts_) {
        names.push_back(part.frames.at(frame).string());
        written.push_back(part.record.files.at(frame));
    }
    std::vector<PointSet> read = read_parts(names, written, columns.has_value());
    const PointSet whole = merge_parts(read, names);
    read.clear();
    const PartRecord& record = parts_.front().record;
    FrameInfo info;
    info.number = frame;
    info.time = FrameClock{record.fps, record.start}.at(frame).time;
    info.fps = record.fps;
    write_points(path, whole, info);
    return whole.size();
}

}  // namespace rapid
