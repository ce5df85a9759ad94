#include "bindings/host/maker.h"

#include <fmt/format.h>

#include <algorithm>

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

}  // namespace rapid
