// Whole files from which mutants are made, at least one for each reader. Every readable registered point format has
// some; those of meshes, grids and states are listed.
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
    // Corrects the checksum of a mutant. Null if the format has none.
    void (*seal)(std::string& mutant) = nullptr;
    // The file is text without a stated length: cut after a line, it is another whole file.
    bool may_end_at_any_line = false;
    bool may_end_anywhere = false;  // likewise, and also without a newline at its end
    bool has_points = true;         // without points, nothing can be missing
};

std::vector<WholeFile> whole_files();

// A fog that for each of these values has a tree branch of 0.3 MB in memory and 9 kB in the file.
WholeFile sparse_fog(int values);

}  // namespace rapid::test
