#include "runtime/solver/estimate/tolerance_check.h"

#include <cmath>

#include "runtime/points/id_index.h"

namespace rapid {
namespace {

constexpr int frames_between = 4;
constexpr std::size_t all = 1250, some = 250;  // points checked of up to `all` points; of more points

double fraction_beyond(PointSet finer, const PointSet& solved, const Dynamics& dynamics, SolveOptions options,
                       double tolerance, int max_substeps)
{
    options.substeps *= 3;
    options.sinks = {};
    solve_within(finer, dynamics, options, tolerance / 4, max_substeps);
    const IdIndex indices(solved.id());
    std::size_t compared = 0, beyond_tolerance = 0;
    for (std::size_t k = 0; k < finer.size(); ++k) {
        const std::uint32_t i = indices[finer.id()[k]];
        if (i == IdIndex::none) continue;
        ++compared;
        const Vec3d off = solved.P()[i].cast<double>() - std::as_const(finer).P()[k].cast<double>();
        beyond_tolerance += off.norm() > tolerance / 2;
    }
    return compared > 0 ? static_cast<double>(beyond_tolerance) / static_cast<double>(compared) : 0;
}

}  // namespace

std::uint64_t ToleranceCheck::beyond_tolerance(const PointSet& sample, const PointSet& solved, const Dynamics& dynamics,
                                               const SolveOptions& options, double tolerance, int max_substeps)
{
    const int frame = frames_++;
    if (frame < frames_between || frame % frames_between == 0) {
        std::vector<std::uint32_t> chosen;
        const std::size_t every = solved.size() <= all ? 1 : std::max<std::size_t>(1, sample.size() / some);
        for (std::size_t k = 0; k < sample.size(); k += every) chosen.push_back(static_cast<std::uint32_t>(k));
        part_ = chosen.empty()
                    ? 0
                    : fraction_beyond(sample.select(chosen), solved, dynamics, options, tolerance, max_substeps);
    }
    return static_cast<std::uint64_t>(std::ceil(part_ * static_cast<double>(solved.size())));
}

}  // namespace rapid
