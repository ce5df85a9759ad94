// What run times depend on, for whoever reads them elsewhere.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace rapid {

// Processor, threads, system, and the versions of what Rapid is built with; names and values, in order.
std::vector<std::pair<std::string, std::string>> describe_machine(int threads);

}  // namespace rapid
