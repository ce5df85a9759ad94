#include "runtime/files/left_out.h"

#include <algorithm>

namespace rapid {
namespace {

thread_local LeftOut* current = nullptr;

}  // namespace

LeftOut::LeftOut() : outer_(current) { current = this; }

LeftOut::~LeftOut() { current = outer_; }

void LeftOut::add(const std::string& what)
{
    if (!current) return;
    std::vector<std::string>& list = current->list_;
    if (std::find(list.begin(), list.end(), what) == list.end()) list.push_back(what);
}

}  // namespace rapid
