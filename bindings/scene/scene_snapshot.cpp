// Snapshots, in memory and in files.
#include <fmt/format.h>

#include <utility>

#include "bindings/scene/scene_data.h"
#include "bindings/scene/scene_inside.h"
#include "bindings/scene/state_file_io.h"
#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/report/number_text.h"

namespace rapid {
namespace {

constexpr char snapshot_file_type[] = "snapshot of a scene";

// Returns the members of a file's header, except those of its format.
CheckedJson members_of(const std::string& path)
{
    const StateFile file(path);
    CheckedJson json = file.header();
    json.erase("blocks");
    json["bytes"] = file.bytes();
    return json;
}

std::string members_as_text(const std::string& path, const CheckedJson& members)
{
    const auto word = [](const CheckedJson& value) {
        constexpr std::size_t most = 4000;  // bytes: the code of some hundred functions
        return shortened(value.is_string() ? value.get<std::string>() : json_text(value), most);
    };
    std::string text =
        fmt::format("{}: a snapshot, {} bytes\n", path, with_separators(members.at("bytes").get<std::uint64_t>()));
    const auto add = [&](const char* key, const char* unit) {
        if (!members.contains(key)) return;
        for (const auto& [name, value] : members.at(key).items())
            text += fmt::format("  {}  {}{}\n", printable_name(name), word(value), unit);
    };
    if (members.contains("graph"))
        text += fmt::format("of {} after frame {}\n", word(members.at("graph")), word(members.at("frame")));
    text += "simulations\n";
    add("simulations", " bytes");
    text += "nodes with state\n";
    add("nodes", " bytes");
    text += "fingerprint\n";
    add("fingerprint", "");
    return text;
}

}  // namespace

SceneSnapshot::SceneSnapshot(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
std::int64_t SceneSnapshot::frame() const { return data_->snapshot.frame; }
std::size_t SceneSnapshot::size() const
{
    std::size_t bytes = data_->snapshot.size();
    for (const OfferedPath& path : data_->meshes) bytes += path.bytes();
    return bytes;
}

Result<Done> SceneSnapshot::write(const std::string& path) const { return SceneInside::save(*this, path, ""); }

Result<Done> SceneInside::save(const SceneSnapshot& saved, const std::string& path, const std::string& key)
{
    return with_file_name(path, [&] {
        const Snapshot& snapshot = saved.data_->snapshot;
        CheckedJson header = {{"what", snapshot_file_type}, {"graph", saved.data_->file}, {"frame", snapshot.frame}};
        if (!key.empty()) header["key"] = key;
        for (const auto& [name, state] : snapshot.simulations) header["simulations"][name] = state.size();
        for (const auto& [name, state] : snapshot.nodes) header["nodes"][name] = state.size();
        header["fingerprint"] = {{"Rapid", RAPID_ABI}, {"nodes", saved.data_->nodes}};
        write_state(path, std::move(header), state_of(*saved.data_));
        return Done();
    });
}

SceneSnapshot SceneSnapshot::Data::read_from(const StateFile& file)
{
    if (file.header().at("what") != snapshot_file_type)
        throw Error("it belongs to the cache of a run, which resumes from it by itself");
    const CheckedJson& fingerprint = file.header().at("fingerprint");
    require_this_build(fingerprint.at("Rapid").get<std::string>());
    auto data = std::make_shared<Data>();
    data->file = file.header().at("graph").get<std::string>();
    data->nodes = fingerprint.at("nodes").get<std::string>();
    rapid::restore(*data, file.state());
    return SceneSnapshot(std::move(data));
}

Result<SceneSnapshot> SceneSnapshot::read(const std::string& path)
{
    return with_file_name(path, [&] { return Data::read_from(StateFile(path)); });
}

Result<SceneSnapshot> SceneInside::load_snapshot(const std::string& path, const std::string& key)
{
    return with_file_name(path, [&] {
        const StateFile file(path);
        require_key(file.header(), key);
        return SceneSnapshot::Data::read_from(file);
    });
}

bool SceneInside::is_snapshot(const std::string& path) { return StateFile::is_one(path); }

Result<SceneReport> SceneInside::describe_snapshot(const std::string& path)
{
    return with_file_name(path, [&] {
        const CheckedJson members = members_of(path);
        return SceneReport{members_as_text(path, members), json_text(members)};
    });
}

}  // namespace rapid
