// Parameters of makers that read a sequence of files: the behaviour beyond its ends, and its beginning.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "bindings/host/maker.h"
#include "runtime/base/frame_sequence.h"
#include "runtime/files/frame_pattern.h"

namespace rapid {

// Returns the files of a pattern, by frame. Throws Error if there are none.
inline std::map<int, std::filesystem::path> existing_files(const FramePattern& pattern)
{
    auto files = pattern.existing();
    if (files.empty()) throw Error(fmt::format("there is no file \"{}\" at any frame", pattern.text()));
    return files;
}

struct SequenceOptions {
    std::string before, after;  // empty if not given
    std::optional<double> offset;

    template <class T>
    static Maker declare(MakerDeclaration<T>& declaration)
    {
        constexpr double most = 1e9;
        declaration
            .param(static_cast<std::string T::*>(&T::before), "before", Value(), any_number(), "",
                   "data before the first file of a sequence: that file, all files repeated, all files back and forth, "
                   "or nothing")
            .param(static_cast<std::string T::*>(&T::after), "after", Value(), any_number(), "",
                   "data after the last file of a sequence, as for before")
            .param(static_cast<std::optional<double> T::*>(&T::offset), "offset", Value(), between(-most, most),
                   "frames", "delay of the files of a sequence: frame f uses the file f - offset");
        Maker maker = declaration;
        for (Param& param : maker.params)
            if (param.name == "before" || param.name == "after") param.choices = {"hold", "repeat", "mirror", "none"};
        return maker;
    }

    // Throws Error if the offset is not whole, or if any of them is given for a single file.
    void check(const std::string& path, bool is_sequence) const
    {
        if (offset && *offset != std::floor(*offset))
            throw Error(fmt::format("offset = {} is not whole; it must be a whole number of frames", *offset));
        for (const auto& [given, name] : {std::pair(!before.empty(), "before"), std::pair(!after.empty(), "after"),
                                          std::pair(offset.has_value(), "offset")})
            if (given && !is_sequence)
                throw Error(fmt::format(
                    "{} needs a sequence of files, but \"{}\" is one file; give a path with #### or $F4", name, path));
    }

    // Returns the file of a frame, or nothing if it has none. Throws Error if a file is missing between others.
    std::optional<std::filesystem::path> file_at(const FramePattern& pattern,
                                                 const std::map<int, std::filesystem::path>& files, double frame) const
    {
        FrameSequence frames = order();
        frames.first = files.begin()->first;
        frames.last = files.rbegin()->first;
        const std::optional<std::int64_t> file = frames.file_of(static_cast<std::int64_t>(std::ceil(frame)));
        if (!file) return std::nullopt;
        const auto found = files.find(static_cast<int>(*file));
        if (found == files.end())
            throw Error(fmt::format("frame {} of \"{}\" is missing; each frame from {} to {} needs a file", *file,
                                    pattern.text(), frames.first, frames.last));
        return found->second;
    }

    FrameSequence order() const
    {
        FrameSequence order;
        order.before = beyond(before);
        order.after = beyond(after);
        order.offset = static_cast<std::int64_t>(offset.value_or(0));
        return order;
    }

private:
    static FrameSequence::Beyond beyond(const std::string& name)
    {
        return name == "repeat"   ? FrameSequence::Repeat
               : name == "mirror" ? FrameSequence::Mirror
               : name == "none"   ? FrameSequence::None
                                  : FrameSequence::Hold;
    }
};

}  // namespace rapid
