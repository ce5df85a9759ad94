// A contact sheet: small pictures in rows, with a label below each.
#pragma once

#include <string>
#include <vector>

#include "runtime/picture/picture.h"

namespace rapid {

struct SheetTile {
    Picture picture;                 // width 0 means no picture
    std::vector<std::string> label;  // lines of ASCII; truncated to the tile's width
};

// Arranges tiles from left to right and top to bottom, in about as many rows as columns, at most 8,192 pixels wide. All
// tiles have the shape of the first picture, and others are fitted into it. Every `series` tiles form a series, which
// starts a row or fits within one if possible.
Picture contact_sheet(const std::vector<SheetTile>& tiles, std::size_t series = 1);

}  // namespace rapid
