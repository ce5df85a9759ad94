#include "bindings/host/makers/grid_files.h"

#include "runtime/files/frame_pattern.h"

namespace rapid {
namespace {

FramePattern pattern_of(const MakeContext& context, const std::string& path)
{
    return FramePattern::of_files(context.folder / path);  // an absolute path stays itself
}

}  // namespace

bool GridFiles::is_sequence(const MakeContext& context) const { return pattern_of(context, path).has_frame(); }

SequenceFiles GridFiles::files(MakeContext& context) const
{
    const FramePattern pattern = pattern_of(context, path);
    SequenceFiles sequence{existing_files(pattern), order()};
    if (context.on_read)
        for (const auto& [frame, file] : sequence.files) context.on_read(file);
    return sequence;
}

}  // namespace rapid
