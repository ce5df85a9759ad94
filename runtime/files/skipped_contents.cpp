#include "runtime/files/skipped_contents.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {
namespace {

thread_local SkippedContents* current = nullptr;

}  // namespace

void add_skipped(std::vector<std::string>& list, const std::string& what)
{
    constexpr std::size_t most = 20;
    if (list.size() > most || std::find(list.begin(), list.end(), what) != list.end()) return;
    list.push_back(list.size() < most ? what : fmt::format("more than these {}", most));
}

SkippedContents::SkippedContents() : outer_(current) { current = this; }

SkippedContents::~SkippedContents() { current = outer_; }

void SkippedContents::add(const std::string& what)
{
    if (current) add_skipped(current->list_, what);
}

}  // namespace rapid
