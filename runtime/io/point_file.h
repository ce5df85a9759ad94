// A file of points that come in pieces, over a whole run: what .csv and .bgeo take is on its way to the disk at once;
// the other formats need all points at the end, which are kept in memory until then.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "runtime/io/format.h"

namespace rapid {

// How a format writes points that come in pieces, in the order in which they come.
class PointStream {
public:
    virtual ~PointStream() = default;
    virtual void append(const PointSet& points) = 0;
    // After the last piece; the caller finishes the file.
    virtual void finish() = 0;
};

// Begins a new file of points, whose pieces have the columns of `like` and no groups.
using BeginStream = std::unique_ptr<PointStream> (*)(OutputFile& file, const PointSet& like);

// Registers a format's during static initialisation: `RAPID_POINT_STREAM(".csv", stream_csv);` in the format's file.
struct PointStreamRegistration {
    PointStreamRegistration(const char* extension, BeginStream begin);
};
#define RAPID_POINT_STREAM(extension, begin) \
    static const ::rapid::PointStreamRegistration begin##_registration(extension, begin)

// Adds points that have the columns of `to`; groups and details stay behind.
void append_points(PointSet& to, const PointSet& from);

class PointFile {
public:
    // like: a set of the columns, without points and groups. Error: an unknown extension, or no place to write to.
    PointFile(const std::filesystem::path& path, const PointSet& like);

    // Adds points with these columns. Error: the file system's, or --memory's where they have to be kept.
    void append(const PointSet& points);
    // Names the file, which holds the points in the order in which they came, or, where the format has one, in its own.
    void finish();

private:
    void keep(const PointSet& points);

    const std::filesystem::path path_;
    const Format& format_;
    OutputFile file_;
    std::unique_ptr<PointStream> stream_;  // null: they are kept
    PointSet kept_;
};

}  // namespace rapid
