#include "bindings/host/maker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "runtime/files/frame_pattern.h"

namespace rapid {
namespace {

using Declare = std::vector<Maker> (*)();

std::vector<Declare>& declarations()
{
    static std::vector<Declare> all;
    return all;
}

const std::vector<Maker>& makers()
{
    static const std::vector<Maker> all = [] {
        std::vector<Maker> declared;
        for (const Declare declare : declarations())
            for (Maker& maker : declare()) declared.push_back(std::move(maker));
        return declared;
    }();
    return all;
}

}  // namespace

std::filesystem::path MakeContext::resolve(const std::string& path) const
{
    std::filesystem::path file = FramePattern::of_files(folder / path).name();  // an absolute path stays itself
    if (find_file)
        if (const std::string found = find_file(path); !found.empty()) file = found;
    if (on_read) on_read(file);
    return file;
}

MakerRegistration::MakerRegistration(Declare declare) { declarations().push_back(declare); }

const Maker& find_maker(std::string_view name)
{
    const auto found = std::find_if(makers().begin(), makers().end(), [&](const Maker& m) { return m.name == name; });
    if (found == makers().end()) throw Error(fmt::format("rapid.{} does not exist", name));
    return *found;
}

std::vector<const Maker*> all_makers()
{
    std::vector<const Maker*> all;
    for (const Maker& maker : makers()) all.push_back(&maker);
    std::sort(all.begin(), all.end(), [](const Maker* a, const Maker* b) { return a->name < b->name; });
    return all;
}

namespace {

bool identical(const Table& a, const Table& b)
{
    const auto same_value = [](const Value& x, const Value& y) { return rapid::identical(x, y); };
    const auto same_entry = [](const auto& x, const auto& y) {
        return x.first == y.first && rapid::identical(x.second, y.second);
    };
    return std::equal(a.list.begin(), a.list.end(), b.list.begin(), b.list.end(), same_value) &&
           std::equal(a.numbered.begin(), a.numbered.end(), b.numbered.begin(), b.numbered.end(), same_entry) &&
           std::equal(a.named.begin(), a.named.end(), b.named.begin(), b.named.end(), same_entry);
}

}  // namespace

bool identical(const Value& a, const Value& b)
{
    if (a.index() != b.index() || a.function()) return false;
    if (a.is_nil()) return true;
    if (const Table* table = a.table()) return identical(*table, *b.table());
    if (const auto* number = a.get<double>()) return std::memcmp(number, b.get<double>(), sizeof(double)) == 0;
    if (const auto* v = a.get<Vec3d>()) return std::memcmp(v->data(), b.get<Vec3d>()->data(), 3 * sizeof(double)) == 0;
    if (const auto* truth = a.get<bool>()) return *truth == *b.get<bool>();
    if (const auto* text = a.get<std::string>()) return *text == *b.get<std::string>();
    if (const auto* reference = a.get<AttributeRef>()) return reference->name == b.get<AttributeRef>()->name;
    return *a.get<ObjectPtr>() == *b.get<ObjectPtr>();
}

void MakerCache::begin_call()
{
    last_ = std::move(current_);
    current_.clear();
}

ObjectPtr MakerCache::find(const Maker& maker, const Table& arguments) const
{
    for (const auto* entries : {&current_, &last_})
        for (const Entry& entry : *entries)
            if (entry.maker == &maker && identical(*entry.arguments, arguments)) return entry.object;
    return nullptr;
}

}  // namespace rapid
