#include "bindings/run/setting_entries.h"

#include <map>

#include "runtime/base/setting_names.h"

namespace rapid {

std::string name_in_message(const std::string& name)
{
    static const std::map<std::string, Setting> settings = {{events_entry, Setting::Events},
                                                            {part_entry, Setting::Part},
                                                            {sample_entry, Setting::Sample},
                                                            {seed_entry, Setting::Seed}};
    const auto found = settings.find(name);
    return found == settings.end() ? name : name_of(found->second);
}

}  // namespace rapid
