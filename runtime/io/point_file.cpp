#include "runtime/io/point_file.h"

#include <fmt/format.h>

#include <map>
#include <variant>

#include "runtime/base/memory_budget.h"

namespace rapid {
namespace {

std::map<std::string, BeginStream>& streams()
{
    static std::map<std::string, BeginStream> all;  // by extension
    return all;
}

std::unique_ptr<PointStream> begin_stream(const Format& format, OutputFile& file, const PointSet& like)
{
    const auto found = streams().find(format.extension);
    return found != streams().end() ? found->second(file, like) : nullptr;
}

// Calls f and adds the file to its errors.
template <class F>
auto with_file_name(const std::filesystem::path& path, const F& f)
{
    try {
        return f();
    } catch (Error& error) {
        throw error.at({path.string(), 0});
    }
}

}  // namespace

PointStreamRegistration::PointStreamRegistration(const char* extension, BeginStream begin)
{
    streams()[extension] = begin;
}

void append_points(PointSet& to, const PointSet& from)
{
    const std::size_t before = to.size();
    to.append(from.size());
    for (const auto& named : from.columns())
        std::visit(
            [&](const auto& values) {
                using T = std::decay_t<decltype(values[0])>;
                const std::span<T> place = to.column<T>(named.first).write().subspan(before);
                for (std::size_t i = 0; i < from.size(); ++i) place[i] = values[i];
            },
            named.second);
}

PointFile::PointFile(const std::filesystem::path& path, const PointSet& like)
    : path_(path),
      format_(format_of(path)),
      file_(with_file_name(path, [&] { return OutputFile(path); })),
      stream_(with_file_name(path, [&] { return begin_stream(format_, file_, like); })),
      collected_(like)
{
}

void PointFile::append(const PointSet& points)
{
    with_file_name(path_, [&] { stream_ ? stream_->append(points) : keep(points); });
}

void PointFile::finish()
{
    with_file_name(path_, [&] {
        stream_ ? stream_->finish() : write_as(format_, file_, collected_, {});
        file_.finish();
    });
}

void PointFile::keep(const PointSet& points)
{
    // Columns may grow to twice their size, and writing takes a part of them.
    const double bytes = static_cast<double>(collected_.bytes() + points.bytes());
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("{} points, which {} must hold in memory,", collected_.size() + points.size(),
                                          format_.extension),
                              bytes, "write .csv or .bgeo, which are written point by point");
    append_points(collected_, points);
}

}  // namespace rapid
