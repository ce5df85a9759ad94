// Parses "NAME=A,B,C" of --sweep and --vary: a parameter and its values.
#pragma once

#include <string>
#include <vector>

namespace rapid {

struct SweptSetting {
    std::string name;  // NODE.PARAM, or of a rapid.param
    std::vector<std::string> values;
};

// Commas within braces do not separate values: "wind={1,0,0},{2,0,0}" has two. Throws Error if the text does not have
// this form; the error names the option, and `names`, the kind of name that it takes.
SweptSetting read_swept_setting(const std::string& option, const std::string& text, const std::string& names);

}  // namespace rapid
