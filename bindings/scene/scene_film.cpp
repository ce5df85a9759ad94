// Films of frames.
#include "bindings/scene/scene_film.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "bindings/scene/scene_data.h"
#include "bindings/scene/scene_error.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/io/film.h"
#include "runtime/io/frame_writer.h"
#include "runtime/picture/contact_sheet.h"
#include "runtime/picture/frame_picture.h"
#include "runtime/picture/png_file.h"

namespace rapid {

struct [[gnu::visibility("hidden")]] SceneFilm::Impl
{
    FilmOptions options;
    std::shared_ptr<const PictureOptions> picture;
    FrameWriter writer;
    std::int64_t added = 0, written = 0;
    bool is_finished = false;

    Impl(const std::string& path, const FilmOptions& of)
        : options(of), picture(picture_options(of.camera, of.size)), writer({{path, {}}}, 1)
    {
    }
};

SceneFilm::SceneFilm(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SceneFilm::SceneFilm(SceneFilm&&) noexcept = default;
SceneFilm& SceneFilm::operator=(SceneFilm&&) noexcept = default;
SceneFilm::~SceneFilm() = default;

Result<SceneFilm> SceneFilm::begin(const std::string& path, const FilmOptions& options)
{
    try {
        const std::string extension = std::filesystem::path(path).extension();
        if (extension != ".mp4" && extension != ".webm" && extension != ".gif")
            refuse(fmt::format("a film can't be a \"{}\"; it must be .mp4, .webm or .gif", extension));
        if (!(options.fps >= 1 && options.fps <= 1000))
            refuse(fmt::format("{} frames per second; a film can have from 1 to 1000", options.fps));
        const auto [width, height] = options.size;
        if (std::min(width, height) < 1 || std::max(width, height) > 16384)
            refuse(fmt::format("a film of {} x {} can't be made; each side must be from 1 to 16384 pixels", width,
                               height));
        if (needs_even_edges(extension) && (width % 2 != 0 || height % 2 != 0))
            refuse(
                fmt::format("a {} film of {} x {} can't be made; both edges must be even", extension, width, height));
        const FramePattern pattern(path);
        if (pattern.has_frame() || pattern.has_output() || has_part(path))
            refuse(fmt::format("a film is one file, but \"{}\" is a pattern for several", path));
        constexpr bool may_have_colliders = true;
        require_picture_memory(width, height, may_have_colliders, 1, "give a smaller size");
        require_ffmpeg();
        return SceneFilm(std::make_unique<Impl>(path, options));
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<Done> SceneFilm::add(const SceneFrame& frame, const SceneShapes& shapes)
{
    try {
        if (impl_->is_finished) refuse("the film is finished; begin a new one");
        FrameInfo info;
        info.number = static_cast<int>(frame.number());
        info.time = static_cast<double>(impl_->added++) / impl_->options.fps;
        info.fps = impl_->options.fps;
        info.picture = impl_->picture;
        info.scene = shapes.data_ ? shapes.data_->scene : nullptr;
        impl_->writer.submit(frame.data_->result.outputs.at(frame.output_), std::move(info));
        impl_->written += static_cast<std::int64_t>(impl_->writer.take_written().size());
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

std::int64_t SceneFilm::done() const { return impl_->written; }

Result<Done> SceneFilm::finish()
{
    try {
        if (impl_->is_finished) refuse("the film is finished; begin a new one");
        if (impl_->added == 0) refuse("the film has no pictures; call add() first");
        impl_->is_finished = true;
        impl_->writer.finish();
        impl_->written = impl_->added;
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

// Small pictures in rows.
Result<std::string> picture_sheet(const std::vector<SheetPicture>& pictures, std::size_t series)
{
    try {
        if (pictures.empty()) refuse("there are no pictures; give one");
        if (series == 0) refuse("series = 0; it must be at least 1");
        constexpr std::size_t most = 4096;
        if (pictures.size() > most)
            refuse(fmt::format("there are {} pictures; a sheet has at most {}", pictures.size(), most));
        std::vector<SheetTile> tiles;
        for (const SheetPicture& picture : pictures)
            tiles.push_back({picture.file.empty() ? Picture() : read_png(picture.file), picture.label});
        constexpr int steepest = 16;  // height per width
        for (const SheetTile& tile : tiles)
            if (!tile.picture.rgb.empty() && tile.picture.height > steepest * tile.picture.width)
                refuse(fmt::format("a picture of {}x{} is too narrow for a sheet", tile.picture.width,
                                   tile.picture.height));
        return encode_png(contact_sheet(tiles, std::min(series, pictures.size())));
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace rapid
