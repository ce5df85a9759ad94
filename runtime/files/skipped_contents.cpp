#include "runtime/files/skipped_contents.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {
namespace {

thread_local SkippedContents* current = nullptr;

}  // namespace

void add_note(std::vector<std::string>& list, const std::string& clause)
{
    constexpr std::size_t most = 20;
    if (list.size() > most || std::find(list.begin(), list.end(), clause) != list.end()) return;
    list.push_back(list.size() < most ? clause : fmt::format("there is more than these {} notes", most));
}

void add_skipped(std::vector<std::string>& list, const std::string& what) { add_note(list, "not read: " + what); }

SkippedContents::SkippedContents() : outer_(current) { current = this; }

SkippedContents::~SkippedContents() { current = outer_; }

void SkippedContents::add(const std::string& what)
{
    if (current) add_skipped(current->list_, what);
}

void SkippedContents::note(const std::string& clause)
{
    if (current) add_note(current->list_, clause);
}

}  // namespace rapid
