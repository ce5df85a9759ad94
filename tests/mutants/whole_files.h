// A whole file for each reader, of which mutants are made: of each format of points that can be read, as it is
// registered, and of meshes, grids and states.
#pragma once

#include <string>
#include <vector>

#include "tests/mutants/contents.h"

namespace rapid::test {

struct WholeFile {
    std::string reader;  // "points .csv"
    std::string name;    // "a.csv"
    std::string bytes;
    ContentOf content;
    // Puts right in a mutant what would be wrong after any change: a checksum. Null if there is none.
    void (*seal)(std::string& mutant) = nullptr;
    // Text that does not say how much of it there is: cut after a line, it is another whole file.
    bool may_end_at_any_line = false;
};

std::vector<WholeFile> whole_files();

}  // namespace rapid::test
