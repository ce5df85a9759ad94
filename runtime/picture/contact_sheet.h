// A contact sheet: small pictures in rows, with a label below each.
#pragma once

#include <string>
#include <vector>

#include "runtime/picture/picture.h"

namespace rapid {

struct SheetTile {
    Picture picture;                 // of width 0: none
    std::vector<std::string> label;  // lines of ASCII; what does not fit is cut
};

// Tiles from left to right and from the top, in about as many rows as columns; at most 8,192 pixels wide. All have the
// shape of the first picture; others are fitted into it. So many tiles each are a series, which begins with a row, or
// lies in one, where that is possible.
Picture contact_sheet(const std::vector<SheetTile>& tiles, std::size_t series = 1);

}  // namespace rapid
