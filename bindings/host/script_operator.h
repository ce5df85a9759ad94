// The operator of a node type defined by rapid.node.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bindings/host/kernel.h"

namespace rapid {

// The parameters' values by name, the kernel, and the attributes that the node adds.
struct ScriptFields {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    KernelArguments arguments;
    std::vector<AttributeSpec> makes;

    // Adds the attributes to points that may lack them: those of another simulation, and those after Solve.
    void add_attributes(PointSet& points, const Evaluation& now) const
    {
        for (const AttributeSpec& spec : makes)
            if (now.keeps(spec.name)) points.add(spec);
    }

    // Adds the uses of an edit of the points, one by one.
    void uses(Uses& uses) const { kernel->uses(uses, arguments); }
    bool removes_points() const { return kernel->kills(); }
    bool reads_indices() const { return kernel->reads_indices(); }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        add_attributes(points, now);
        return kernel->prepare(points, group, now, arguments, before);
    }
};

// Makes the operator of a kernel that edits the points one by one, of an action, or of a function of all points.
std::unique_ptr<Operator> make_script_operator(NodeKind kind, bool edits_points, ScriptFields fields);

}  // namespace rapid
