// Small pictures in rows, with a label below each: many runs of a scene at a glance.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "include/rapid/scene.h"

namespace rapid {

// One of the pictures.
struct SheetPicture {
    std::string file;                // a .png; empty: none, and its place stays free
    std::vector<std::string> label;  // lines of ASCII, truncated to fit
};

// Returns the bytes of a .png with these pictures from left to right and from the top, in about as many rows as
// columns; at most 8,192 pixels wide. All are fitted into the shape of the first picture. `series` pictures each form a
// series, which begins a row or lies in one, if possible. Callable from any thread. Fails if a series is empty, if
// there are more than 4,096 pictures, if one is more than 16 times as high as wide, or if a file cannot be read or is
// not a .png.
Result<std::string> picture_sheet(const std::vector<SheetPicture>& pictures, std::size_t series = 1);

}  // namespace rapid
