#include "bindings/command/cache_options.h"

#include <fmt/format.h>

#include "include/rapid/run.h"

namespace rapid {

void CacheOptions::declare(Options& options, const std::string& doc_of_folder, const std::string& doc_of_again)
{
    options.add_option("--cache", folder_, doc_of_folder).type_name("DIR");
    options
        .add_option(
            "--cache-every", [this](const std::string& text) { every_ = read_whole("--cache-every", text, 0); },
            fmt::format(
                "with --cache: writes a snapshot after every Nth frame and after the last [default {}]; 0 writes none",
                RunCacheOptions().every))
        .type_name("N");
    options.add_flag("--again", again_, doc_of_again);
}

void CacheOptions::check() const
{
    if (!requested() && every_) throw Error("--cache-every sets how often snapshots are written; it needs --cache DIR");
}

}  // namespace rapid
