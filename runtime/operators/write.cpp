// write: writes the points to a file for each frame, and passes them on unchanged.
//
// It also writes the first frame, anywhere in the chain, so that a sequence of files starts with the frames.
#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/operators/written_points.h"

namespace rapid {
namespace {

struct Write {
    std::string file, group;
    std::vector<std::string> attributes;

    static NodeType declare()
    {
        return node<Write>("write", "Writes the points to files and passes them on.")
            .varies()
            .stage(Stage::Writing)
            .param(&Write::file, "file", Value(), any_number(), "", "pattern of the files, with #### for the frame")
            .required()
            .param(&Write::attributes, "attributes", Value(), any_number(), "",
                   "attributes that are written besides P, v and id; the default is all")
            .constant();
    }

    void uses(Uses& uses) const
    {
        uses.reads.insert(uses.reads.end(), attributes.begin(), attributes.end());
        if (attributes.empty()) uses.reads_all = true;
    }

    void check() const
    {
        if (file.empty()) throw Error("file = \"\" is empty; give a pattern such as \"points.####.vdb\"");
    }

    void edit(PointSet& points, const Evaluation& now) const
    {
        if (!now.write) return;
        PointSet written = members_alone(points, group);
        written.remove("dt");
        if (!attributes.empty()) keep_columns(written, attributes);
        now.write(file, written);
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now) const
    {
        edit(inputs[0].points, now);
        return std::move(inputs[0]);
    }
};
RAPID_NODE(Write);
RAPID_COUPLING("write", Write);

}  // namespace
}  // namespace rapid
