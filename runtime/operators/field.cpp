// field: a vector grid that acts on points as a force, or as the velocity of a flow.
//
//   mode "force"       F = strength value                N; accelerates a point by its mass
//   mode "velocity"    a = -drag (v - strength value)    exact at any step: no drag is too stiff
//
// The value is sampled at the middle of the substep in space and time, which is of second order in the variation of
// the field along the path.
#include "runtime/graph/node.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {
namespace {

struct Field {
    VectorGridPtr grid;
    std::string mode;
    PerPoint<float> strength;
    std::optional<PerPoint<float>> drag;
    std::string group;

    static NodeType declare()
    {
        return node<Field>("field", "Moves points by a grid of vectors: as a force, or as the velocity of a flow.")
            .takes("mass")
            .param(&Field::grid, "grid", Value(), any_number(), "", "grid of vectors, or a sequence of them")
            .required()
            .param(&Field::mode, "mode", "force", any_number(), "",
                   "meaning of the vectors: forces (N), or velocities (m/s) that points approach")
            .choices({"force", "velocity"})
            .param(&Field::strength, "strength", 1.0, any_number(), "", "factor of the vectors")
            .param(&Field::drag, "drag", Value(), at_least(0), "1/s",
                   "rate at which points reach the velocities, with mode = \"velocity\"; the default is 1");
    }

    void check() const
    {
        if (mode == "force" && drag) throw Error("drag needs mode = \"velocity\"; remove it, or add :drag");
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        std::vector<Vec3d> values(chunk.size());
        grid->sample_at(chunk.P, chunk.time, values);
        const Strided<float> size = chunk.read(strength);
        if (mode == "velocity") {
            const Strided<float> rate = drag ? chunk.read(*drag) : Strided<float>{&usual_drag, 0};
            for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_drag(i, rate[i], size[i] * values[i]);
        } else {
            const Strided<float> mass = masses_of(chunk.points);
            for (std::size_t i = 0; i < chunk.size(); ++i) forces.add(i, size[i] / mass[chunk.first + i] * values[i]);
        }
    }

private:
    static constexpr float usual_drag = 1;  // 1/s, if not given
};
RAPID_NODE(Field);

}  // namespace
}  // namespace rapid
