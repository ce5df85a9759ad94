// gravity: one acceleration for all points, independent of mass.
//
//   a = g        exact at any step: the integrator follows the parabola
#include "runtime/graph/node.h"

namespace rapid {
namespace {

struct Gravity {
    Vec3d g;
    std::string group;

    static NodeType declare()
    {
        return node<Gravity>("gravity", "Accelerates all points equally.")
            .param(&Gravity::g, "g", Vec3d(0, -9.81, 0), any_number(), "m/s²", "acceleration");
    }

    std::optional<Uniform> uniform() const { return Uniform{g}; }
};
RAPID_NODE(Gravity);

}  // namespace
}  // namespace rapid
