#include "bindings/scene/host_rods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bindings/scene/scene_error.h"
#include "runtime/graph/plugin.h"
#include "runtime/solver/constraints/rows.h"

namespace rapid {
namespace {

// C = |P_a - P_b| - length
struct Rod {
    static constexpr int points = 2;

    double length;  // m

    double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = P[0] - P[1];
        const double distance = d.norm();
        // Coincident points may be separated in any direction.
        gradient[0] = distance > 0 ? Vec3d(d / distance) : Vec3d(Vec3d::UnitY());
        gradient[1] = -gradient[0];
        return distance - length;
    }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(length);
    }
};

void check(const HostRod& rod, const std::vector<std::int64_t>& ids, const std::string& node)
{
    const auto is_there = [&](std::int64_t id) { return std::binary_search(ids.begin(), ids.end(), id); };
    if (!is_there(rod.a) || !is_there(rod.b) || rod.a == rod.b)
        throw Error(fmt::format(
            "the program's node \"{}\" returns a rod between the ids {} and {}; they must belong to two points", node,
            rod.a, rod.b));
    if (!(rod.length >= 0 && std::isfinite(rod.length) && rod.compliance >= 0 && std::isfinite(rod.compliance)))
        throw Error(
            fmt::format("the program's node \"{}\" returns a rod of length {} and compliance {}; both must be finite "
                        "and at least 0",
                        node, rod.length, rod.compliance));
}

}  // namespace

std::shared_ptr<const Constraint> rods_of(const HostNode& node, const std::vector<double>& values,
                                          const std::string& group, const PointSet& points, const Evaluation& now)
{
    std::vector<std::int64_t> ids(points.size());
    std::vector<Vec3d> P(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        ids[i] = points.id()[i];
        P[i] = points.P()[i].cast<double>();
    }
    std::vector<HostRod> rods;
    HostCall call;
    call.count = points.size();
    call.frame = now.frame.number;
    call.time = now.frame.time;
    call.dt = now.frame.dt;
    call.parameters = values.data();
    call.id = ids.data();
    call.P = P.empty() ? nullptr : P.front().data();
    call.rods = &rods;
    if (!points.empty()) call_program(fmt::format("node \"{}\"", node.name).c_str(), node.call, call);

    std::sort(ids.begin(), ids.end());
    auto rows = std::make_shared<Rows<Rod>>();
    for (const HostRod& rod : rods) {
        check(rod, ids, node.name);
        rows->add({rod.a, rod.b}, Rod{rod.length}, rod.compliance);
    }
    if (rods.empty()) return nullptr;
    return constrain(now, group, [rows](const PointSet&) { return rows; });
}

}  // namespace rapid
