// The summary of a run: a line for each subject.
#include <fmt/format.h>

#include "runtime/report/number_text.h"
#include "runtime/report/totals.h"

namespace rapid {

std::string summary(const RunStatistics& run, const RunTotals& totals)
{
    return totals.points_text() + totals.frames_text(run.seconds) +
           fmt::format("memory   {} at the peak\n", memory_text(run.peak_bytes)) + totals.error_text() +
           totals.rounding_text() + totals.energy_text() + totals.ledger_text() + totals.contact_text() +
           totals.constraint_text() + totals.sleep_text() + totals.band_text() + advice(run.stiff) +
           totals.warning_text();
}

std::string advice(const std::vector<Stiffness>& stiff)
{
    std::string text;
    for (const Stiffness& stiffness : stiff) text += fmt::format("stiff    {}\n", text_of(stiffness));
    return text;
}

}  // namespace rapid
