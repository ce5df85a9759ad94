// interact: separation, cohesion, alignment and drag between neighbours (equations: solver/interaction.h).
#include "runtime/graph/node.h"
#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

struct Interact {
    double radius;
    PerPoint<float> separation, cohesion, alignment, drag;
    std::string group;

    static NodeType declare()
    {
        return node<Interact>("interact", "Moves points by their neighbours: apart, together, in step, without haste.")
            .stage(Stage::Forces)
            .takes("mass")
            .param(&Interact::radius, "radius", Value(), above(0), "m", "within which points are neighbours")
            .required()
            .param(&Interact::separation, "separation", 0.0, at_least(0), "m/s²",
                   "drives them apart, most where they touch")
            .param(&Interact::cohesion, "cohesion", 0.0, at_least(0), "m/s²",
                   "draws them together, most at half the radius")
            .param(&Interact::alignment, "alignment", 0.0, at_least(0), "1/s",
                   "rate at which their velocities become equal")
            .param(&Interact::drag, "drag", 0.0, at_least(0), "1/s",
                   "rate at which they stop approaching and parting; what turns about them goes on");
    }

    std::shared_ptr<const Interaction> dynamic(const Evaluation& now) const
    {
        auto interaction = dynamic_of<Interaction>(now, group);
        interaction->radius = radius;
        interaction->separation = separation;
        interaction->cohesion = cohesion;
        interaction->alignment = alignment;
        interaction->drag = drag;
        return interaction;
    }
};
RAPID_NODE(Interact);

}  // namespace
}  // namespace rapid
