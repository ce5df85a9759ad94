// Entries of fingerprints and records for the settings of a run.
#pragma once

#include <string>

namespace rapid {

// Entries for settings, with the command's option names in the files of any program.
constexpr char seed_entry[] = "--seed", part_entry[] = "--part", sample_entry[] = "--sample",
               events_entry[] = "--events";

// Returns the name of an entry in messages.
std::string name_in_message(const std::string& name);

}  // namespace rapid
