#include "runtime/base/setting_names.h"

namespace rapid {
namespace {

// Never destroyed: threads may outlive the end of main().
std::map<Setting, std::string>& all_names()
{
    static auto* const names = new std::map<Setting, std::string>{
        {Setting::Memory, "memory"},
        {Setting::ScriptMemory, "script_memory"},
        {Setting::ScriptSeconds, "script_seconds"},
        {Setting::Value, "set"},
        {Setting::Seed, "seed"},
        {Setting::EstimateErrors, "estimate_errors = false"},
        {Setting::Output, "output"},
        {Setting::Frames, "frames"},
        {Setting::PictureSize, "size"},
        {Setting::Statistics, "statistics"},
        {Setting::Profile, "profile"},
        {Setting::Events, "events"},
        {Setting::Cache, "cache"},
        {Setting::CacheAgain, "cache.again"},
        {Setting::Part, "part"},
        {Setting::Parts, "parts"},
        {Setting::Sample, "sample"},
    };
    return *names;
}

}  // namespace

const std::string& name_of(Setting setting) { return all_names().at(setting); }

void name_settings(const std::map<Setting, std::string>& names)
{
    for (const auto& [setting, name] : names) all_names()[setting] = name;
}

}  // namespace rapid
