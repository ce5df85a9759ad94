// Births from the points of a node.
#pragma once

#include <string>
#include <vector>

#include "runtime/graph/node_type.h"
#include "runtime/operators/emit/offspring.h"

namespace rapid {

struct ParentOptions {
    BirthPlan plan;
    Traits traits;
    std::string group;   // of the parents
    bool kills = false;  // parents that have borne
};

class ParentEmitter {
public:
    // The attributes that the newborn get. Error: one that the parents do not have.
    static std::vector<AttributeSpec> made(const ParentOptions& options, const Uses& uses);
    // What is read of the parents.
    static void use(const ParentOptions& options, Uses& uses);

    // The births of a step, appended to the flow. from: the source's result; most: births, of a trial.
    void bear(Flow& flow, const Flow& from, const ParentOptions& options, std::size_t most, const Evaluation& now);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(clock_);
    }

private:
    ParentClock clock_;
};

}  // namespace rapid
