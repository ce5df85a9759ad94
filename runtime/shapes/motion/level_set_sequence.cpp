#include "runtime/shapes/motion/level_set_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"

namespace rapid {
namespace {

// Two files as read and two widened versions of both: for the first query, and for the radius of points.
constexpr std::size_t max_recent_level_sets = 8;
constexpr double max_voxels = 0x1p27;  // in a widened level set

// Returns the largest distance of one surface's vertices from the other level set, limited by its band.
double farthest(const LevelSet& from, const LevelSet& other)
{
    const MeshPtr surface = from.surface();
    std::vector<Vec3d> P;
    P.reserve(surface->positions.size());
    for (const Vec3f& vertex : surface->positions) P.push_back(vertex.cast<double>());
    std::vector<double> phi(P.size());
    other.distance(P, phi, {});
    double most = 0;
    for (const double distance : phi) most = std::max(most, std::abs(distance));
    return most;
}

}  // namespace

LevelSetSequence::LevelSetSequence(SequenceFiles files, std::string name, Read read)
    : files_(std::move(files)), name_(std::move(name)), read_(std::move(read))
{
}

LevelSetPtr LevelSetSequence::read(int file) const { return widened(file, 0); }

LevelSetPtr LevelSetSequence::widened(int file, double band) const
{
    const auto find = [&](double target) -> LevelSetPtr {
        const std::lock_guard lock(mutex_);
        for (const Recent& recent : recent_)
            if (recent.file == file && recent.band == target) return recent.level_set;
        return nullptr;
    };
    LevelSetPtr found = find(band);
    if (found) return found;
    if (band == 0) {
        found = read_(files_.files.at(file));
    } else {
        const LevelSetPtr as_read = widened(file, 0);
        if (as_read->band() >= band) return as_read;
        found = as_read->with_band(band);
    }
    const std::lock_guard lock(mutex_);
    recent_.push_front({file, band, found});
    if (recent_.size() > max_recent_level_sets) recent_.pop_back();
    return found;
}

// Bands are multiples of four voxels, so that the same width serves many pairs.
LevelSetSequence::Pair LevelSetSequence::pair(int a, int b, double band) const
{
    Pair found;
    bool known = false;
    {
        const std::lock_guard lock(mutex_);
        if (const auto recent = pairs_.find({a, b}); recent != pairs_.end()) found = recent->second, known = true;
    }
    const LevelSetPtr first = read(a), second = read(b);
    const double voxel = std::max(first->voxel(), second->voxel());
    const auto stepped = [&](double metres) { return 4 * voxel * std::ceil(metres / (4 * voxel) * (1 - 1e-9)); };
    const Box3d both = first->bounds().merged(second->bounds());
    const auto fits = [&](double metres) {
        const double smaller = std::min(first->voxel(), second->voxel());
        return ((both.sizes().array() + 2 * metres) / smaller).prod() < max_voxels;
    };
    if (!known) {
        const double half = 0.5 * std::max(first->bounds().diagonal().norm(), second->bounds().diagonal().norm());
        double reach = std::min(first->band(), second->band());
        for (found.a = first, found.b = second;; reach = std::min(2 * reach, half + 2 * voxel)) {
            if (reach > std::min(first->band(), second->band())) {
                if (found.jumps = !fits(stepped(reach)); found.jumps) break;
                found.a = widened(a, stepped(reach)), found.b = widened(b, stepped(reach));
            }
            found.travel = std::max(farthest(*found.a, *found.b), farthest(*found.b, *found.a));
            if (found.travel < reach - voxel) break;
            if (found.jumps = reach >= half + 2 * voxel; found.jumps) break;
        }
        found.jumps = found.jumps || found.travel > half;
        const std::lock_guard lock(mutex_);
        pairs_[{a, b}] = {nullptr, nullptr, found.travel, found.jumps};
    }
    const double needed = stepped(found.travel + std::max(band, 2 * voxel));
    found.jumps = found.jumps || !fits(needed);
    found.a = found.jumps ? first : widened(a, needed);
    found.b = found.jumps ? second : widened(b, needed);
    return found;
}

LevelSetPtr LevelSetSequence::at(std::int64_t frame) const
{
    const std::optional<int> file = files_.frame_of(frame);
    if (!file) return nullptr;
    if (!files_.files.count(*file))
        throw Error(
            fmt::format("frame {} of \"{}\" is missing; each frame from {} to {} needs a file, unless a collider or a "
                        "force uses it",
                        *file, name_, files_.files.begin()->first, files_.files.rbegin()->first));
    return read(*file);
}

ShapePtr LevelSetSequence::over(const FrameClock& clock, double from, double to) const
{
    const double whole = std::floor(from);
    const SequenceFiles::Interval interval = files_.interval(static_cast<std::int64_t>(whole));
    // At the first or last file, the grid at the end of the step applies throughout.
    if (const std::optional<int> last = from == to ? interval.a : interval.b; !interval.a || !interval.b)
        return last ? read(*last) : nullptr;
    SequenceFiles::Interval part = interval;
    part.begin = interval.begin + (from - whole) * (interval.end - interval.begin);
    part.end = interval.begin + (to - whole) * (interval.end - interval.begin);
    if (*part.a == *part.b || (part.begin == part.end && part.begin == 0)) return read(*part.a);
    if (part.begin == part.end && part.begin == 1) return read(*part.b);
    constexpr double tags = 0x1p30;
    const auto tag = static_cast<std::int32_t>(std::fmod(std::abs(std::round(from * 4096)), tags));
    if (const auto blended = blend(part, (to - from) / clock.fps, tag, 0)) return blended;
    return read(interval.end >= interval.begin ? *part.b : *part.a);
}

std::shared_ptr<const BlendedLevelSets> LevelSetSequence::blend(const SequenceFiles::Interval& part, double duration,
                                                                std::int32_t tag, double band) const
{
    const Pair both = pair(*part.a, *part.b, band);
    if (both.jumps) return nullptr;
    const auto widen = [self = shared_from_this(), part, duration, tag](double metres) {
        return self->blend(part, duration, tag, metres);
    };
    return blended_level_sets({both.a, both.b, part.begin, part.end, duration, both.travel, tag, widen});
}

}  // namespace rapid
