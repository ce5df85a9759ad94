#include "bindings/run/written_names.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <limits>

#include "runtime/base/error.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/file_error.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Returns the same path for all ways to the file. A symbolic link in its place is not followed, since writing replaces
// it.
fs::path true_path(const fs::path& file)
{
    const fs::path full = fs::absolute(file);
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(full.parent_path(), error);
    return (error ? full.parent_path() : folder) / full.filename();
}

std::optional<int> number(std::int64_t frame)
{
    using limits = std::numeric_limits<int>;
    if (frame < limits::min() || frame > limits::max()) return std::nullopt;
    return static_cast<int>(frame);
}

// Returns the frame whose file has this name.
std::optional<int> frame_named(const std::string& name, const FramePattern& pattern)
{
    constexpr const char* digits = "0123456789";
    for (std::size_t begin = 0, end; (begin = name.find_first_of(digits, begin)) != std::string::npos; begin = end) {
        end = std::min(name.find_first_not_of(digits, begin), name.size());
        // A minus sign may be one, or a part of the name; and so may be digits before the number.
        for (std::size_t first = begin - (begin > 0 && name[begin - 1] == '-'); first < end; ++first) {
            int frame = 0;
            const auto parsed = std::from_chars(name.data() + first, name.data() + end, frame);
            if (parsed.ec == std::errc() && pattern.expand(frame) == name) return frame;
        }
    }
    return std::nullopt;
}

}  // namespace

void WrittenNames::reads(const fs::path& file) { read_.insert(true_path(file)); }

void WrittenNames::add(const fs::path& file, std::string who)
{
    const fs::path resolved = true_path(file);
    Writer writer{resolved.parent_path(), resolved.filename(), std::nullopt, {}, std::move(who)};
    check(writer);
    writers_.push_back(std::move(writer));
}

void WrittenNames::add(const FramePattern& pattern, std::string_view output, const RunFrames& frames, std::string who)
{
    const fs::path resolved = true_path(pattern.for_output(output));
    Writer writer{resolved.parent_path(), resolved.filename(), FramePattern(resolved.filename()), frames,
                  std::move(who)};
    if (!writer.pattern->has_frame()) {
        writer.name = writer.pattern->name();  // without the backslashes of escapes
        writer.pattern.reset();
    }
    check(writer);
    writers_.push_back(std::move(writer));
}

// Returns the file's name if it is one of the writer's.
std::optional<std::string> WrittenNames::name_of_file(const Writer& writer, const fs::path& file) const
{
    if (file.parent_path() != writer.folder) return std::nullopt;
    const std::string name = file.filename();
    if (!writer.pattern) return name == writer.name ? std::optional(name) : std::nullopt;
    const std::optional<int> frame = frame_named(name, *writer.pattern);
    return frame && writer.frames.contains(*frame) ? std::optional(name) : std::nullopt;
}

std::optional<std::string> WrittenNames::common_name(const Writer& a, const Writer& b) const
{
    if (!a.pattern) return name_of_file(b, a.folder / a.name);
    if (!b.pattern) return name_of_file(a, b.folder / b.name);
    if (a.folder != b.folder) return std::nullopt;
    // In patterns that differ in the number of digits, the longest numbers are alike.
    for (const std::int64_t frame : {a.frames.first, a.frames.last})
        if (const auto at = number(frame); at && a.pattern->expand(*at) == b.pattern->expand(*at))
            return a.pattern->expand(*at);
    return std::nullopt;
}

void WrittenNames::check(const Writer& writer) const
{
    for (const Writer& other : writers_)
        if (const auto name = common_name(writer, other))
            throw Error(fmt::format("{} writes {} too; give each a different name", other.who, *name));
    for (const fs::path& file : read_)
        if (const auto name = name_of_file(writer, file))
            throw Error(fmt::format("the run reads {}; write to another file", *name));
}

// A note is a file that only one process can make.
void claim_among_processes(const fs::path& folder, const std::string& who, const fs::path& file)
{
    const fs::path note = folder / (hash_text(content_hash(true_path(file).native())) + ".claim");
    const Descriptor made(::open(note.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!made && errno != EEXIST) throw file_error(fmt::format("can't write {}", note.string()), errno);
    if (made) {
        if (::write(made.number(), who.data(), who.size()) != static_cast<ssize_t>(who.size()))
            throw file_error(fmt::format("can't write {}", note.string()), errno);
    } else if (InputFile(note).text() != who) {
        throw Error("another run of the wedge writes this file too; put a varied parameter into the name");
    }
}

}  // namespace rapid
