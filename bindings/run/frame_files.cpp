#include "bindings/run/frame_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/base/at_node.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/content_hash.h"
#include "runtime/io/format.h"
#include "runtime/io/text_table.h"
#include "runtime/operators/rasterize.h"
#include "runtime/picture/frame_picture.h"

namespace rapid {
namespace {

int frame_number(std::int64_t number)
{
    if (number < std::numeric_limits<int>::min() || number > std::numeric_limits<int>::max())
        throw Error(fmt::format("frame {} can't be written; frame numbers must fit into 32 bits", number));
    return static_cast<int>(number);
}

std::string full_path(const std::string& path) { return std::filesystem::absolute(path).lexically_normal(); }

std::string key_of(const OutputTarget& to)
{
    return to.attributes ? fmt::format("{}:{}", to.pattern, fmt::join(*to.attributes, ",")) : to.pattern;
}

}  // namespace

FrameFiles::FrameFiles(const std::vector<std::string>& outputs, std::shared_ptr<const PictureOptions> picture)
    : picture_(std::move(picture))
{
    for (const std::string& text : outputs) targets_.push_back({parse_output_target(text), text, {}});
}

std::vector<std::filesystem::path> folders_of(const std::vector<std::string>& outputs)
{
    std::vector<std::filesystem::path> folders;
    for (const std::string& text : outputs) {
        const std::string pattern = parse_output_target(text).pattern;
        std::filesystem::path folder = pattern.substr(0, pattern.find_first_of("#{$"));
        folder = folder.has_parent_path() ? folder.parent_path() : std::filesystem::path(".");
        std::error_code error;
        std::filesystem::create_directories(folder, error);
        if (error)
            throw Error(fmt::format("{} {}: can't make {}: {}", name_of(Setting::Output), text, folder.string(),
                                    error.message()));
        folders.push_back(folder);
    }
    return folders;
}

void FrameFiles::take_part(std::shared_ptr<const PartRecord> record)
{
    part_ = std::move(record);
    for (Target& target : targets_) target.to.pattern = name_in_part(target.to.pattern);
}

std::string FrameFiles::name_in_part(const std::string& pattern) const
{
    return part_ ? with_part(pattern, part_name(part_->part.number, part_->part.count)) : pattern;
}

void FrameFiles::check_part(const std::string& pattern) const
{
    if (!part_ && has_part(pattern))
        throw Error(fmt::format("{{part}} is the name of a part; give {}, or remove {{part}}", name_of(Setting::Part)));
}

std::vector<std::pair<std::string, std::string>> FrameFiles::merges() const
{
    std::vector<std::pair<std::string, std::string>> merges;
    for (const Target& target : targets_) {
        const std::string& pattern = target.to.pattern;
        if (has_part(pattern))
            throw Error(fmt::format("{} {}: with {} this is the name of the merged files; remove {{part}}",
                                    name_of(Setting::Output), target.text, name_of(Setting::Parts)));
        if (const Format& format = format_of(pattern); !format.read || format.film || format.positions_only)
            throw Error(fmt::format("{} {}: {} files of parts can't be merged; write points, or remove {}",
                                    name_of(Setting::Output), target.text, format.extension, name_of(Setting::Parts)));
        for (const std::string& output : target.outputs) {
            const std::string whole = FramePattern(pattern).for_output(output);
            merges.emplace_back(whole, with_part(whole, "{part}"));
        }
    }
    return merges;
}

// Records a frame of a part. A part that was complete has no record while it is written again.
void FrameFiles::note_frame(const std::string& pattern, const std::string& output, const FrameInfo& info,
                            std::uint64_t points)
{
    const std::filesystem::path file = part_record_file(pattern, output);
    if (begun_.insert(file).second) {
        std::error_code none;
        std::filesystem::remove(file, none);
        const auto start = static_cast<std::int64_t>(info.number - std::llround(info.time * info.fps));
        of_part_.emplace(file, Sequence{pattern, output, info.fps, start});  // of a `:write` node
    }
    of_part_.at(file).points[info.number] = points;
}

void FrameFiles::write_part_records() const
{
    for (const auto& [file, sequence] : of_part_) {
        PartRecord record = *part_;
        record.fps = sequence.fps;
        record.start = sequence.start;
        const FramePattern pattern(sequence.pattern);
        for (std::int64_t frame = record.frames.first; frame <= record.frames.last; frame += record.frames.step) {
            const std::string path = pattern.expand(frame_number(frame), sequence.output);
            std::error_code none;
            if (!std::filesystem::exists(path, none)) continue;  // `rapid merge` reports that it is missing
            // A run that continues from a cache has not computed the earlier frames.
            const auto computed = sequence.points.find(frame);
            const bool is_read = computed == sequence.points.end() && format_of(path).read;
            record.files[frame] = {is_read                             ? read_points(path).size()
                                   : computed == sequence.points.end() ? 0
                                                                       : computed->second,
                                   hash_text(file_hash(path))};
        }
        record.write(file);
    }
}

PlanOptions FrameFiles::plan_options(std::optional<std::uint64_t> seed) const
{
    PlanOptions options;
    options.seed = seed;
    options.all_made = false;
    for (const Target& target : targets_) {
        if (const auto& names = target.to.attributes)
            options.attributes.insert(options.attributes.end(), names->begin(), names->end());
        else
            options.all_made = true;
    }
    return options;
}

void FrameFiles::check_film(const Format& format, const std::string& pattern) const
{
    if (FramePattern(pattern).has_frame())
        throw Error("a film is one file for all frames; remove the frame number from its name");
    if (needs_even_edges(format.extension) && (picture_->width % 2 != 0 || picture_->height % 2 != 0))
        throw Error(fmt::format("a {} film needs even edges; give another {} than {}x{}", format.extension,
                                name_of(Setting::PictureSize), picture_->width, picture_->height));
    require_ffmpeg();
}

void FrameFiles::resolve(const Plan& plan, bool several_frames)
{
    scene_ = std::make_unique<SceneOfPlan>(plan);
    for (const auto& [name, node] : plan.outputs) unrequested_[name] = plan.unrequested_columns(node);
    std::set<std::string> patterns;
    std::size_t of_pictures = 0;
    const auto check = [&](const std::string& pattern) {
        check_part(pattern);
        const Format& format = format_of(pattern);
        // Each pattern of pictures caches its drawing of the scene.
        if (format.film || format.extension == ".png")
            require_picture_memory(picture_->width, picture_->height, scene_->may_have_colliders(),
                                   static_cast<double>(++of_pictures),
                                   ("give a smaller " + name_of(Setting::PictureSize)).c_str());
        if (format.film)
            check_film(format, pattern);
        else if (several_frames && !FramePattern(pattern).has_frame())
            throw Error("several frames would go into one file; put #### into the name for the frame number");
        if (!patterns.insert(pattern).second)
            throw Error("the same files would be written twice; give each a different pattern");
    };
    for (const PlannedNode& planned : plan.nodes) {
        const auto file = planned.node->arguments.find("file");
        const bool is_volume = planned.node->type->name == "rasterize";
        if ((planned.node->type->name != "write" && !is_volume) || file == planned.node->arguments.end()) continue;
        try {
            const std::string* pattern = file->second.get<std::string>();
            if (!pattern) continue;
            check(name_in_part(*pattern));
            of_nodes_.push_back({name_in_part(*pattern), planned.node->name, planned.node->location});
            if (is_volume)
                volumes_[*pattern] = {static_cast<const Rasterize*>(planned.op->fields()), planned.node->name,
                                      planned.node->location};
        } catch (const Error& error) {
            throw Error(fmt::format("file = {}: {}", describe(file->second), error.message()), error.kind())
                .in_node(planned.node->name)
                .at(planned.node->location);
        }
    }
    for (Target& target : targets_) {
        try {
            check(target.to.pattern);
            resolve(target, plan);
            for (const std::string& output : target.outputs) {
                const PlannedSimulation& of = plan.simulations[plan.nodes[plan.outputs.at(output)].simulation];
                if (part_)
                    of_part_.emplace(part_record_file(target.to.pattern, output),
                                     Sequence{target.to.pattern, output, of.fps, of.start});
            }
        } catch (const Error& error) {
            throw Error(fmt::format("{} {}: {}", name_of(Setting::Output), target.text, error.message()), error.kind());
        }
    }
}

void FrameFiles::claim(WrittenNames& names, const RunFrames& frames) const
{
    for (const auto& [pattern, node, location] : of_nodes_) try {
            names.add(FramePattern(pattern), "main", frames, fmt::format("node \"{}\"", node));
        } catch (const Error& error) {
            throw Error(fmt::format("file = \"{}\": {}", pattern, error.message()), error.kind())
                .in_node(node)
                .at(location);
        }
    for (const Target& target : targets_)
        for (const std::string& output : target.outputs) try {
                names.add(FramePattern(target.to.pattern), output, frames,
                          name_of(Setting::Output) + " " + target.text);
            } catch (const Error& error) {
                throw Error(fmt::format("{} {}: {}", name_of(Setting::Output), target.text, error.message()),
                            error.kind());
            }
}

void FrameFiles::claim(const std::filesystem::path& folder, const std::string& who) const
{
    for (const auto& [pattern, node, location] : of_nodes_) try {
            claim_among_processes(folder, who, FramePattern(pattern).for_output("main"));
        } catch (const Error& error) {
            throw Error(fmt::format("file = \"{}\": {}", pattern, error.message()), error.kind())
                .in_node(node)
                .at(location);
        }
}

void FrameFiles::resolve(Target& target, const Plan& plan) const
{
    std::vector<std::string> outputs;
    for (const auto& [name, place] : plan.outputs) outputs.push_back(name);
    if (FramePattern(target.to.pattern).has_output() || outputs.size() == 1)
        target.outputs = outputs;
    else if (plan.outputs.count("main"))
        target.outputs = {"main"};
    else
        throw Error(
            fmt::format("the graph has several outputs, and none is called main ({}); put {{output}} into the pattern",
                        fmt::join(outputs, ", ")));

    const std::set<std::string> in_scene = plan.names_of_scene();
    const std::vector<std::string> known(in_scene.begin(), in_scene.end());
    for (const std::string& name : target.to.attributes.value_or(std::vector<std::string>()))
        if (!in_scene.count(name) && !known_attribute(name))
            throw Error(fmt::format("no attribute or group \"{}\" to write{}", name, did_you_mean(name, known)));
}

FrameInfo FrameFiles::info_of(std::int64_t number, double time, double fps, const OutputTarget& to)
{
    FrameInfo info;
    info.number = frame_number(number);
    info.time = time;
    info.fps = fps;
    info.picture = picture_;
    if (const Format& format = format_of(to.pattern); format.film || format.extension == ".png")
        info.scene = scene_->at(number);
    return info;
}

std::string FrameFiles::how_of(const OutputTarget& to, const RunFrames& frames) const
{
    std::string how = to.attributes ? fmt::format("of {}", fmt::join(*to.attributes, ",")) : "";
    const Format& format = format_of(to.pattern);
    if (!format.film && format.extension != ".png") return how;
    how += fmt::format("; {}x{}", picture_->width, picture_->height);
    for (const auto& place : {picture_->position, picture_->target})
        if (place) how += fmt::format(" {},{},{}", place->x(), place->y(), place->z());
    if (picture_->fov) how += fmt::format(" {}", *picture_->fov);
    // The camera of a picture depends on earlier pictures.
    how += fmt::format("; from {} in steps of {}", frames.first, frames.step);
    if (format.film) how += fmt::format(" to {}", frames.last);
    return how;
}

std::vector<FrameFiles::FrameFile> FrameFiles::files_of(std::int64_t frame, const RunFrames& frames) const
{
    std::vector<FrameFile> files;
    for (const Target& target : targets_)
        for (const std::string& output : target.outputs)
            files.push_back({FramePattern(target.to.pattern).expand(frame_number(frame), output),
                             how_of(target.to, frames), format_of(target.to.pattern).film});
    return files;
}

void FrameFiles::continue_after(WholeFiles whole, const RunFrames& frames)
{
    whole_ = std::move(whole);
    selection_ = frames;
}

const FrameFiles::WholeFiles::File* FrameFiles::whole_file(std::int64_t frame, const std::string& path,
                                                           const std::string& how) const
{
    const auto of_frame = whole_.frames.find(frame);
    if (of_frame == whole_.frames.end()) return nullptr;
    const auto found = of_frame->second.find(full_path(path));
    return found != of_frame->second.end() && found->second.how == how ? &found->second : nullptr;
}

void FrameFiles::submit(const OutputTarget& to, PointSet points, FrameInfo info, const std::string& output,
                        bool of_node)
{
    const std::string key = key_of(to);
    const FramePattern pattern(to.pattern);
    const std::string path = pattern.expand(info.number, output), how = how_of(to, selection_);
    const auto film = whole_.films.empty() ? whole_.films.end() : whole_.films.find(full_path(path));
    if (whole_file(info.number, path, how) || (film != whole_.films.end() && film->second == how)) return;
    std::shared_ptr<const PictureFit> before;
    if (const std::int64_t last = info.number - selection_.step; pattern.has_frame() && last >= selection_.first)
        if (const auto* file = whole_file(last, pattern.expand(frame_number(last), output), how)) before = file->fit;
    if (named_.insert(key + '\n' + output).second) first_names_.push_back(path);
    if (part_) note_frame(to.pattern, output, info, points.size());
    warn_of_strings(to, points);
    FrameWriter* writer = nullptr;
    {
        const std::lock_guard lock(mutex_);
        auto found = writers_.find(key);
        if (found == writers_.end())
            found = writers_.emplace(key, std::make_unique<Writer>(to, how, of_node, write_of(to.pattern))).first;
        writer = &found->second->frames;
    }
    writer->submit(std::move(points), std::move(info), output, std::move(before));
}

// Warns once for each attribute that a file cannot store.
void FrameFiles::warn_of_strings(const OutputTarget& to, const PointSet& points)
{
    const Format& format = format_of(to.pattern);
    if (format.holds_strings) return;
    for (const std::string& name : string_column_names(points)) {
        const auto& requested = to.attributes;
        if (requested && std::find(requested->begin(), requested->end(), name) == requested->end()) continue;
        if (!warned_.insert(to.pattern + '\n' + name).second) continue;
        std::string others;
        for (const Format& other : formats())
            if (other.read && other.holds_strings && !other.positions_only)
                others += (others.empty() ? "" : ", ") + other.extension;
        warnings_.push_back(fmt::format("{}: {} can't store strings, so \"{}\" is not written; use one of {}",
                                        to.pattern, format.extension, name, others));
    }
}

// Returns an empty function if the format of the extension writes by itself.
FrameWriter::Write FrameFiles::write_of(const std::string& pattern) const
{
    const auto volume = volumes_.find(pattern);
    if (volume == volumes_.end()) return {};
    const auto& [of, node, location] = volume->second;
    return [rasterize = *of, node, location](const std::filesystem::path& path, const PointSet& points) {
        name_errors(node, location, [&] { rasterize.write_volumes(path, points); });
    };
}

void FrameFiles::write(const FrameResult& result)
{
    for (const Target& target : targets_)
        for (const std::string& output : target.outputs) {
            PointSet points = result.outputs.at(output);
            if (!target.to.attributes)
                for (const std::string& name : unrequested_.at(output)) points.remove(name);
            submit(target.to, std::move(points),
                   info_of(result.frame, result.time.at(output), result.fps.at(output), target.to), output, false);
        }
}

void FrameFiles::write_node(const std::string& pattern, const PointSet& points, const Frame& frame, double fps)
{
    const OutputTarget to{name_in_part(pattern), std::nullopt};
    submit(to, points, info_of(std::llround(frame.number), frame.time, fps, to), "main", true);
}

void FrameFiles::finish(bool complete)
{
    // Finishes all writers, even after a failure, so that the frames that the others hold are not lost.
    std::exception_ptr first;
    for (auto& [key, writer] : writers_) try {
            writer->frames.finish(complete);
        } catch (...) {
            if (!first) first = std::current_exception();
        }
    if (first) std::rethrow_exception(first);
    if (complete && part_) write_part_records();
}

std::vector<FrameFiles::Written> FrameFiles::take_written()
{
    const std::lock_guard lock(mutex_);
    std::vector<Written> all;
    for (const auto& [key, writer] : writers_)
        for (FrameWriter::Written& file : writer->frames.take_written())
            all.push_back({std::move(file), writer->how, writer->of_node});
    return all;
}

std::optional<std::int64_t> FrameFiles::first_unwritten() const
{
    const std::lock_guard lock(mutex_);
    std::optional<std::int64_t> first;
    for (const auto& [key, writer] : writers_)
        if (const std::optional<int> frame = writer->frames.first_unwritten())
            first = std::min(first.value_or(*frame), std::int64_t{*frame});
    return first;
}

}  // namespace rapid
