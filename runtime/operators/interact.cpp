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
                              "Moves points by their neighbours: separation, cohesion, alignment, drag, avoidance.")
            .stage(Stage::Forces)
            .takes("mass")
            .param(&Interact::radius, "radius", Value(), above(0), "m", "distance within which points are neighbours")
            .required()
            .param(&Interact::separation, "separation", 0.0, at_least(0), "m/s²",
                   "acceleration that separates neighbours, largest where they touch")
            .param(&Interact::cohesion, "cohesion", 0.0, at_least(0), "m/s²",
                   "acceleration that draws neighbours together, largest at half the radius")
            .param(&Interact::alignment, "alignment", 0.0, at_least(0), "1/s",
                   "rate at which the velocities of neighbours become equal")
            .param(&Interact::drag, "drag", 0.0, at_least(0), "1/s",
                   "rate at which neighbours stop approaching and separating; rotation about each other is not damped")
            .param(&Interact::avoidance, "avoidance", 0.0, at_least(0), "m/s²",
                   "acceleration that turns points aside from others that they would pass too closely")
            .param(&Interact::foresight, "foresight", 1.0, above(0), "s",
                   "time for which points look ahead to avoid others")
            .param(&Interact::clearance, "clearance", Value(), above(0), "m",
                   "distance at which points pass each other; the default is half the radius")
            .param(&Interact::view, "view", 360.0, between(0, 360), "deg",
                   "angle about its velocity in which a point sees others")
            .param(&Interact::most, "most", 0.0, between(0, 1e9), "",
                   "number of nearest visible neighbours to which a point reacts; 0 for all");
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
