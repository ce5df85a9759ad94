// Lists of files and folders in environment variables such as RAPID_PATH.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

namespace rapid {

// Returns the parts of "/a:/b" in order, without empty ones.
inline std::vector<std::string> parts_of_path_list(const std::string& list)
{
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin < list.size();) {
        const std::size_t end = std::min(list.find(':', begin), list.size());
        if (end > begin) parts.push_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

// Returns the parts of a variable. Empty if it is not set.
inline std::vector<std::string> path_list_of(const char* variable)
{
    const char* list = std::getenv(variable);
    return list ? parts_of_path_list(list) : std::vector<std::string>();
}

}  // namespace rapid
