// The machine and the versions on which run times depend.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace rapid {

// Processor, threads, system, and the versions of compiler and libraries; names and values, in order.
std::vector<std::pair<std::string, std::string>> describe_machine(int threads);

}  // namespace rapid
