// collide: points bounce off a shape, slide on it, and come to rest (paper §4).
//
//   v+ = vt max(0, 1 - μ (1 + ε) |vn| / |vt|) - ε vn        ε = bounce, μ = friction
//
// at the time of impact on the point's path, where its distance from the shape is its radius.
#include <fmt/format.h>

#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/graph/param.h"
#include "runtime/shapes/mesh/open_mesh.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/level_set_sequence.h"
#include "runtime/solver/collision/hits.h"

namespace rapid {
namespace {

// The parameter `record`: false, true (every contact), or a minimum impact speed.
struct MinSpeed {
    static constexpr std::string_view param_type = "false or number";

    std::optional<double> speed;
};

void read_value(const Param& param, const Value& value, MinSpeed& least)
{
    if (const bool* flag = value.get<bool>())
        least.speed = *flag ? std::optional<double>(0) : std::nullopt;
    else
        rapid::read_value(param, value, least.speed);
}

// A shape, which may have a motion or deform, and may be absent at some frames.
struct ColliderShape {
    static constexpr std::string_view param_type = "shape";

    ShapePtr rest;
    DeformingLevelSetPtr deforming;
    MotionPtr motion;
};

// Returns a voxel with about 64 of them along the mesh, with one digit.
std::string suggested_voxel(const Mesh& mesh)
{
    const float size = mesh.bounds().sizes().maxCoeff();
    return size > 0 ? fmt::format("{:.1g}", size / 64) : "0.05";
}

[[noreturn]] void refuse_mesh(const Param& param, const Value& value, const Mesh& mesh)
{
    const std::string remedy = fmt::format(
        "use rapid.levelset.from_mesh(mesh, {{ voxel = {} }}); a smaller voxel follows the mesh more closely",
        suggested_voxel(mesh));
    const std::size_t open = mesh.openness().boundary_edges;
    if (open == 0)
        throw Error(
            fmt::format("{} = {} has no inside that could keep points out; {}", param.name, describe(value), remedy));
    throw Error(fmt::format(
        "{} = {} has no inside that could keep points out, as it is open: {} of its edges have one face; {}, then {}",
        param.name, describe(value), open, open_mesh_remedy, remedy));
}

void read_value(const Param& param, const Value& value, ColliderShape& shape)
{
    shape = {};
    if (value.is_nil()) return;
    if (const auto animated = value.object<AnimatedShape>())
        shape = {animated->rest(), nullptr, animated->motion()};
    else if (const auto deforming = value.object<DeformingLevelSet>())
        shape.deforming = deforming;
    else if (const auto body = in_motion<DeformingLevelSet>(value.object<LevelSet>()))
        shape.deforming = body;
    else if (const auto moving = value.object<AnimatedMesh>())
        refuse_mesh(param, value, *moving->rest());
    else if (const auto mesh = value.object<Mesh>())
        refuse_mesh(param, value, *mesh);
    else
        rapid::read_value(param, value, shape.rest);
}

struct Collide {
    ColliderShape shape;
    MotionPtr transform;
    std::string method, response;
    MinSpeed record;
    PerPoint<float> bounce, friction;
    std::optional<PerPoint<float>> radius, adhesion;
    PerPoint<float> viscosity;
    std::optional<FrameSet> cut;
    std::string group;

    static NodeType declare()
    {
        return node<Collide>("collide", "Keeps points out of a shape: they bounce, slide, stick or die on it.")
            .stage(Stage::Collision)
            .takes("pscale")
            .param(&Collide::shape, "shape", Value(), any_number(), "",
                   "shape that points collide with; a function of the frame may return nil for no shape")
            .required()
            .or_nothing()
            .param(&Collide::transform, "transform", Value(), any_number(), "",
                   "motion of the shape, a function of the frame that returns one, or keys by frame")
            .param(&Collide::cut, "cut", Value(), any_number(), "",
                   "frames to which the shape jumps without sweeping points along; by default jumps are detected")
            .param(&Collide::bounce, "bounce", 0.5, between(0, 1), "",
                   "restitution: the fraction of the normal speed that remains after a contact")
            .param(&Collide::friction, "friction", 0.0, at_least(0), "", "Coulomb coefficient of friction")
            .param(&Collide::radius, "radius", Value(), at_least(0), "m",
                   "collision radius of the points; the default is pscale, or the radius of :contact if pscale is 0")
            .param(&Collide::method, "method", "continuous", any_number(), "",
                   "continuous: contact at the time of impact; backtrack, project: correction after the step, back "
                   "along the path or out along the gradient")
            .choices({"continuous", "backtrack", "project"})
            .param(&Collide::response, "response", "bounce", any_number(), "",
                   "effect of a contact: the point bounces, slides without a bounce, sticks to the shape, or dies")
            .choices({"bounce", "slide", "stick", "die"})
            .param(&Collide::adhesion, "adhesion", Value(), or_infinity(at_least(0)), "m/s²",
                   "acceleration that tears points off the surface; the default is infinite for points that stick, 0 "
                   "for points that slide")
            .param(&Collide::viscosity, "viscosity", 0.0, at_least(0), "1/s",
                   "rate at which the surface slows down points that slide on it")
            .param(&Collide::record, "record", false, at_least(0), "m/s",
                   "minimum speed of contacts that are written to the hit attributes (hittotal, hitpos, hitnml, ...), "
                   "or false");
    }

