// File formats of point sets, chosen by a file's extension. A format is one file: it registers itself.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/picture/frame_info.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct Format {
    std::string extension;  // with the dot, lower case: ".vdb"
    std::string doc;        // a line for the help
    // Writes all columns and groups of `points` to `path`, a new file: the caller gives an unfinished name and renames
    // it. Error: what could not be written (a full disk, int64 ids in a format that can't hold them), naming what can.
    void (*write)(const std::filesystem::path& path, const PointSet& points, const FrameInfo& frame);
    // Null where a format can't be read back (.png). Text and matrices, which points do not hold, are left out; an
    // attribute of n other numbers becomes the floats or integers NAME0 ... NAMEn-1. Without an id in the file, points
    // are numbered from 0.
    PointSet (*read)(const std::filesystem::path& path);
};

// Formats in order of extension.
const std::vector<Format>& formats();
// Error: an unknown extension, with the known ones.
const Format& format_of(const std::filesystem::path& path);

// Registers a format while the program starts: `RAPID_FORMAT(Format{".csv", ...});` in the format's own file.
struct FormatRegistration {
    explicit FormatRegistration(Format format);
};
#define RAPID_FORMAT(...) static const ::rapid::FormatRegistration format_registration(__VA_ARGS__)

// Reads any file whose format can be read. Errors name the file.
PointSet read_points(const std::filesystem::path& path);

// Writes one file, which has its name only when it is complete; missing folders are made. Errors name the file.
void write_points(const std::filesystem::path& path, const PointSet& points, const FrameInfo& frame = {});

}  // namespace rapid
