#include "bindings/host/maker_cache.h"

#include <algorithm>
#include <cstring>

namespace rapid {
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
