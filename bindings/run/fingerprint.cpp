#include "bindings/run/fingerprint.h"

#include <fmt/format.h>

#include <algorithm>

#include "bindings/host/modules.h"
#include "bindings/run/part_record.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/content_hash.h"
#include "runtime/graph/abi.h"
#include "runtime/graph/plugin.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

const std::string content = "content of ", code = "code of ";

// Distinguishes values bitwise, unlike describe().
std::string fingerprint_text(const Value& value);

std::string fingerprint_text(const Table& table)
{
    std::string text;
    const auto add = [&](const std::string& key, const Value& value) {
        text += fmt::format("{}{}{}", text.empty() ? "" : ", ", key, fingerprint_text(value));
    };
    for (const Value& value : table.list) add("", value);
    for (const auto& [key, value] : table.numbered) add(fmt::format("[{}] = ", key), value);
    for (const auto& [key, value] : table.named) add(key + " = ", value);
    return "{" + text + "}";
}

std::string fingerprint_text(const Value& value)
{
    constexpr std::size_t most = 100;  // bytes; longer texts are represented by their hash
    std::string text = "nothing";
    if (const bool* is = value.get<bool>()) text = *is ? "true" : "false";
    if (const double* number = value.get<double>()) text = fmt::format("{}", *number);
    if (const std::string* word = value.get<std::string>()) text = fmt::format("\"{}\"", *word);
    if (const Vec3d* v = value.get<Vec3d>()) text = fmt::format("{{{}, {}, {}}}", v->x(), v->y(), v->z());
    if (const auto* attribute = value.get<AttributeRef>()) text = fmt::format("rapid.attr \"{}\"", attribute->name);
    if (const Table* table = value.table()) text = fingerprint_text(*table);
    if (const auto* object = value.get<ObjectPtr>()) text = fmt::format("a {}", (*object)->kind());
    if (value.function()) text = "a function";
    if (text.size() <= most) return text;
    return fmt::format("{}... ({})", text.substr(0, most / 2), hash_text(content_hash(text)));
}

std::string name_of(const fs::path& file, const fs::path& folder)
{
    std::error_code error;
    const fs::path name = fs::proximate(file, folder.empty() ? fs::path(".") : folder, error);
    return error ? file.string() : name.string();
}

// "12:89ab... 20:cdef...": the line and the hash of each function.
std::string fingerprint_text(const std::vector<Session::FunctionCode>& functions)
{
    std::string text;
    for (const auto& [line, hash] : functions)
        text += fmt::format("{}{}:{}", text.empty() ? "" : " ", line, hash_text(hash));
    return text;
}

void add_node(Fingerprint& fingerprint, const PlannedNode& planned, const Plan& plan)
{
    const Node& node = *planned.node;
    std::string inputs;
    for (const std::size_t input : planned.inputs)
        inputs += fmt::format("{}{}", inputs.empty() ? " after " : ", ", plan.nodes[input].node->name);
    fingerprint[node.name] = node.type->name + inputs;
    for (const auto& [name, value] : node.arguments) fingerprint[node.name + "." + name] = fingerprint_text(value);
}

void add_simulation(Fingerprint& fingerprint, const PlannedSimulation& simulation)
{
    const std::string& name = simulation.create->name;
    fingerprint["seed of " + name] = fmt::format("{}", simulation.seed);
    std::string kept;
    for (const PlannedAttribute& attribute : simulation.attributes)
        if (attribute.kept) kept += (kept.empty() ? "" : " ") + attribute.name;
    fingerprint["attributes of " + name] = kept;
}

std::vector<std::string> words_of(const std::string& text)
{
    std::vector<std::string> words;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(' ', at), text.size());
        words.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return words;
}

// Describes the first difference between the functions of a file. Functions that only moved to another line are equal.
// of_body: also compares the code outside of functions; false if other reported differences already imply its change.
std::string difference_of_code(const std::string& file, const std::string& was, const std::string& is, bool of_body)
{
    const std::vector<std::string> before = words_of(was), now = words_of(is);
    const auto hash = [](const std::string& word) { return word.substr(word.find(':') + 1); };
    if (before.size() != now.size()) return fmt::format("the functions of {} changed", file);
    for (std::size_t k = 1; k < now.size(); ++k)
        if (hash(before[k]) != hash(now[k]))
            return fmt::format("the function in line {} of {} changed", now[k].substr(0, now[k].find(':')), file);
    if (!of_body || hash(before[0]) == hash(now[0])) return "";
    return fmt::format("{} changed outside its functions", file);
}

}  // namespace

