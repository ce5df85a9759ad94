#include "bindings/host/makers/grid_files.h"

#include <fmt/format.h>

#include "runtime/io/frame_pattern.h"

namespace rapid {
namespace {

FramePattern pattern_of(const MakeContext& context, const std::string& path)
{
    return FramePattern((context.folder / path).string());  // an absolute path stays itself
}

SequenceFiles::Outside outside_of(const std::string& name)
{
    using Outside = SequenceFiles::Outside;
    return name == "repeat"    ? Outside::Repeat
           : name == "mirror"  ? Outside::Mirror
           : name == "nothing" ? Outside::Nothing
                               : Outside::Hold;
}

}  // namespace

bool GridFiles::is_sequence(const MakeContext& context) const { return pattern_of(context, path).has_frame(); }

SequenceFiles GridFiles::files(MakeContext& context) const
{
    const FramePattern pattern = pattern_of(context, path);
    SequenceFiles sequence{pattern.existing(), outside_of(before), outside_of(after), offset};
    if (sequence.files.empty()) throw Error(fmt::format("there is no file \"{}\", at any frame", pattern.text()));
    if (context.on_read)
        for (const auto& [frame, file] : sequence.files) context.on_read(file);
    return sequence;
}

}  // namespace rapid
