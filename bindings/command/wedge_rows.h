// The rows of a wedge: settings, and the names of the files that each writes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bindings/command/swept_setting.h"

namespace rapid {

struct WedgeRow {
    std::vector<std::pair<std::string, std::string>> settings;  // name and value, in the order of --vary
    std::vector<std::string> outputs;                           // -o, with values in place of {NAME}

    std::string label() const;  // "rate=1000 solve.substeps=4"
};

// All combinations, of which the last setting changes fastest; zip: the n-th values together. In a pattern {NAME}, or
// for NODE.PARAM also {PARAM}, stands for the value; {output} stays. Error: a setting twice; lists of different
// lengths with zip; a name in braces that is not varied; a value that can't be a part of a file's name; rows that
// write the same files.
std::vector<WedgeRow> wedge_rows(const std::vector<SweptSetting>& settings, bool zip,
                                 const std::vector<std::string>& patterns);

}  // namespace rapid
