#include "runtime/graph/figures.h"

#include <algorithm>
#include <utility>

namespace rapid {

void FrameFigures::append(FrameFigures later)
{
    later.born += born;
    later.died += died;
    later.collisions += collisions;
    later.broken += broken;
    later.contact_limit += contact_limit;
    later.beyond_tolerance = std::max(later.beyond_tolerance, beyond_tolerance);
    later.trapped = std::max(later.trapped, trapped);
    later.substeps = std::max(later.substeps, substeps);
    later.contact_energy += contact_energy;
    if (ledger) {
        Ledger sum = *ledger;
        if (later.ledger) sum.append(*later.ledger);
        later.ledger = sum;
    }
    for (const BandFigures& band : bands) {
        const auto same = std::find_if(later.bands.begin(), later.bands.end(),
                                       [&](const BandFigures& other) { return other.node == band.node; });
        if (same == later.bands.end())
            later.bands.push_back(band);
        else
            same->seconds += band.seconds;
    }
    later.stiff.insert(later.stiff.begin(), stiff.begin(), stiff.end());
    later.script_seconds += script_seconds;
    later.solve_seconds += solve_seconds;
    *this = std::move(later);
}

}  // namespace rapid
