#include "bindings/command/run_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "bindings/scene/scene_inside.h"
#include "include/rapid/run.h"
#include "runtime/base/error.h"
#include "runtime/files/frame_pattern.h"

namespace rapid {
namespace {

// Reads "1,2.5,-3": only numbers, separated by commas.
std::vector<double> read_numbers(const std::string& text)
{
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
        double number = 0;
        const auto parsed = std::from_chars(at, end, number);
        if (parsed.ec != std::errc() || !std::isfinite(number)) return {};
        numbers.push_back(number);
        if (parsed.ptr == end) return numbers;
        if (*parsed.ptr != ',') return {};
        at = parsed.ptr + 1;
    }
}

std::string extensions(bool of_films)
{
    std::vector<std::string> known;
    for (const OutputFormat& format : SceneInside::output_formats())
        if (format.is_film == of_films) known.push_back(format.extension);
    return fmt::format("{}", fmt::join(known, " "));
}

void read_camera(const std::string& text, PictureSettings& pictures)
{
    const std::vector<double> n = read_numbers(text);
    const bool right = (n.size() == 6 || n.size() == 7) && (n.size() == 6 || (n[6] > 0 && n[6] < 180));
    if (!right || std::equal(n.begin(), n.begin() + 3, n.begin() + 3))
        throw Error(
            fmt::format("--camera = \"{}\"; it must be PX,PY,PZ,TX,TY,TZ or PX,PY,PZ,TX,TY,TZ,FOV: its position, its "
                        "target, which must differ, and its vertical angle of view in degrees",
                        text));
    pictures.camera.position = {n[0], n[1], n[2]};
    pictures.camera.target = {n[3], n[4], n[5]};
    if (n.size() == 7) pictures.camera.fov = n[6];
}

PictureSize read_size(const std::string& text)
{
    constexpr int most = 16384;  // pixels per edge; such a picture takes 10 GiB to draw
    PictureSize size;
    const char* const end = text.data() + text.size();
    const auto width = std::from_chars(text.data(), end, size.width);
    const bool has_x = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
    const auto height = has_x ? std::from_chars(width.ptr + 1, end, size.height) : width;
    if (!has_x || height.ec != std::errc() || height.ptr != end || std::min(size.width, size.height) < 1 ||
        std::max(size.width, size.height) > most)
        throw Error(fmt::format("--size = \"{}\"; it must be WIDTHxHEIGHT, each from 1 to {}", text, most));
    return size;
}

}  // namespace

void FileOptions::declare(Options& options)
{
    options
        .add_repeated(
            "-o,--output",
            [this](const std::vector<std::string>& strings) {
                for (const std::string& text : strings) parse_output_target(text);
                files_.outputs = strings;
            },
            fmt::format(
                "writes each frame: #### is its number, and the extension selects the format ({}; films: {}). After a "
                "colon, names of attributes to write in addition to P, v and id; without names all are written",
                extensions(/*of_films=*/false), extensions(/*of_films=*/true)))
        .type_name("PATTERN[:ATTR,ATTR]")
        .one_value();
    options
        .add_option(
            "--camera", [this](const std::string& text) { read_camera(text, files_.pictures); },
            "for pictures: the position of the camera, its target, and its vertical angle of view in degrees")
        .type_name("PX,PY,PZ,TX,TY,TZ[,FOV]");
    options
        .add_option(
            "--size", [this](const std::string& text) { files_.pictures.size = read_size(text); },
            "for pictures [default 1280x720]")
        .type_name("WIDTHxHEIGHT");
}

bool FileOptions::makes_films() const
{
    return std::any_of(names().begin(), names().end(),
                       [](const std::string& text) { return SceneInside::output_format(text).value().is_film; });
}

void CacheOptions::declare(Options& options, const std::string& doc_of_folder, const std::string& doc_of_again)
{
    options.add_option("--cache", folder_, doc_of_folder).type_name("DIR");
    options
        .add_option(
            "--cache-every", [this](const std::string& text) { every_ = read_whole("--cache-every", text, 0); },
            fmt::format(
                "with --cache: writes a snapshot after every Nth frame and after the last [default {}]; 0 writes none",
                RunCacheOptions().every))
        .type_name("N");
    options.add_flag("--again", again_, doc_of_again);
}

void CacheOptions::check() const
{
    if (!requested() && every_) throw Error("--cache-every sets how often snapshots are written; it needs --cache DIR");
}

SweptSetting read_swept_setting(const std::string& option, const std::string& text, const std::string& names)
{
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw Error(fmt::format("{} \"{}\"; it must be {}=VALUE,VALUE,...", option, text, names));
    SweptSetting setting{text.substr(0, equals), {""}};
    int depth = 0;
    for (const char c : text.substr(equals + 1)) {
        depth += (c == '{') - (c == '}');
        if (c == ',' && depth == 0)
            setting.values.emplace_back();
        else
            setting.values.back() += c;
    }
    for (const std::string& value : setting.values)
        if (value.empty()) throw Error(fmt::format("{} {}: a value is missing", option, setting.name));
    return setting;
}

}  // namespace rapid
