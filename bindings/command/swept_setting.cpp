#include "bindings/command/swept_setting.h"

#include <fmt/format.h>

#include "runtime/base/error.h"

namespace rapid {

SweptSetting read_swept_setting(const std::string& option, const std::string& text, const std::string& names)
{
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw Error(fmt::format("{} \"{}\"; it must be {}=VALUE,VALUE,...", option, text, names));
    SweptSetting setting{text.substr(0, equals), {""}};
    int depth = 0;
    for (const char c : text.substr(equals + 1)) {
        depth += (c == '{') - (c == '}');
        if (c == ',' && depth == 0)
            setting.values.emplace_back();
        else
            setting.values.back() += c;
    }
    for (const std::string& value : setting.values)
        if (value.empty()) throw Error(fmt::format("{} {}: a value is missing", option, setting.name));
    return setting;
}

}  // namespace rapid
