#include "runtime/io/format.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <variant>
#include <vector>

#include "runtime/files/input_file.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

std::vector<Format>& registry()
{
    static std::vector<Format> formats;
    return formats;
}

std::map<std::string, ReadPoints>& reader_registry()
{
    static std::map<std::string, ReadPoints> readers;
    return readers;
}

std::string lower_extension(const std::filesystem::path& path)
{
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return extension;
}

// Makes numbers of Rapid's own names floats: other programs write whole ones as integers.
void take_floats(PointSet& points)
{
    for (const char* name : {"age", "life", "pscale", "mass", "Alpha"}) {
        const AnyColumn* column = points.find(name);
        if (!column) continue;
        std::visit(
            [&]<class T>(const Column<T>& numbers) {
                if constexpr (std::is_integral_v<T>) {
                    std::vector<float> floats(points.size());
                    for (std::size_t i = 0; i < floats.size(); ++i) floats[i] = static_cast<float>(numbers[i]);
                    points.set(name, Column<float>(std::span<const float>(floats)));
                }
            },
            *column);
    }
}

// Makes the velocity of another program v, unless the file has that.
void take_velocity(PointSet& points)
{
    const Column<Vec3f>* v = points.find<Vec3f>("v");
    if (!v || (!v->is_uniform() && !points.empty()) || (!points.empty() && !(*v)[0].isZero(0))) return;
    for (const char* name : {"velocity", "Velocity"})
        if (const auto* velocity = points.find<Vec3f>(name)) {
            points.v() = *velocity;
            points.remove(name);
            return;
        }
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

PointReaderRegistration::PointReaderRegistration(const char* extension, ReadPoints read)
{
    reader_registry()[extension] = read;
}

const std::map<std::string, ReadPoints>& point_readers() { return reader_registry(); }

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
    const auto only_read = point_readers().find(lower_extension(without_gz(path)));
    const Format* format = only_read == point_readers().end() ? &format_of(without_gz(path)) : nullptr;
    if (format && !format->read)
        throw Error(fmt::format("points can't be read from a {} file", format->extension)).at({path.string(), 0});
    try {
        PointSet points = format ? format->read(path) : only_read->second(path);
        take_floats(points);
        take_velocity(points);
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
