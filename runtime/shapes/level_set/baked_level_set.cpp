#include "runtime/shapes/level_set/baked_level_set.h"

#include <tbb/task_arena.h>

#include <utility>

#include "runtime/shapes/level_set/scatter_level_set.h"

namespace rapid {
namespace {

// Returns the value, which the first call creates. Isolation stops the thread from taking other work meanwhile, which
// might need the same mutex.
template <class Ptr, class Make>
const Ptr& computed_once(std::mutex& mutex, Ptr& value, const Make& make)
{
    const std::lock_guard lock(mutex);
    if (!value) tbb::this_task_arena::isolate([&] { value = make(); });
    return value;
}

}  // namespace

BakedLevelSet::BakedLevelSet(BakedGrid baked, std::uint64_t active_voxels, Source source)
    : baked_(std::make_shared<BakedGrid>(std::move(baked))), active_voxels_(active_voxels), source_(std::move(source))
{
}

BakedLevelSet::BakedLevelSet(const std::shared_ptr<const BakedLevelSet>& same, ObjectPtr moving)
    : baked_(same->baked_),
      active_voxels_(same->active_voxels_),
      source_(same->source_),
      same_(same),
      moving_(std::move(moving))
{
}

const LevelSetGridPtr& BakedLevelSet::grid() const { return computed_once(grid_mutex_, grid_, source_.grid); }

MeshPtr BakedLevelSet::surface() const
{
    return computed_once(surface_mutex_, surface_, [this] { return surface_of_grid(*grid()); });
}

LevelSetPtr BakedLevelSet::with_band(double metres) const
{
    if (metres <= band()) return shared_from_this();
    // The margin leaves at least `metres` after rounding to the grid's single precision.
    return source_.rebuild(metres * (1 + 1e-6));
}

void BakedLevelSet::write(const std::filesystem::path& path, const std::string& name) const
{
    write_level_set_grid(*grid(), path, name);
}

ScatterPtr BakedLevelSet::surface_scatter() const { return scatter_on_surface(baked_, surface()); }
ScatterPtr BakedLevelSet::volume_scatter() const { return scatter_in_volume(baked_); }

}  // namespace rapid
