#include "runtime/picture/picture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "runtime/picture/marks.h"
#include "runtime/picture/tone.h"

namespace rapid {

// The drawing of a view and its shapes, and the inputs for which it is valid.
struct Painter::StillLayer {
    PictureOptions options;
    std::shared_ptr<const PictureScene> scene;
    Camera camera;
    Box3d bounds;
    double line_spacing;
    Light light;
    std::vector<SurfaceTile> tiles;

    StillLayer(const PictureOptions& of, const std::shared_ptr<const PictureScene>& in, const PictureView& view)
        : options(of),
          scene(in),
          camera(view.camera),
          bounds(view.bounds),
          line_spacing(view.line_spacing),
          light(*in, view),
          tiles(draw_surfaces(of, *in, view, light))
    {
    }

    bool is_of(const PictureOptions& of, const std::shared_ptr<const PictureScene>& in, const PictureView& view) const
    {
        return options.width == of.width && options.height == of.height && options.grid == of.grid && scene == in &&
               camera.position == view.camera.position && camera.target == view.camera.target &&
               camera.fov == view.camera.fov && bounds.min() == view.bounds.min() &&
               bounds.max() == view.bounds.max() && line_spacing == view.line_spacing;
    }
};

Painter::Painter() = default;
Painter::~Painter() = default;

Picture Painter::draw(const PointSet& points, const PictureOptions& options,
                      const std::shared_ptr<const PictureScene>& scene, const PictureView& view)
{
    if (!still_ || !still_->is_of(options, scene, view)) {
        still_.reset();  // first, because those of a large picture take gigabytes
        still_ = std::make_unique<StillLayer>(options, scene, view);
    }
    Light& light = still_->light;
    const Lens lens = Lens::of_camera(view.camera, options.width, options.height);
    const double distance = (view.camera.target - view.camera.position).norm();
    light.gather(points, shadow_opacity(points, *scene), static_cast<float>(view.min_radius * distance) / lens.focal);
    const TileGrid tiles{options.width, options.height};
    const Marks marks = make_marks(points, tiles, *scene, view, light);

    Picture picture{options.width, options.height, {}};
    picture.rgb.resize(3 * static_cast<std::size_t>(options.width) * options.height);
    tbb::parallel_for(0, tiles.count(), [&](int tile) {
        const SurfaceTile& still = still_->tiles[tile];
        const bool shaded = light.may_shade(still.cells), empty = marks.first[tile] == marks.first[tile + 1];
        const int left = tiles.left(tile), top = tiles.top(tile), across = tiles.right(tile) - left;
        const auto row = [&](int y) { return &picture.rgb[3 * (static_cast<std::size_t>(y) * options.width + left)]; };
        if (empty && !shaded) {
            for (int y = top; y < tiles.bottom(tile); ++y)
                std::memcpy(row(y), &still.bytes[3 * static_cast<std::size_t>((y - top) * tile_size)], 3 * across);
            return;
        }
        std::array<Vec3f, tile_pixels> colour;
        std::copy(still.colour.begin(), still.colour.end(), colour.begin());
        if (shaded)
            for (const SurfaceTile::Lit& lit : still.lit)
                colour[lit.pixel] -= (1 - light.point_transmittance(lit.cell)) * lit.lamp;
        if (!empty) draw_marks(marks, tiles, tile, still, lens, light, colour);
        for (int y = top; y < tiles.bottom(tile); ++y)
            write_pixels({&colour[static_cast<std::size_t>((y - top) * tile_size)], static_cast<std::size_t>(across)},
                         left, y, row(y));
    });
    return picture;
}

Picture render(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
               const PictureView& view)
{
    return Painter().draw(points, options, std::make_shared<PictureScene>(scene), view);
}

}  // namespace rapid
