#include "bindings/host/maker.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {
namespace {

std::vector<Maker>& makers()
{
    static std::vector<Maker> all;
    return all;
}

}  // namespace

MakerRegistration::MakerRegistration(Maker (*declare)()) { makers().push_back(declare()); }

const Maker& find_maker(std::string_view name)
{
    const auto found = std::find_if(makers().begin(), makers().end(), [&](const Maker& m) { return m.name == name; });
    if (found == makers().end()) throw Error(fmt::format("rapid.{} is not there", name));
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
