// Small pictures in rows, with a label below each: many runs of a scene at a glance.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "include/rapid/scene.h"

namespace rapid {

// One of the pictures.
struct SheetPicture {
    std::string file;                // a .png; empty: there is none, and its place stays free
    std::vector<std::string> label;  // lines of ASCII; what does not fit is cut
};

// The bytes of a .png with these pictures from left to right and from the top, in about as many rows as columns; at
// most 8,192 pixels wide. All have the shape of the first picture; others are fitted into it. So many pictures each are
// a series, which begins with a row, or lies in one, where that is possible. From any thread. Error: a series of none;
// more than 4,096 pictures; one that is more than 16 times as high as wide; a file that can't be read, or is no .png.
Result<std::string> picture_sheet(const std::vector<SheetPicture>& pictures, std::size_t series = 1);

}  // namespace rapid