Fingerprint fingerprint_of(const Session& session, const Plan& plan, const fs::path& graph, const Fingerprint& options)
{
    Fingerprint fingerprint = options;
    fingerprint["Rapid"] = RAPID_ABI;
    // Plugins in several folders may have the same name.
    for (const std::string& file : loaded_plugins()) {
        std::string& hashes = fingerprint["the plugin " + fs::path(file).filename().string()];
        hashes += (hashes.empty() ? "" : " ") + hash_text(file_hash(file));
    }
    for (const auto& [file, functions] : session.code()) {
        const bool own = fs::path(file).string().starts_with(lua_folder().string());
        fingerprint[code + name_of(file, own ? lua_folder() : graph.parent_path())] = fingerprint_text(functions);
    }
    for (const PlannedNode& planned : plan.nodes) add_node(fingerprint, planned, plan);
    for (const PlannedSimulation& simulation : plan.simulations) add_simulation(fingerprint, simulation);
    for (const Session::Parameter& parameter : session.parameters())
        fingerprint[parameter.name] = fingerprint_text(parameter.value);
    return fingerprint;
}

std::string hash_of(const Fingerprint& fingerprint)
{
    std::string text;
    for (const auto& [name, value] : fingerprint)
        // Lines are omitted from the code.
        if (name.starts_with(code)) {
            text += fmt::format("{}:{}", name.size(), name);
            for (const std::string& word : words_of(value)) text += word.substr(word.find(':'));
        } else {
            text += fmt::format("{}:{}{}:{}", name.size(), name, value.size(), value);
        }
    return hash_text(content_hash(text));
}

std::vector<std::string> differences(const Fingerprint& was, const Fingerprint& is)
{
    std::vector<std::string> list;
    std::map<std::string, std::pair<const std::string*, const std::string*>> all;
    for (const auto& [name, value] : was) all[name].first = &value;
    for (const auto& [name, value] : is) all[name].second = &value;
    std::vector<std::string> files;
    for (const auto& [name, values] : all) {
        const auto& [before, now] = values;
        if (before && now && *before == *now) continue;
        if (name.starts_with(code) && before && now)
            files.push_back(name);
        else if (name.starts_with(content) && before && now)
            list.push_back(fmt::format("the {} changed", name));
        else if (name.starts_with(content) || name.starts_with(code))
            list.push_back(fmt::format("{} was {}read", name.substr(name.find(" of ") + 4), now ? "not " : ""));
        else
            list.push_back(fmt::format("{} was {}, is {}", name_in_message(name), before ? *before : "missing",
                                       now ? *now : std::string("missing")));
    }
    const bool explained = !list.empty();
    for (const std::string& name : files)
        if (std::string text = difference_of_code(name.substr(code.size()), was.at(name), is.at(name), !explained);
            !text.empty())
            list.push_back(std::move(text));
    return list;
}

void InputContents::add(const fs::path& file)
{
    std::error_code ignored;
    if (code_ == Code::Excluded && file.extension() == ".lua") return;
    if (!fs::is_regular_file(file, ignored)) return;
    const std::string name = content + name_of(file, folder_);
    {
        const std::lock_guard lock(mutex_);
        if (known_.contains(name)) return;
    }
    std::string hash;
    try {
        hash = hash_text(file_hash(file));
    } catch (const Error&) {
        return;  // the reader of the file reports why it cannot be read
    }
    const std::lock_guard lock(mutex_);
    known_[name] = fresh_[name] = hash;
}

Fingerprint InputContents::take()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(fresh_, {});
}

std::string InputContents::content_of(const std::string& name) const
{
    try {
        return hash_text(file_hash(folder_ / name.substr(content.size())));
    } catch (const Error&) {
        return "";
    }
}

bool InputContents::is_content(const std::string& name) { return name.starts_with(content); }

}  // namespace rapid
