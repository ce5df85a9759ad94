#include "bindings/host/kernel_functions.h"

#include <cstdint>
#include <lua.hpp>

#include "runtime/lanes/kernel_random.h"
#include "runtime/math/noise.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"
#include "runtime/shapes/motion/mesh_surface.h"

namespace rapid {
namespace {

double draw(std::uint64_t random, std::int64_t id, double use, double frame)
{
    RandomKey key;
    key.value = random;
    return kernel_random(key, static_cast<std::uint64_t>(id), use, frame);
}

NoiseOptions noise_options(double time, double octaves, double seed)
{
    return {time, static_cast<int>(octaves), static_cast<std::uint32_t>(seed)};
}

// lua/numeric.lua has already checked the numbers.
double noise_at(double x, double y, double z, double time, double octaves, double seed)
{
    return noise(Vec3d(x, y, z), noise_options(time, octaves, seed));
}
void curl_noise_at(double x, double y, double z, double time, double octaves, double seed, double* curl)
{
    Eigen::Map<Vec3d>(curl, 3) = curl_noise(Vec3d(x, y, z), noise_options(time, octaves, seed));
}

// The shape is kept alive by lua/shape.lua, or by the pass through a StepShape.
double shape_distance(const void* shape, double x, double y, double z, double* gradient)
{
    const Vec3d P(x, y, z);
    double phi = 0;
    Vec3d slope;
    const auto* known = static_cast<const Shape*>(shape);
    if (const auto* step = known->moves() ? dynamic_cast<const StepShape*>(known) : nullptr) {
        const double since = KernelMoment::since_begin(*step);
        step->distance_at({&P, 1}, {&since, 1}, {&phi, 1}, {&slope, 1});
    } else {
        known->distance({&P, 1}, {&phi, 1}, {&slope, 1});
    }
    Eigen::Map<Vec3d>(gradient, 3) = slope;
    return phi;
}

void shape_velocity(const void* shape, double x, double y, double z, double* value)
{
    const auto* known = static_cast<const Shape*>(shape);
    const auto* step = known->moves() ? dynamic_cast<const StepShape*>(known) : nullptr;
    Eigen::Map<Vec3d>(value, 3) = known->velocity_at(Vec3d(x, y, z), step ? KernelMoment::since_begin(*step) : 0);
}

// shape: the mesh's surface in this step. A deforming mesh has the values of its first file.
std::int32_t mesh_value(const void* mesh, const void* shape, const char* name, double x, double y, double z,
                        double* value)
{
    const auto* step = dynamic_cast<const StepShape*>(static_cast<const Shape*>(shape));
    const auto* surface = step ? dynamic_cast<const MovingBody*>(&step->shape()) : nullptr;
    if (!surface) return 0;
    const MeshSurfaces surfaces{*surface, dynamic_cast<const MovingBody*>(step->at_rest())};
    return value_on_mesh(*static_cast<const Mesh*>(mesh), surfaces, name, {x, y, z}, KernelMoment::since_begin(*step),
                         std::span<double, 3>(value, 3));
}

// The grid is kept alive in the same way.
template <class G>
typename G::Value sample(const void* grid, const Vec3d& P)
{
    const auto* known = static_cast<const G*>(grid);
    typename G::Value found;
    const std::optional<double> now = known->varies() ? KernelMoment::time() : std::nullopt;
    if (now)
        known->sample_at({&P, 1}, {&*now, 1}, {&found, 1});
    else
        known->sample({&P, 1}, {&found, 1});
    return found;
}

void vector_grid_sample(const void* grid, double x, double y, double z, double* value)
{
    Eigen::Map<Vec3d>(value, 3) = sample<VectorGrid>(grid, {x, y, z});
}

double fog_sample(const void* fog, double x, double y, double z) { return sample<DensityGrid>(fog, {x, y, z}); }

}  // namespace

void set_kernel_functions(lua_State* L)
{
    const auto set = [L](const char* name, auto* function) {
        lua_pushlightuserdata(L, reinterpret_cast<void*>(function));
        lua_setfield(L, -2, name);
    };
    set("rand", &draw);
    set("noise", &noise_at);
    set("curl_noise", &curl_noise_at);
    set("shape_distance", &shape_distance);
    set("shape_velocity", &shape_velocity);
    set("mesh_value", &mesh_value);
    set("vector_grid_sample", &vector_grid_sample);
    set("fog_sample", &fog_sample);
    const auto set_all = [&](const char* field, const auto& functions) {
        lua_newtable(L);
        for (const auto& [name, function] : functions) set(name.data(), function);
        lua_setfield(L, -2, field);
    };
    set_all("math_functions1", math_functions1);
    set_all("math_functions2", math_functions2);
}

namespace {

thread_local const KernelMoment* moment_of_thread = nullptr;

}  // namespace

KernelMoment::KernelMoment(const double* times, const std::int32_t* at)
    : times_(times), at_(at), outer_(moment_of_thread)
{
    moment_of_thread = this;
}

KernelMoment::~KernelMoment() { moment_of_thread = outer_; }

std::optional<double> KernelMoment::time()
{
    if (!moment_of_thread || !moment_of_thread->times_ || *moment_of_thread->at_ < 0) return std::nullopt;
    return moment_of_thread->times_[*moment_of_thread->at_];
}

double KernelMoment::since_begin(const StepShape& shape)
{
    const std::optional<double> now = time();
    return now ? *now - shape.begin() : shape.duration();
}

}  // namespace rapid
