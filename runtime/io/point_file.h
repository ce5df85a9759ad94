// A file of points that arrive in pieces during a whole run. .csv and .bgeo write them to the disk immediately. Other
// formats need all points at the end and store them in memory until then.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "runtime/io/format.h"

namespace rapid {

// Writes points that arrive in pieces, in the order of arrival.
class PointStream {
public:
    virtual ~PointStream() = default;
    virtual void append(const PointSet& points) = 0;
    // Called after the last piece. The caller finishes the file.
    virtual void finish() = 0;
};

// Begins a new file of points. The pieces have the columns of `like` and no groups.
using BeginStream = std::unique_ptr<PointStream> (*)(OutputFile& file, const PointSet& like);

// Registers a stream of a format during static initialisation: `RAPID_POINT_STREAM(".csv", stream_csv);` in the
// format's file.
struct PointStreamRegistration {
    PointStreamRegistration(const char* extension, BeginStream begin);
};
#define RAPID_POINT_STREAM(extension, begin) \
    static const ::rapid::PointStreamRegistration begin##_registration(extension, begin)

// Appends points that have the columns of `to`, without groups and details.
void append_points(PointSet& to, const PointSet& from);

class PointFile {
public:
    // like: an empty set with the columns. Throws Error if the extension is unknown or the file can't be created.
    PointFile(const std::filesystem::path& path, const PointSet& like);

    // Appends points with these columns. Throws Error if the file system does, or if stored points exceed --memory.
    void append(const PointSet& points);
    // Names the file. It has the points in the order of arrival, or in the format's own order.
    void finish();

private:
    void keep(const PointSet& points);

    const std::filesystem::path path_;
    const Format& format_;
    OutputFile file_;
    std::unique_ptr<PointStream> stream_;  // null: points are stored in `collected_`
    PointSet collected_;
};

}  // namespace rapid
