#include "bindings/run/part_record.h"

#include <fmt/format.h>

#include <limits>
#include <map>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

constexpr int record_version = 2;

}  // namespace

void PartRecord::identify(const std::map<std::string, std::string>& contents)
{
    identity.insert(contents.begin(), contents.end());
    identity["the version of rapid"] = RAPID_VERSION;
}

PartRecord PartRecord::read(const std::filesystem::path& file)
{
    PartRecord record;
    try {
        const CheckedJson json = CheckedJson::parse(InputFile(file).text());
        if (const int version = json.at("rapid_part").get<int>(); version != record_version)
            throw Error(fmt::format("has version {}; it must be {}", version, record_version));
        const auto number = json.at("part").get<std::int64_t>(), count = json.at("parts").get<std::int64_t>();
        if (number < 1 || number > count || count > max_parts) throw Error("is not the record of a part");
        record.part = {static_cast<int>(number), static_cast<int>(count)};
        if (!json.at("sample").is_null()) record.sample = json.at("sample").get<double>();
        record.frames.first = json.at("frames").at("first");
        record.frames.last = json.at("frames").at("last");
        record.frames.step = json.at("frames").at("step");
        constexpr std::int64_t least = std::numeric_limits<std::int32_t>::min();
        constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
        const auto [first, last, step] = record.frames;
        if (first < least || last < first || last > most || step < 1 || step > most) throw Error("has no frames");
        record.fps = json.at("fps");
        if (!(record.fps > 0)) throw Error("has no frames per second");
        record.start = json.at("start");
        for (const CheckedJson& written : json.at("files"))
            record.files[written.at("frame").get<std::int64_t>()] = {written.at("points").get<std::uint64_t>(),
                                                                     written.at("hash").get<std::string>()};
        record.identity = json.at("identity").get<std::map<std::string, std::string>>();
        return record;
    } catch (Error& error) {
        throw error.at({file.string(), 0});
    } catch (const CheckedJson::parse_error& error) {  // its text holds all of the unparsable input
        throw Error(fmt::format("is not the record of a part: byte {} is not valid JSON", error.byte))
            .at({file.string(), 0});
    } catch (const CheckedJson::exception& error) {
        throw Error(fmt::format("is not the record of a part: {}", error.what())).at({file.string(), 0});
    }
}

void PartRecord::write(const std::filesystem::path& file) const
{
    JsonText json(2);
    json.begin_object();
    json.members("rapid_part", record_version, "part", part.number, "parts", part.count, "sample", sample, "frames",
                 [&] { json.object("first", frames.first, "last", frames.last, "step", frames.step); });
    json.members("fps", fps, "start", start);
    json.list("files", files, [&](const auto& written) {
        json.object("frame", written.first, "points", written.second.points, "hash", written.second.hash);
    });
    json.member("identity", identity);
    json.end();
    write_whole(file, json.text() + '\n');
}

std::string difference(const PartRecord& there, const PartRecord& here)
{
    std::vector<std::string> found;
    const auto compare = [&](const std::string& name, const std::string& a, const std::string& b) {
        if (a != b) found.push_back(fmt::format("{} is {} there and {} here", name, a, b));
    };
    const auto of = [](const PartRecord& record, const std::string& name) {
        const auto known = record.identity.find(name);
        return known == record.identity.end() ? std::string("not given") : known->second;
    };
    const auto frames = [](const RunFrames& f) { return fmt::format("{}-{}x{}", f.first, f.last, f.step); };
    const auto sample = [](const PartRecord& record) {
        return record.sample ? fmt::format("{}", *record.sample) : "all";
    };
    compare("the number of parts", fmt::format("{}", there.part.count), fmt::format("{}", here.part.count));
    compare("the sample", sample(there), sample(here));
    compare(name_of(Setting::Frames), frames(there.frames), frames(here.frames));
    compare("fps", fmt::format("{}", there.fps), fmt::format("{}", here.fps));
    compare("the first frame", fmt::format("{}", there.start), fmt::format("{}", here.start));
    std::map<std::string, std::string> names = there.identity;
    names.insert(here.identity.begin(), here.identity.end());
    for (const auto& [name, value] : names) compare(name_in_message(name), of(there, name), of(here, name));
    return fmt::format("{}", fmt::join(found, "; "));
}

std::filesystem::path part_record_file(const std::string& pattern, std::string_view output)
{
    return FramePattern(pattern).without_frame(output) + ".json";
}

std::string name_in_message(const std::string& name)
{
    static const std::map<std::string, Setting> settings = {{events_entry, Setting::Events},
                                                            {part_entry, Setting::Part},
                                                            {sample_entry, Setting::Sample},
                                                            {seed_entry, Setting::Seed}};
    const auto found = settings.find(name);
    return found == settings.end() ? name : name_of(found->second);
}

}  // namespace rapid
