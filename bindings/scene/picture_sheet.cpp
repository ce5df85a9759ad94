// Small pictures in rows.
#include "bindings/scene/picture_sheet.h"

#include <fmt/format.h>

#include <algorithm>

#include "bindings/scene/scene_error.h"
#include "runtime/picture/contact_sheet.h"
#include "runtime/picture/png_file.h"

namespace rapid {

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
