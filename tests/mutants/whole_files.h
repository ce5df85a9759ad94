// Whole files, of which mutants are made: one for each reader. Every registered format of points that can be read has
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
    // Corrects the checksum of a mutant. Null if the file has none.
    void (*seal)(std::string& mutant) = nullptr;
    // The file is text that does not say how long it is: cut after a line, it is another whole file.
    bool may_end_at_any_line = false;
    bool may_end_anywhere = false;  // likewise, without a newline at its end, too
    bool has_points = true;         // without any, nothing can be missing
};

std::vector<WholeFile> whole_files();

// A fog whose tree has a branch of 0.3 MB in memory, and 9 kB in the file, for each of these values.
WholeFile sparse_fog(int values);

}  // namespace rapid::test
