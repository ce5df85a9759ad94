// A newly loaded scene, to be advanced frame by frame.
#pragma once

#include <filesystem>

#include "bindings/host/session.h"
#include "runtime/graph/evaluate.h"

namespace rapid::test {

class Run {
public:
    explicit Run(const std::filesystem::path& file)
        : session_(file, {}), plan_(session_.graph(), PlanOptions{}), evaluator_(plan_, [](auto&&...) {})
    {
    }

    Evaluator& evaluator() { return evaluator_; }
    const Plan& plan() const { return plan_; }

private:
    Session session_;
    Plan plan_;
    Evaluator evaluator_;
};

}  // namespace rapid::test