    void check() const
    {
        const bool holds = response == "stick" || response == "slide";
        if (holds) return;
        if (adhesion)
            throw Error(
                fmt::format("adhesion needs points that stick or slide, but response is \"{}\"; give response = "
                            "\"stick\" or \"slide\"",
                            response));
        if (!viscosity.attribute.empty() || viscosity.constant > 0)
            throw Error(
                fmt::format("viscosity needs points that slide or stick, but response is \"{}\"; give response = "
                            "\"slide\" or \"stick\"",
                            response));
    }

    // A level set is widened to the largest radius, and a wider band changes the points' bits.
    std::string couples(const Plan& plan, const PlannedNode& node) const
    {
        const auto is_function = [&](const char* name) {
            const auto given = node.node->arguments.find(name);
            return given != node.node->arguments.end() && given->second.function();
        };
        const bool is_sequence = node.node->arguments.at("shape").object<LevelSetSequence>() != nullptr;
        const bool has_band = shape.deforming || std::dynamic_pointer_cast<const LevelSet>(shape.rest) || is_sequence ||
                              is_function("shape");
        if (!has_band) return {};
        if (method != "continuous" || is_function("method"))
            return fmt::format("with method = \"{}\" its level set reaches as deep as the fastest of all points goes",
                               method);
        if (radius && radius->attribute.empty()) return {};
        const std::string attribute = radius ? radius->attribute : "pscale";
        const PlannedAttribute* planned = plan.simulations[node.simulation].find(attribute);
        if (!radius && (!planned || !planned->kept)) return {};
        if (value_of_all(plan, node.simulation, attribute)) return {};
        return fmt::format("its level set is as wide as the largest radius ({}) of all points", attribute);
    }

    void uses(Uses& uses) const
    {
        if (!record.speed) return;
        uses.reads.insert(uses.reads.end(), std::begin(Hits::names), std::end(Hits::names));
        uses.writes.insert(uses.writes.end(), std::begin(Hits::names), std::end(Hits::names));
    }

    std::shared_ptr<const Collider> dynamic(const Evaluation& now) const
    {
        if (!shape.rest && !shape.deforming) return nullptr;
        // A frame without data in a sequence has no collider, nor does the interval before it.
        if (shape.deforming && !shape.deforming->mesh().has(now.frame.number - 1, now.frame.number)) return nullptr;
        auto collider = dynamic_of<Collider>(now, group);
        collider->shape = shape.rest;
        collider->deforming = shape.deforming;
        if (cut) collider->cuts = cut->frames;
        collider->motion = !shape.motion ? transform : !transform ? shape.motion : product(transform, shape.motion);
        collider->bounce = bounce;
        collider->friction = friction;
        collider->radius = radius;
        collider->adhesion = adhesion;
        collider->viscosity = viscosity;
        collider->method = method == "project"     ? Method::Project
                           : method == "backtrack" ? Method::Backtrack
                                                   : Method::Continuous;
        collider->response = response == "slide"   ? Response::Slide
                             : response == "stick" ? Response::Stick
                             : response == "die"   ? Response::Die
                                                   : Response::Bounce;
        collider->record = record.speed;
        return collider;
    }
};
RAPID_NODE(Collide);
RAPID_COUPLING("collide", Collide);

}  // namespace
}  // namespace rapid
