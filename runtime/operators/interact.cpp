// interact: separation, cohesion, alignment and drag between neighbours (equations: solver/interaction.h).
#include <optional>

#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

struct Interact {
    double radius;
    PerPoint<float> separation, cohesion, alignment, drag, avoidance;
    double foresight, view;
    std::optional<double> clearance;
    int most;
    std::string group;

    static NodeType declare()
    {
        return node<Interact>("interact",
                              "Moves points by their neighbours: apart, together, in step, without haste, aside.")
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
                   "rate at which they stop approaching and parting; what turns about them goes on")
            .param(&Interact::avoidance, "avoidance", 0.0, at_least(0), "m/s²",
                   "turns them aside from those that they would come too near to")
            .param(&Interact::foresight, "foresight", 1.0, above(0), "s", "how far ahead they look for that")
            .param(&Interact::clearance, "clearance", Value(), above(0), "m",
                   "at which they pass each other; half the radius, where it is not given")
            .param(&Interact::view, "view", 360.0, between(0, 360), "deg",
                   "the angle about their velocity within which they see others")
            .param(&Interact::most, "most", 0.0, between(0, 1e9), "",
                   "neighbours that each heeds, the nearest of those that it sees; 0: all");
    }

    std::string couples(const Plan&, const PlannedNode&) const { return "acts between neighbours"; }

    std::shared_ptr<const Interaction> dynamic(const Evaluation& now) const
    {
        auto interaction = dynamic_of<Interaction>(now, group);
        interaction->radius = radius;
        interaction->separation = separation;
        interaction->cohesion = cohesion;
        interaction->alignment = alignment;
        interaction->drag = drag;
        interaction->avoidance = avoidance;
        interaction->foresight = foresight;
        interaction->clearance = clearance.value_or(0.5 * radius);
        interaction->view = view;
        interaction->most = most;
        return interaction;
    }
};
RAPID_NODE(Interact);
RAPID_COUPLING("interact", Interact);

}  // namespace
}  // namespace rapid
