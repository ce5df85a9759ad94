// Small pictures in rows.
#include "include/rapid/picture_sheet.h"

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
        std::vector<SheetTile> tiles;
        for (const SheetPicture& picture : pictures)
            tiles.push_back({picture.file.empty() ? Picture() : read_png(picture.file), picture.label});
        return encode_png(contact_sheet(tiles, std::min(series, pictures.size())));
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace rapid
