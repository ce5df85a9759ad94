#include "runtime/io/format.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/io/text_table.h"

namespace rapid {
namespace {

std::vector<Format>& registry()
{
    static std::vector<Format> formats;
    return formats;
}

std::string lower_extension(const std::filesystem::path& path)
{
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return extension;
}

// Throws Error if P, v or id of a file has another type than Rapid's.
void check_type(const PointSet& points, const char* name, AttributeType type)
{
    const AttributeType found = type_of(*points.find(name));
    if (found != type)
        throw Error(fmt::format("the attribute {} is {}; it must be {}", name, type_name(found), type_name(type)));
}

}  // namespace

FormatRegistration::FormatRegistration(Format format)
{
    std::vector<Format>& all = registry();
    const auto after =
        std::find_if(all.begin(), all.end(), [&](const Format& other) { return other.extension > format.extension; });
    all.insert(after, std::move(format));
}

const std::vector<Format>& formats() { return registry(); }

const Format& format_of(const std::filesystem::path& path)
{
    const std::string extension = lower_extension(path);
    std::string known;
    for (const Format& format : registry()) {
        if (format.extension == extension) return format;
        known += (known.empty() ? "" : ", ") + format.extension;
    }
    const std::string found = extension.empty() ? std::string("the name has no extension")
                                                : fmt::format("unknown extension \"{}\"", extension);
    throw Error(fmt::format("{}; it must be one of {}", found, known)).at({path.string(), 0});
}

void write_as(const Format& format, OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    format.write(file, format.holds_strings ? points : without_strings(points), frame);
}

PointSet read_points(const std::filesystem::path& path)
{
    const Format& format = format_of(path);
    if (!format.read)
        throw Error(fmt::format("points can't be read from a {} file", format.extension)).at({path.string(), 0});
    try {
        PointSet points = format.read(path);
        check_type(points, "P", AttributeType::Vec3);
        check_type(points, "v", AttributeType::Vec3);
        check_type(points, "id", AttributeType::Int64);
        return points;
    } catch (Error& error) {
        throw error.at({path.string(), 0});
    }
}

void write_points(const std::filesystem::path& path, const PointSet& points, const FrameInfo& frame)
{
    const Format& format = format_of(path);
    try {
        OutputFile file(path);
        write_as(format, file, points, frame);
        file.finish();
    } catch (Error& error) {
        throw error.at({path.string(), 0});
    }
}

}  // namespace rapid
