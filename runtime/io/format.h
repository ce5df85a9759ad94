// File formats of point sets, chosen by the extension of a file. Each format registers itself from a file of its own.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/files/output_file.h"
#include "runtime/picture/frame_info.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct Format {
    std::string extension;  // with the dot, lower case: ".vdb"
    std::string doc;        // one line, for the help
    // Writes all columns and groups of `points` to a new file; the caller finishes it. Throws Error if the disk is
    // full, or if the format cannot hold a value (int64 ids); the message lists the formats that can.
    void (*write)(OutputFile& file, const PointSet& points, const FrameInfo& frame);
    // Null if the format cannot be read (.png). Matrices are skipped; an attribute of n other numbers becomes the
    // floats or integers NAME0 ... NAMEn-1. Without an id in the file, points are numbered from 0.
    PointSet (*read)(const std::filesystem::path& path);
    // True if one file contains all frames of a sequence (film.h).
    bool film = false;
    // True if the format holds only the positions of points.
    bool positions_only = false;
    // True if the format holds string attributes; otherwise write_as() drops them.
    bool holds_strings = true;
    // True for text with independent lines and no stated length: a file cut after a line is another whole file.
    bool lines_stand_alone = false;
};

// All formats, in order of extension.
const std::vector<Format>& formats();
// Throws Error if the extension is unknown; the message lists the known ones.
const Format& format_of(const std::filesystem::path& path);

// Registers a format during static initialisation: `RAPID_FORMAT(Format{".csv", ...});` in the file of the format.
struct FormatRegistration {
    explicit FormatRegistration(Format format);
};
#define RAPID_FORMAT(...) RAPID_FORMAT_COUNTED(__COUNTER__, __VA_ARGS__)  // files may be compiled as one
#define RAPID_FORMAT_COUNTED(count, ...) RAPID_FORMAT_NUMBER(count, __VA_ARGS__)
#define RAPID_FORMAT_NUMBER(count, ...) static const ::rapid::FormatRegistration format_##count(__VA_ARGS__)

// Registers a format that is only read: `RAPID_POINT_READER(".vtk", read_vtk);`.
using ReadPoints = PointSet (*)(const std::filesystem::path& path);
struct PointReaderRegistration {
    PointReaderRegistration(const char* extension, ReadPoints read);
};
#define RAPID_POINT_READER(extension, read) \
    static const ::rapid::PointReaderRegistration read##_registration(extension, read)

// Returns the formats that are only read, by extension.
const std::map<std::string, ReadPoints>& point_readers();

// Calls Format::write, without the strings if the format holds none.
void write_as(const Format& format, OutputFile& file, const PointSet& points, const FrameInfo& frame);

// Reads a file of any readable format. Errors name the file.
PointSet read_points(const std::filesystem::path& path);

// Writes a file, which gets its name only when it is complete; missing folders are made. Errors name the file.
void write_points(const std::filesystem::path& path, const PointSet& points, const FrameInfo& frame = {});

}  // namespace rapid
