#include "runtime/files/left_out.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {
namespace {

thread_local LeftOut* current = nullptr;

}  // namespace

void add_left_out(std::vector<std::string>& list, const std::string& what)
{
    constexpr std::size_t most = 20;
    if (list.size() > most || std::find(list.begin(), list.end(), what) != list.end()) return;
    list.push_back(list.size() < most ? what : fmt::format("more than these {}", most));
}

LeftOut::LeftOut() : outer_(current) { current = this; }

LeftOut::~LeftOut() { current = outer_; }

void LeftOut::add(const std::string& what)
{
    if (current) add_left_out(current->list_, what);
}

}  // namespace rapid
