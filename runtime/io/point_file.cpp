#include "runtime/io/point_file.h"

#include <fmt/format.h>

#include <map>
#include <variant>

#include "runtime/memory_budget.h"

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

// Calls f; its errors name the file.
template <class F>
auto of_file(const std::filesystem::path& path, const F& f)
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

PointFile::PointFile(const std::filesystem::path& path, const PointSet& like)
    : path_(path),
      format_(format_of(path)),
      file_(of_file(path, [&] { return OutputFile(path); })),
      stream_(of_file(path, [&] { return begin_stream(format_, file_, like); })),
      kept_(like)
{
}

void PointFile::append(const PointSet& points)
{
    of_file(path_, [&] { stream_ ? stream_->append(points) : keep(points); });
}

void PointFile::finish()
{
    of_file(path_, [&] {
        stream_ ? stream_->finish() : format_.write(file_, kept_, {});
        file_.finish();
    });
}

void PointFile::keep(const PointSet& points)
{
    const std::size_t before = kept_.size();
    // Columns grow by as much again, and writing takes a part of them.
    const double bytes = static_cast<double>(kept_.bytes() + points.bytes());
    if (!fits_in_memory(bytes))
        throw beyond_memory(
            fmt::format("{} points, which {} takes all at once,", before + points.size(), format_.extension), bytes,
            "write .csv or .bgeo, which take them as they come");
    kept_.append(points.size());
    for (const auto& [name, column] : points.columns())
        std::visit(
            [&](const auto& from) {
                using T = std::decay_t<decltype(from[0])>;
                const std::span<T> to = kept_.column<T>(name).write().subspan(before);
                for (std::size_t i = 0; i < points.size(); ++i) to[i] = from[i];
            },
            column);
}

}  // namespace rapid
